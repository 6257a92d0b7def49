"""Clearances, their units, and the rules that refuse a hinge."""

import pickle
from dataclasses import replace
from math import pi

import pytest

from hinges import (
    Bracket,
    Clearance,
    ConePin,
    Detents,
    FilamentPin,
    FitError,
    HingeError,
    Leaf,
    RodPin,
    ScrewPin,
    SingleHinge,
    Stops,
    StraightPin,
    play,
)
from hinges.barrel import default_radii
from hinges.clearance import PROCESSES, millimetres
from hinges.hardware import SCREWS
from hinges.plan_single import SingleSpec, plan_single


@pytest.mark.parametrize(
    ("text", "value"),
    [("0.3", 0.3), ("300um", 0.3), ("300 µm", 0.3), ("12 thou", 0.3048), ("0.01 in", 0.254)],
)
def test_lengths_with_units(text, value):
    assert millimetres(text) == pytest.approx(value)


@pytest.mark.parametrize("text", ["", "wide", "3 furlongs", "0.3.1 mm"])
def test_lengths_that_cannot_be_read(text):
    with pytest.raises(HingeError, match="cannot be read"):
        millimetres(text)


@pytest.mark.parametrize("value", [0.0, -0.1, 6.0, float("nan"), float("inf")])
def test_clearances_out_of_range(value):
    with pytest.raises(HingeError, match="clearance"):
        Clearance(value)


@pytest.mark.parametrize("name", sorted(PROCESSES))
def test_every_process_has_a_default_with_a_source(name):
    process = PROCESSES[name]
    assert process.low <= process.radial <= process.high
    assert Clearance.of(name.upper()).radial == process.radial
    assert len(process.source) > 20


def test_axial_clearance_follows_the_radial_one():
    assert Clearance(0.3).axial == 0.3
    assert Clearance(0.3, "400 um").axial == 0.4
    assert Clearance(0.3, 0.4).least == 0.3


def test_the_recess_is_the_cone_moved_by_the_normal_clearance():
    pin = ConePin(1.5)
    clearance = Clearance(0.3)
    # mouth: r_pin + 0.414 c, so the wall is r - r_pin - 0.414 c
    assert pin.mouth(clearance) == pytest.approx(1.5 + (2**0.5 - 1) * 0.3)
    # the cones are c apart, measured across them
    along = clearance.axial  # from the cone's foot to the recess's mouth
    across = pin.mouth(clearance) - 1.5
    assert (across + along) / 2**0.5 == pytest.approx(0.3)


REFUSED = [
    ("retention", {"knuckles": 2}),
    ("retention", {"knuckles": 2, "pin": FilamentPin()}),
    ("wall", {"radius": 2.0, "pin": ConePin(1.5)}),
    ("cone", {"pin": ConePin(0.7), "radius": 2.5}),
    ("web", {"knuckles": 5, "radius": 2.5, "pin": ConePin(1.5)}),
    ("knuckle", {"length": 15, "knuckles": 7, "pin": FilamentPin()}),
    ("knuckle", {"length": 15, "knuckles": 5, "pin": ScrewPin("M3")}),
    ("pin", {"pin": StraightPin(0.4)}),
    ("bracket", {"leaf": Bracket(3.0)}),
    ("bracket", {"leaf": Leaf(3.0)}),
    ("bracket", {"leaf": Leaf(20.0, 0.4)}),
    ("bracket", {"leaf": Leaf(8.0, holes=2, hole=5.0)}),
    ("chamfer", {"chamfer": 0.7}),
    ("range", {"angular_range": (0.0, 200.0)}),
    ("range", {"angular_range": (-10.0, 90.0)}),
    ("range", {"angular_range": (90.0, 90.0)}),
    ("pose", {"angle": 120.0, "angular_range": (0.0, 90.0)}),
    ("pose", {"angle": 90.0, "angular_range": (0.0, 90.0), "stops": True}),
    ("pose", {"stops": Stops(lower=True)}),
    ("stop", {"stops": Stops(reach=3.2), "angular_range": (0, 90)}),
    ("detent", {"detents": Detents((0.0,), interference=0.3)}),
    ("detent", {"detents": Detents((0.0, 170.0)), "angular_range": (0.0, 90.0)}),
    ("strain", {"radius": 3.4, "pin": ConePin(1.5), "detents": Detents((0.0,), strain=0.001)}),
]


@pytest.mark.parametrize(("rule", "changes"), REFUSED, ids=[r for r, _ in REFUSED])
def test_refusals_name_rule_value_and_remedy(rule, changes):
    options = {"length": 20.0, "clearance": 0.3, **changes}
    with pytest.raises(FitError) as caught:
        plan_single(SingleSpec.read(**options))
    error = caught.value
    assert error.rule == rule
    text = str(error)
    assert text.startswith(f"{rule}: ")
    assert "limit" in text
    assert error.advice in text
    again = pickle.loads(pickle.dumps(error))
    assert (again.rule, str(again)) == (error.rule, text)


