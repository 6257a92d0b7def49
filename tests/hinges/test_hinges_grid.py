"""Every accepted hinge is sound at every angle; every refused one says why."""

import numpy as np
import pytest
from hinge_grid import double_plan_of, doubles, plan_of, singles
from hinge_measure import (
    boxes_apart,
    double_bodies,
    exact,
    gap,
    mesh_of,
    overlap,
    pieces,
    posed,
    single_gaps,
)

from hinges.exceptions import FitError, HingeError
from hinges.fit import RULES

ANGLES = np.linspace(0.0, 180.0, 19)


def sample(cases, accepted, count, key):
    """Take every kind in turn, in an order that does not change."""
    kinds = {}
    for case in cases:
        if accepted(case):
            kinds.setdefault(key(case), []).append(case)
    rng = np.random.default_rng(7)
    order = {kind: rng.permutation(len(found)) for kind, found in sorted(kinds.items())}
    return [
        kinds[kind][order[kind][turn]]
        for turn in range(count)
        for kind in sorted(kinds)
        if turn < len(kinds[kind])
    ][:count]


def fits(case):
    return not isinstance(plan_of(case), HingeError)


def fits_double(case):
    return not isinstance(double_plan_of(case), HingeError)


SINGLES = sample(singles(), fits, 20, lambda case: case[2])
DOUBLES = sample(doubles(), fits_double, 12, lambda case: (case[1] == case[2], case[3]))


@pytest.mark.slow
@pytest.mark.parametrize("case", SINGLES, ids=str)
def test_single_is_sound_at_every_angle(case):
    plan = plan_of(case)
    wanted = plan.spec.clearance.least
    for half in (plan.parent, plan.child):
        assert exact(half).is_valid
    found = single_gaps(plan, ANGLES)
    assert found[:, 1].max() == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(found[:, 0], wanted, atol=0.005)
    in_boxes = single_gaps(plan, (0.0, 37.0, 90.0, 145.0, 180.0), size=case[0])
    assert in_boxes[:, 1].max() == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(in_boxes[:, 0], wanted, atol=0.005)


@pytest.mark.slow
@pytest.mark.parametrize("case", DOUBLES, ids=str)
def test_double_is_sound_through_all_sweeps(case):
    plan = double_plan_of(case)
    spec = plan.spec
    wanted, near = spec.clearance.least, spec.clearance.least + 0.06
    for half in (plan.parent, plan.link, plan.child):
        assert exact(half).is_valid
    parent, link, child = double_bodies(plan, boxes=True)
    assert pieces(parent) == pieces(link) == pieces(child) == 1
    first, second = (np.linspace(0.0, turn, int(turn / 15.0) + 1) for turn in spec.turns)
    for angle in first:
        turned, _ = posed(plan, link, child, angle, 0.0)
        assert overlap(parent, turned) == pytest.approx(0.0, abs=1e-9)
        assert gap(parent, turned, near) == pytest.approx(wanted, abs=0.005)
    for angle in second:
        _, turned = posed(plan, link, child, 0.0, angle)
        assert overlap(link, turned) == pytest.approx(0.0, abs=1e-9)
        assert gap(link, turned, near) == pytest.approx(wanted, abs=0.005)
    sweeps = [(a, b) for a in first[::3] for b in (0.0, spec.turns[1])]
    sweeps += [(a, b) for b in second[::3] for a in (0.0, spec.turns[0])]
    for a, b in sweeps:
        if boxes_apart(plan, a, b):
            _, turned = posed(plan, link, child, a, b)
            assert overlap(parent, turned) == pytest.approx(0.0, abs=1e-9)
            assert gap(parent, turned, near) >= wanted - 0.005


def test_every_refusal_of_the_grid_says_why():
    refused = [plan for plan in map(plan_of, singles()) if isinstance(plan, HingeError)]
    refused += [plan for plan in map(double_plan_of, doubles()) if isinstance(plan, HingeError)]
    assert refused
    for error in refused:
        if isinstance(error, FitError):
            assert error.rule in RULES
            assert error.value < error.limit
            assert str(error).startswith(error.rule)
            assert error.advice in str(error)
        else:
            assert ": use " in str(error)


def test_most_of_the_grid_is_accepted():
    plans = [plan_of(case) for case in singles()]
    assert sum(not isinstance(plan, HingeError) for plan in plans) > 0.6 * len(plans)


@pytest.mark.slow
def test_exact_and_mesh_halves_have_the_same_volume():
    for case in SINGLES[:4]:
        plan = plan_of(case)
        for half in (plan.parent, plan.child):
            assert mesh_of(half).volume() == pytest.approx(exact(half).volume, rel=3e-3)


def test_a_double_hinge_leaves_the_boxes_whole():
    plan = double_plan_of((20.0, "+y", "+z", (270.0, 270.0), "fdm"))
    parent, _, child = double_bodies(plan, boxes=True)
    assert parent.volume() == pytest.approx(child.volume(), rel=1e-6)
    assert parent.volume() > 0.6 * 20.0**3
