"""Printer profiles and printability checks."""
