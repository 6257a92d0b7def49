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

#: The module that each public name lives in.
_HOMES = {
    "Bracket": "leaf",
    "Clearance": "clearance",
    "ConePin": "printed_pins",
    "Coupon": "tolerance_coupon",
    "Detents": "stops",
    "DoubleHinge": "double",
    "DoubleHingeCarve": "double",
    "DoubleHingePart": "double",
    "FilamentPin": "hardware",
    "FitError": "exceptions",
    "HingeCarve": "single",
    "HingeError": "exceptions",
    "HingeHalf": "single",
    "KernelError": "exceptions",
    "Leaf": "leaf",
    "Magnet": "retention",
    "MagnetPocket": "retention",
    "Play": "joint_play",
    "RodPin": "hardware",
    "ScrewPin": "hardware",
    "SingleHinge": "single",
    "SnapDimple": "retention",
    "SnapSpec": "retention",
    "SnapTongue": "retention",
    "Stops": "stops",
    "StraightPin": "printed_pins",
    "hinge_location": "single",
    "play": "joint_play",
    "total_play": "joint_play",
    "write_coupon": "tolerance_coupon",
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
