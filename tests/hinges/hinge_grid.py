"""The grid of parameters that the property tests sample and the benchmark runs in full."""

from __future__ import annotations

from functools import cache
from itertools import product

from hinges.exceptions import HingeError
from hinges.hardware import FilamentPin, RodPin, ScrewPin
from hinges.plan_double import EDGES, DoublePlan, DoubleSpec, plan_double
from hinges.plan_single import SinglePlan, SingleSpec, plan_single
from hinges.printed_pins import StraightPin

VOXELS = (15.0, 20.0, 25.0, 30.0, 40.0)
KNUCKLES = (2, 3, 4, 5, 6, 7)
PROCESSES = ("fdm", "sla", "sls", "mjf", "polyjet")
PINS = {
    "cone": None,
    "straight": StraightPin(0.8),
    "filament": FilamentPin(),
    "filament 2.85": FilamentPin(2.85),
    "melted filament": FilamentPin(heads=True),
    "M2": ScrewPin("M2"),
    "M2.5 nut": ScrewPin("M2.5", end="nut"),
    "M3 sunk": ScrewPin("M3", end="nut", sunk=True),
    "M2 countersunk": ScrewPin("M2", head="countersunk", sunk=True),
    "rod": RodPin(2.0),
}
BORES = ("round", "teardrop", "octagon")

Singles = tuple[float, int, str, str, str]


def singles() -> list[Singles]:
    """Every (voxel, knuckles, pin, process, bore) of the grid; bores in turn."""
    cases = product(VOXELS, KNUCKLES, PINS, PROCESSES)
    return [
        (*case, BORES[index % 3] if case[2] not in ("cone",) else "round")
        for index, case in enumerate(cases)
    ]


@cache
def plan_of(case: Singles) -> SinglePlan | HingeError:
    """The plan of a case, or the refusal."""
    voxel, knuckles, pin, process, bore = case
    try:
        spec = SingleSpec.read(
            voxel, knuckles=knuckles, pin=PINS[pin], clearance=process, bore=bore
        )
        return plan_single(spec)
    except HingeError as error:
        return error


Doubles = tuple[float, str, str, tuple[float, float], str]


def doubles() -> list[Doubles]:
    """Every (voxel, first edge, second edge, turns, process) of the grid."""
    turns = list(product((90.0, 180.0, 270.0), repeat=2))
    return list(product((20.0, 30.0, 40.0), EDGES, EDGES, turns, ("fdm", "sls")))


@cache
def double_plan_of(case: Doubles) -> DoublePlan | HingeError:
    """The plan of a case, or the refusal."""
    voxel, first, second, turns, process = case
    try:
        return plan_double(
            DoubleSpec.read(voxel, first=first, second=second, turns=turns, clearance=process)
        )
    except HingeError as error:
        return error
