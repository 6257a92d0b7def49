"""Parametric print-in-place hinges for build123d and CadQuery.

>>> from hinges import SingleHinge
>>> hinge = SingleHinge(20, clearance="fdm")
>>> len(hinge.solids())
2

The parts are build123d parts; ``import hinges.cadquery`` gives CadQuery the same ones. Nothing
heavy is imported until it is used.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_HOMES = {
    "Bracket": "leaf",
    "Clearance": "clearance",
    "ConePin": "pins",
    "Coupon": "coupon",
    "Detents": "stops",
    "DoubleHinge": "double",
    "DoubleHingeCarve": "double",
    "DoubleHingePart": "double",
    "FilamentPin": "hardware",
    "FitError": "errors",
    "HingeCarve": "single",
    "HingeError": "errors",
    "HingeHalf": "single",
    "KernelError": "errors",
    "Leaf": "leaf",
    "MagnetPocket": "retention",
    "Play": "wobble",
    "play": "wobble",
    "RodPin": "hardware",
    "ScrewPin": "hardware",
    "SingleHinge": "single",
    "SnapDimple": "retention",
    "SnapTongue": "retention",
    "Magnet": "retention",
    "SnapSpec": "retention",
    "Stops": "stops",
    "StraightPin": "pins",
    "hinge_location": "single",
    "write_coupon": "coupon",
}

__all__ = sorted(_HOMES)  # noqa: PLE0605


def __getattr__(name: str) -> Any:
    """Import a public name on first use."""
    if name not in _HOMES:
        raise AttributeError(f"module 'hinges' has no attribute {name!r}")
    try:
        value = getattr(import_module(f".{_HOMES[name]}", __name__), name)
    except ImportError:
        from .kernel import check_kernel

        check_kernel()  # says how to mend an environment in which two kernels overwrote each other
        raise
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
