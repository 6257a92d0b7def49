"""Play from clearances against sampled collisions of the halves' meshes."""

import numpy as np
import pytest

from hinges import DoubleHinge, FilamentPin, HingeError, SingleHinge, StraightPin
from hinges.joint_play import Play, contacts, largest_tilt, play, total_play
from hinges.plan_single import SingleSpec, plan_single
from hinges.shape_meshes import half_manifolds

ANGLE = 60.0


def bodies(plan, segments=128):
    parent, child = (
        half_manifolds(plan.parent, segments)[0],
        half_manifolds(plan.child, segments)[0],
    )
    return parent, child.rotate((0, 0, ANGLE))


def free(parent, child, shift):
    return (parent ^ child.translate(tuple(shift))).volume() < 1e-7


def furthest(parent, child, direction, most=0.6):
    low, high = 0.0, most
    for _ in range(8):
        middle = 0.5 * (low + high)
        if free(parent, child, middle * np.asarray(direction)):
            low = middle
        else:
            high = middle
    return low


@pytest.mark.slow
@pytest.mark.parametrize("pin", [None, StraightPin(0.8)], ids=["cone", "straight"])
def test_shifts_against_sampled_collisions(pin):
    plan = plan_single(SingleSpec.read(20, clearance=0.3, pin=pin))
    found = play(plan, ANGLE)
    parent, child = bodies(plan)
    around = np.arange(0.0, 2 * np.pi, np.pi / 6)
    shifts = [furthest(parent, child, (np.cos(a), np.sin(a), 0.0)) for a in around]
    assert found.radial == pytest.approx(max(shifts), rel=0.03)
    assert found.radial_least == pytest.approx(min(shifts), rel=0.03)
    along = [furthest(parent, child, (0.0, 0.0, s)) for s in (-1.0, 1.0)]
    assert found.axial == pytest.approx(along, rel=0.02)


def test_cone_play_is_what_the_geometry_says():
    found = play(SingleHinge(20, clearance=0.3), ANGLE)
    assert found.radial == pytest.approx(0.3 * 2**0.5, rel=2e-3)
    assert found.radial_least == pytest.approx(0.3, rel=2e-3)
    assert found.axial == pytest.approx((0.3, 0.3))


def turned_about(child, direction, tilt, shift):
    about = np.array([np.cos(direction), np.sin(direction), 0.0])
    skew = np.array([[0, 0, about[1]], [0, 0, -about[0]], [-about[1], about[0], 0]])
    matrix = np.eye(3) + np.sin(tilt) * skew + (1 - np.cos(tilt)) * skew @ skew
    return child.transform(np.column_stack([matrix, shift]))


@pytest.mark.slow
@pytest.mark.parametrize("direction", [0.0, 1.0, 2.0])
def test_tilt_against_sampled_collisions(direction):
    plan = plan_single(SingleSpec.read(20, clearance=0.3))
    parent, child = bodies(plan)
    shift, tilt = largest_tilt(*contacts(plan, ANGLE), direction)
    well_within = turned_about(child, direction, 0.93 * tilt, 0.93 * np.array(shift))
    assert (parent ^ well_within).volume() < 1e-7
    # a little more is free for no shift at all, on a fine grid around the best one
    steps = np.linspace(-0.15, 0.15, 5)
    for x in steps:
        for y in steps:
            for z in (-0.1, 0.0, 0.1):
                moved = turned_about(child, direction, 1.12 * tilt, np.add(shift, (x, y, z)))
                assert (parent ^ moved).volume() > 1e-7
    assert 0.0 < tilt < np.radians(8.0)


@pytest.mark.slow
def test_more_clearance_more_play_and_longer_hinge_less_tilt():
    small, large = (play(SingleHinge(25, clearance=c), ANGLE) for c in (0.2, 0.4))
    assert large.radial > small.radial
    assert large.tilt > small.tilt
    short, long = (play(SingleHinge(n, radius=2.5, clearance=0.3), ANGLE) for n in (20, 40))
    assert long.tilt < short.tilt


def test_a_loose_pin_adds_its_room_on_both_sides():
    hinge = SingleHinge(20, clearance=0.3, pin=FilamentPin(grip=0.05, slip=0.15))
    assert play(hinge, ANGLE).radial == pytest.approx(0.2, rel=2e-3)


@pytest.mark.slow
def test_a_chain_adds_up():
    double = DoubleHinge(20, clearance=0.3)
    one = play(SingleHinge(20, clearance=0.3), 90)
    both = play(double)
    assert both.radial == pytest.approx(2 * one.radial, rel=1e-6)
    assert both.tilt == pytest.approx(2 * one.tilt, rel=1e-6)
    assert total_play([one, one, one]).axial[0] == pytest.approx(0.9)
    assert both.at(20.0) == pytest.approx(both.radial + 20 * np.radians(both.tilt))
    assert play(DoubleHinge(30, second="+y", clearance=0.3)).radial > 0.3


def test_refusals():
    with pytest.raises(HingeError, match="play"):
        play("hinge")
    with pytest.raises(HingeError, match="chain"):
        total_play([])
    assert Play(1, 1, (1, 1), 0).at(10) == 1
