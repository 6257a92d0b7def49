"""The studio: a page, served on this machine only, in which a kit is looked at and changed."""
