"""fabfold: turn a 3D model into one printed object that folds into a box."""

from __future__ import annotations

__all__ = ["__version__"]

__version__ = "0.1.0"
