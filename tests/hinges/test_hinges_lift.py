"""Pins that the child is lifted off from: only along +z, and only at the angles asked for."""

from __future__ import annotations

import pytest

pytest.importorskip("build123d")  # a newer one is tried in an environment with little else

from build123d import Box, Pos
from hinge_measure import block, exact, fitted, gap, mesh_of, overlap, single_gaps, turned

from hinges import Arm, Bracket, FitError, HingeError, Leaf, LiftPin, SingleHinge, play
from hinges.plan_single import SinglePlan, SingleSpec, plan_single
from hinges.turn_sweep import mesh_of_part

ROUND = [10.0 * step for step in range(19)]


def planned(pin: LiftPin, length: float = 40, **options) -> SinglePlan:
    spec = SingleSpec.read(length, **{"knuckles": 2, "clearance": 0.3, "pin": pin, **options})
    return plan_single(spec)


def bodies(plan: SinglePlan):
    """Both halves, in boxes where they stand on brackets."""
    if isinstance(plan.spec.leaf, Bracket):
        return fitted(block(40, -40, 0.3), plan.parent), fitted(block(40, 0.0, 0.3), plan.child)
    return mesh_of(plan.parent), mesh_of(plan.child)


LEAVES = [Bracket(), Leaf(14.0), Arm(), Arm.pair(14.0)]


@pytest.mark.slow
@pytest.mark.parametrize("leaf", LEAVES, ids=["bracket", "leaf", "arm", "pair"])
@pytest.mark.parametrize("at", [None, (60.0, 150.0)])
def test_the_child_comes_off_where_it_shall_and_nowhere_else(leaf, at):
    pin = LiftPin(1.5, at=at)
    plan = planned(pin, leaf=leaf)
    gaps = single_gaps(plan, ROUND, 40.0 if isinstance(leaf, Bracket) else None)
    assert gaps[:, 0].min() == pytest.approx(0.3, abs=1e-5)
    assert gaps[:, 1].max() == 0.0
    parent, child = bodies(plan)
    travel = pin.travel(plan.layout)
    for angle in (0.0, 20.0, 60.0, 105.0, 150.0, 180.0):
        posed = turned(child, angle)

        def lifted(height: float, posed=posed):
            return posed.translate((0.0, 0.0, height))

        if at is None or angle in at:
            ways = [gap(parent, lifted(travel * step / 8), 0.5) for step in range(9)]
            assert min(ways) == pytest.approx(0.3, abs=0.005)
            assert overlap(parent, lifted(travel + 30.0)) == 0.0
        else:
            assert gap(parent, lifted(0.29), 0.5) == pytest.approx(0.01, abs=0.002)
            assert overlap(parent, lifted(0.6)) > 0.1
            assert overlap(parent, lifted(0.5 * travel)) > 0.1
        assert overlap(parent, lifted(-0.4)) > 0.5  # it stands on the parent's knuckle


def test_the_tooth_holds_however_the_child_leans():
    plan = planned(LiftPin(1.5, at=90.0))
    parent, child = mesh_of(plan.parent), mesh_of(plan.child)
    for x, y in ((0.29, 0), (-0.29, 0), (0, 0.29), (0, -0.29)):
        leaning = turned(child, 30.0).translate((x, y, 0.0))
        assert overlap(parent, leaning) == pytest.approx(0.0, abs=1e-6)
        assert overlap(parent, leaning.translate((0, 0, 1.0))) > 0.05


def test_the_window_beside_its_angle():
    pin = LiftPin(1.5, at=90.0)
    plan = planned(pin, leaf=Leaf(12.0))
    parent, child = mesh_of(plan.parent), mesh_of(plan.child)
    window = pin.window(plan.layout)
    assert 3.0 < window < 10.0
    for side in (-1.0, 1.0):
        for share, free in ((0.95, True), (1.3, False)):
            posed = turned(child, 90.0 + side * share * window).translate((0.0, 0.0, 1.0))
            assert (overlap(parent, posed) < 1e-6) == free
    assert LiftPin(1.5).window(plan.layout) == 180.0


def test_exact_halves_and_play():
    plan = planned(LiftPin(1.5, at=90.0), leaf=Leaf(12.0))
    for half, shape in (("parent", plan.parent), ("child", plan.child)):
        assert exact(shape, half).volume == pytest.approx(mesh_of(shape).volume(), rel=0.01)
    hinge = SingleHinge(40, knuckles=2, clearance=0.3, pin=LiftPin(1.5))
    assert play(hinge).axial == (pytest.approx(0.3), float("inf"))
    assert play(plan).axial == pytest.approx((0.3, 0.3))
    assert len(hinge.solids()) == 2
    assert "LiftPin(radius=1.5" in repr(hinge)


@pytest.mark.slow
def test_a_lid_lifts_off_its_box():
    hinge = SingleHinge(40, knuckles=2, clearance=0.3, pin=LiftPin(1.5, at=110.0))
    parent, child = (Pos(side * 10.075, -10.075) * Box(19.85, 19.85, 40) for side in (-1, 1))
    box, lid = hinge.fit(parent, child)
    pin, posed = mesh_of_part(box), mesh_of_part(lid)
    for angle, free in ((110.0, True), (30.0, False)):
        turned_lid = turned(posed, angle)
        ways = [overlap(pin, turned_lid.translate((0, 0, 4.0 * step))) for step in range(1, 11)]
        assert (max(ways) < 1e-3) == free
    assert hinge.sweep(box, lid, ROUND).gap == pytest.approx(0.3, abs=0.01)


@pytest.mark.parametrize(
    ("pin", "options", "rule", "words"),
    [
        (LiftPin(1.5), {"knuckles": 3}, "retention", "use knuckles=2"),
        (LiftPin(0.5), {}, "pin", "the thickness of the printed pin"),
        (LiftPin(1.5, at=90.0, tooth=0.7), {}, "retention", "over the rim of the bore"),
        (LiftPin(1.5, at=(90.0, 120.0)), {}, "retention", "between them nothing would hold it"),
        (LiftPin(1.5, at=90.0), {"radius": 3.0}, "wall", "the barrel wall"),
        (LiftPin(3.0), {"length": 18}, "retention", "the child tilts off"),
    ],
)
def test_a_pin_that_cannot_work_is_refused(pin, options, rule, words):
    with pytest.raises(FitError, match=words) as refusal:
        planned(pin, **options)
    assert refusal.value.rule == rule


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: LiftPin(0.0), "must be above 0"),
        (lambda: LiftPin(1.5, at=()), "at least one angle"),
        (lambda: LiftPin(1.5, at=("x",)), "give a finite number"),
        (lambda: LiftPin(1.5, tooth=1.0), "give at"),
        (lambda: LiftPin(1.5, at=90, tooth=-1.0), "tooth -1 mm must be above 0"),
    ],
)
def test_nonsense_is_refused_in_a_sentence(make, words):
    with pytest.raises(HingeError, match=words):
        make()
