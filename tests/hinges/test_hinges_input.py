"""What a user may give a hinge: lengths with units, and a sentence for what makes no sense."""

from __future__ import annotations

import typing

import pytest

pytest.importorskip("build123d")  # a newer one is tried in an environment with little else

import hinges
from hinges import (
    Bracket,
    Clearance,
    ConePin,
    Detents,
    DoubleHinge,
    FilamentPin,
    FitError,
    HingeError,
    ScrewPin,
    SingleHinge,
)
from hinges.clearance import PROCESSES


@pytest.mark.parametrize(
    ("keywords", "words"),
    [
        ({"pin": "cone"}, "pin is 'cone': give a pin, such as ConePin"),
        ({"pin": ConePin}, r"pin is the class ConePin: make one of it, such as pin=ConePin\("),
        ({"stops": 110}, "the angle at which a stop stands is an end of angular_range"),
        ({"angular_range": 110}, r"angular_range is 110: give .* such as \(0, 110\)"),
        ({"angular_range": (0, "x")}, "angular_range is 'x': give a finite number"),
        ({"wall": -1}, "wall is -1 mm: give a length above 0"),
        ({"wall": 0}, "wall is 0 mm"),
        ({"gap": -0.3}, "gap is -0.3 mm"),
        ({"margin": -1}, "margin is -1 mm: give a length of 0 or more"),
        ({"clearance": 0.01}, "give 0.05 to 5 mm"),
        ({"clearance": float("nan")}, "radial clearance is nan"),
        ({"radius": float("nan")}, "radius is nan: give a finite number"),
        ({"radius": "3"}, "radius is '3': give a finite number"),
        ({"angle": None}, "angle is None: give a finite number"),
        ({"detents": 90}, "detents is 90: give Detents"),
        ({"leaf": 3}, r"leaf is 3: give Bracket\(...\), Leaf"),
        ({"up": float("inf")}, "up is inf"),
    ],
)
def test_nonsense_is_refused_in_a_sentence(keywords: dict[str, typing.Any], words: str) -> None:
    with pytest.raises(HingeError, match=words):
        SingleHinge(20, **keywords)


@pytest.mark.parametrize(
    ("keywords", "words"),
    [
        ({"turns": 180}, r"turns is 180: give how far .* such as \(180, 90\)"),
        ({"angles": (0, float("nan"))}, "angles is nan"),
        ({"plate": 0}, "plate is 0 mm"),
        ({"bracket": 2}, r"bracket is 2: give Bracket"),
    ],
)
def test_nonsense_of_a_double_is_refused(keywords: dict[str, typing.Any], words: str) -> None:
    with pytest.raises(HingeError, match=words):
        DoubleHinge(20, **keywords)


@pytest.mark.parametrize("length", ["2 inches", "nan", float("nan"), None, True, [20]])
def test_a_length_that_is_none_is_named(length: typing.Any) -> None:
    with pytest.raises(HingeError, match=r"^length"):
        SingleHinge(length)


def test_lengths_with_units() -> None:
    assert SingleHinge("2 in", clearance=0.4).spec.length == pytest.approx(50.8)
    assert DoubleHinge("2 cm", clearance="300 um").spec.size == pytest.approx(20.0)


def test_bodies_printed_together_lie_no_nearer_than_the_clearance() -> None:
    with pytest.raises(FitError, match="use a larger gap, or a loose pin") as caught:
        SingleHinge(20, clearance=0.4, gap=0.2)
    assert caught.value.rule == "gap"
    assert SingleHinge(30, clearance=0.4, gap=0.2, pin=FilamentPin()).spec.gap == 0.2


def test_a_single_detent_may_stand_alone() -> None:
    assert Detents(90).angles == (90.0,)
    with pytest.raises(HingeError, match="a detent's angle is 'x'"):
        Detents(("x",))


def test_the_call_is_shown() -> None:
    hinge = SingleHinge(30, clearance=0.3, angle=45, leaf=Bracket(6, 6))
    assert repr(hinge).startswith("SingleHinge(30, clearance=0.3, leaf=Bracket(width=6, depth=6")
    again = eval(repr(hinge), vars(hinges) | {"SingleHinge": SingleHinge, "Bracket": Bracket})
    assert again.spec == hinge.spec
    assert repr(DoubleHinge(20, second="+z")) == "DoubleHinge(20, second='+z')"


def test_annotations_can_be_read() -> None:
    for function in (SingleHinge.__init__, SingleHinge.fit, DoubleHinge.__init__, DoubleHinge.fit):
        assert "return" in typing.get_type_hints(function)


def test_defaults_of_processes() -> None:
    assert {name: process.radial for name, process in PROCESSES.items()} == {
        "fdm": 0.4,
        "sla": 0.3,
        "sls": 0.6,
        "mjf": 0.5,
        "polyjet": 0.35,
    }
    assert Clearance.of("fdm").radial == 0.4


def volume_shared(one: typing.Any, other: typing.Any) -> float:
    both = one.intersect(other) or ()
    solids = both.solids() if hasattr(both, "solids") else [s for b in both for s in b.solids()]
    return float(sum(solid.volume for solid in solids))


@pytest.mark.slow
@pytest.mark.parametrize("angle", [0, 50])
@pytest.mark.parametrize("size", ["M2", "M3"])
@pytest.mark.parametrize("knuckles", [2, 3])
def test_a_sunk_nut_lies_as_its_pocket_does(size: str, angle: float, knuckles: int) -> None:
    hinge = SingleHinge(
        40, knuckles=knuckles, pin=ScrewPin(size, end="nut", sunk=True), angle=angle, clearance=0.3
    )
    _, nut = hinge.hardware.solids()
    owner = hinge.child_half if knuckles == 2 else hinge.parent_half
    assert volume_shared(nut, owner) < 1e-6
    # Turned by a sixth part of a turn it is the same; by half of that its corners are in the wall.
    import build123d as bd

    assert volume_shared(nut.rotate(bd.Axis.Z, 60), owner) < 1e-6
    assert volume_shared(nut.rotate(bd.Axis.Z, 30), owner) > 0.3


@pytest.mark.parametrize("knuckles", [3, 4])
def test_a_nut_that_stands_out_is_clear_of_both_brackets(knuckles: int) -> None:
    hinge = SingleHinge(40, knuckles=knuckles, pin=ScrewPin("M3", end="nut"), clearance=0.3)
    screw, nut = hinge.hardware.solids()
    turning = hinge.child_half if knuckles % 2 else hinge.parent_half
    assert nut.distance_to(turning) >= 0.3 - 1e-6
    if knuckles % 2:
        assert screw.distance_to(hinge.child_half) > 0.0


@pytest.mark.slow
def test_editors_and_type_checkers_know_the_names() -> None:
    api = pytest.importorskip("mypy.api", reason="a type checker is not part of this environment")
    code = "from hinges import SingleHinge, __version__\nSingleHinge(20, clearnce=0.3)\n"
    code += "reveal_type(SingleHinge(20).spec.length)\nreveal_type(__version__)\n"
    said, _, status = api.run(
        ["--config-file=", "--follow-imports=silent", "--no-incremental", "-c", code]
    )
    assert status == 1
    assert 'Unexpected keyword argument "clearnce" for "SingleHinge"' in said
    assert 'Revealed type is "builtins.float"' in said or 'type is "float"' in said
    assert "str" in said
