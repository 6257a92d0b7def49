"""The version of fabfold: part of every key and of every file that names its maker."""

from __future__ import annotations

__all__ = ["__version__"]

__version__ = "0.1.0"
