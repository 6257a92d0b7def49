"""Kits that are printed body by body: the order in which pins go in, and plates to print."""

from __future__ import annotations