@pytest.mark.parametrize(
    "changes",
    [
        {"length": -1.0},
        {"knuckles": 1},
        {"knuckles": 2.5},
        {"gap": 0.0},
        {"gap": 40.0},
        {"chamfer": -0.1},
        {"margin": -1.0},
        {"clearance": "wood"},
        {"bore": "square"},
        {"knuckles": 40},
    ],
    ids=str,
)
def test_parameters_that_make_no_sense(changes):
    with pytest.raises(HingeError):
        plan_single(SingleSpec.read(**{"length": 20.0, "clearance": 0.3, **changes}))


@pytest.mark.parametrize(
    "make",
    [
        lambda: ConePin(1.0, tip=1.2),
        lambda: ConePin(1.0, angle=80.0),
        lambda: StraightPin(0.0),
        lambda: FilamentPin(2.0),
        lambda: RodPin(-1.0),
        lambda: ScrewPin("M7"),
        lambda: ScrewPin("M3", head="countersunk"),
        lambda: ScrewPin("M3", end="weld"),
        lambda: Detents(()),
    ],
)
def test_pins_that_make_no_sense(make):
    with pytest.raises(HingeError):
        make()


def test_default_sizes():
    assert default_radii(20.0, Clearance(0.3)) == (2.5, 1.5)
    for length in (15.0, 20.0, 25.0, 30.0, 40.0):
        spec = SingleSpec.read(length, clearance=0.3)
        plan_single(spec)
        assert spec.margin == pytest.approx(spec.radius + 0.3)


def test_process_sets_the_wall_too():
    assert SingleSpec.read(20.0, clearance="sla").wall == 0.6
    assert SingleSpec.read(20.0, clearance="fdm").wall == 0.8


def test_the_part_refuses_as_the_plan_does():
    with pytest.raises(FitError, match="retention"):
        SingleHinge(20, knuckles=2)


@pytest.mark.slow
@pytest.mark.parametrize("name", SCREWS)
@pytest.mark.parametrize(("end", "sunk"), [("nut", False), ("tap", True)])
def test_a_hinge_on_every_screw_turns_with_its_gaps(name, end, sunk):
    """The screw passes the bores that are wide, and its head and nut find room."""
    screw = SCREWS[name]
    assert screw.tap < screw.diameter < screw.clear < screw.cap
    assert screw.diameter < screw.nut
    length = max(25.0, 14 * screw.diameter)
    hinge = SingleHinge(length, pin=ScrewPin(name, end=end, sunk=sunk), clearance=0.4)
    plan = hinge.plan
    assert plan.layout.radius >= 0.5 * screw.clear + 0.8
    found = play(hinge)
    assert found.radial >= screw.clear - screw.diameter - 1e-9
    assert found.axial[1] > 0


def test_a_thread_alone_names_its_screw():
    assert ScrewPin("#6").screw is SCREWS["#6-32"]
    assert ScrewPin("1/4").screw is SCREWS["1/4-20"]
    with pytest.raises(HingeError, match=r"screw 'M7' is unknown: use one of M1\.6, M2"):
        ScrewPin("M7")


def test_the_length_of_a_screws_thread():
    long = {"clearance": 0.4, "leaf": Bracket(10.0)}
    whole, short = (
        SingleHinge(60, pin=ScrewPin("M3", thread=thread), **long) for thread in (None, 6.0)
    )
    last = whole.plan.layout.knuckles[-1]
    wider = pi * (0.25 * 3.4**2 - 0.25 * 2.6**2) * (last.length - 6.0)
    cut = whole.parent_half.volume - short.parent_half.volume
    assert cut == pytest.approx(wider, rel=1e-3)
    for part in (short.parent_half, short.hardware):  # the screw's core lies in the tapped bore
        assert part.solids()[0].is_valid
    shared = short.parent_half.solid().intersect(short.hardware.solid())
    assert not shared or sum(one.volume for one in shared.solids()) < 1e-6
    for length, words in ((3.0, "use a longer thread"), (40.0, "use a shorter thread")):
        with pytest.raises(FitError, match=words) as refusal:
            SingleHinge(60, pin=ScrewPin("M3", thread=length), **long)
        assert refusal.value.rule == "knuckle"
    with pytest.raises(HingeError, match='give thread with end="tap"'):
        ScrewPin("M3", end="nut", thread=6.0)
    with pytest.raises(HingeError, match="thread is 0 mm"):
        ScrewPin("M3", thread=0.0)
    lying = SingleHinge(60, pin=ScrewPin("M3", thread=6.0), bore="teardrop", **long)
    assert len(lying.solids()) == 2


def test_a_screw_of_its_own_sizes():
    pan = replace(SCREWS["M3"], name="pan", cap=6.0, cap_height=1.8)
    hinge = SingleHinge(40, pin=ScrewPin(pan, sunk=True), clearance=0.4)
    assert pytest.approx(6.0) == hinge.hardware.bounding_box().size.X
    with pytest.raises(HingeError, match="unknown"):
        ScrewPin(3)
