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
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    # For editors and type checkers; when it runs, names are imported on first use.
    from .arm import Arm as Arm
    from .ball_socket import BallSocket as BallSocket
    from .clearance import Clearance as Clearance
    from .coupon_files import write_coupon as write_coupon
    from .double import DoubleHinge as DoubleHinge
    from .double import DoubleHingeCarve as DoubleHingeCarve
    from .double import DoubleHingePart as DoubleHingePart
    from .edges import hinge_location as hinge_location
    from .exceptions import FitError as FitError
    from .exceptions import HingeError as HingeError
    from .exceptions import KernelError as KernelError
    from .fold_snap import FoldSnap as FoldSnap
    from .folded_sheet import FoldedSheet as FoldedSheet
    from .hardware import FilamentPin as FilamentPin
    from .hardware import RodPin as RodPin
    from .hardware import Screw as Screw
    from .hardware import ScrewPin as ScrewPin
    from .joint_play import Play as Play
    from .joint_play import play as play
    from .joint_play import total_play as total_play
    from .leaf import Bracket as Bracket
    from .leaf import Leaf as Leaf
    from .lift_pin import LiftPin as LiftPin
    from .living_hinge import LivingHinge as LivingHinge
    from .print_files import write_3mf as write_3mf
    from .print_files import write_step as write_step
    from .printed_pins import ConePin as ConePin
    from .printed_pins import StraightPin as StraightPin
    from .retention import Magnet as Magnet
    from .retention import MagnetPocket as MagnetPocket
    from .retention import SnapDimple as SnapDimple
    from .retention import SnapSpec as SnapSpec
    from .retention import SnapTongue as SnapTongue
    from .single import HingeCarve as HingeCarve
    from .single import HingeHalf as HingeHalf
    from .single import SingleHinge as SingleHinge
    from .stops import Detents as Detents
    from .stops import Stops as Stops
    from .tolerance_coupon import Coupon as Coupon

#: The module that each public name lives in.
_HOMES = {
    "Arm": "arm",
    "BallSocket": "ball_socket",
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
    "FoldSnap": "fold_snap",
    "FoldedSheet": "folded_sheet",
    "HingeCarve": "single",
    "HingeError": "exceptions",
    "HingeHalf": "single",
    "KernelError": "exceptions",
    "Leaf": "leaf",
    "LiftPin": "lift_pin",
    "LivingHinge": "living_hinge",
    "Magnet": "retention",
    "MagnetPocket": "retention",
    "Play": "joint_play",
    "RodPin": "hardware",
    "Screw": "hardware",
    "ScrewPin": "hardware",
    "SingleHinge": "single",
    "SnapDimple": "retention",
    "SnapSpec": "retention",
    "SnapTongue": "retention",
    "Stops": "stops",
    "StraightPin": "printed_pins",
    "hinge_location": "edges",
    "play": "joint_play",
    "total_play": "joint_play",
    "write_3mf": "print_files",
    "write_coupon": "coupon_files",
    "write_step": "print_files",
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
