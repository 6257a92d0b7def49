"""Hinges that are placed by an edge, and lids that open so far and no farther."""

from __future__ import annotations

import pytest

pytest.importorskip("build123d")  # a newer one is tried in an environment with little else

import build123d as bd
from build123d import Axis, Box, Location, Plane, Pos

from hinges import Bracket, HingeError, SingleHinge, hinge_location
from hinges.plan_single import SingleSpec


def beside(gap: float = 0.3):
    box = Pos(0, -20, 0) * Box(60, 40 - gap, 36)
    lid = Pos(0, 20, 0) * Box(60, 40 - gap, 36)
    return box, lid


def upper_edge(body, towards: Axis):
    """The edge of the upper face that lies farthest in a direction."""
    return body.edges().group_by(Axis.Z)[-1].sort_by(towards)[-1]


@pytest.mark.slow
@pytest.mark.parametrize("own", ["parent", "child"])
def test_bodies_side_by_side(own: str):
    box, lid = beside()
    edge = upper_edge(box, Axis.Y) if own == "parent" else upper_edge(lid, -Axis.Y)
    hinge = SingleHinge.along(edge, clearance=0.3)
    assert hinge.spec.length == pytest.approx(60)
    one, other = hinge.fit(box, lid, edge=edge)
    by_hand = SingleHinge(60, clearance=0.3).fit(
        box, lid, hinge_location((0, 0, 18.15), (1, 0, 0), (0, 0, 1))
    )
    axis, want = one.joints["hinge"].location, by_hand[0].joints["hinge"].location
    assert (Plane(axis).origin - Plane(want).origin).length < 1e-9
    assert Plane(axis).z_dir.dot(Plane(want).z_dir) == pytest.approx(1.0)
    assert one.volume == pytest.approx(by_hand[0].volume)
    one.joints["hinge"].connect_to(other.joints["hinge"], angle=180)
    assert pytest.approx(18.3 + 36) == other.bounding_box().max.Z


@pytest.mark.slow
def test_a_lid_on_its_box_opens_at_the_back():
    box, lid = Box(60, 40, 30), Pos(0, 0, 15.3 + 10) * Box(60, 40, 20)
    edge = upper_edge(box, Axis.Y)
    hinge = SingleHinge.along(edge, clearance=0.3)
    one, other = hinge.fit(box, lid, edge=edge)
    origin = Plane(one.joints["hinge"].location).origin
    assert tuple(origin) == pytest.approx((0, 20.15, 15.15))
    one.joints["hinge"].connect_to(other.joints["hinge"], angle=180)
    # It hangs behind the box, turned over: its top has come to lie below.
    assert other.solid().center().Y > 20
    assert pytest.approx(15.0 - 20.0, abs=0.01) == other.bounding_box().min.Z


@pytest.mark.slow
def test_bodies_anywhere_and_turned():
    place = Location((10, 20, 30), (40, 50, 60))
    box, lid = beside()
    hinge = SingleHinge(60, clearance=0.3)
    edge = upper_edge(box, Axis.Y)
    one, other = hinge.fit(place * box, place * lid, edge=place * edge)
    assert hinge.sweep(one, other, range(0, 181, 30)).gap == pytest.approx(0.3, abs=0.02)


def test_edges_that_are_none():
    box, lid = beside()
    hinge = SingleHinge(60, clearance=0.3)
    with pytest.raises(HingeError, match="the edge lies on 0 faces of the body"):
        hinge.fit(box, lid, edge=bd.Edge.make_line((0, -20, 0), (10, -20, 0)))
    with pytest.raises(HingeError, match="needs a straight edge; this one is curved"):
        hinge.fit(box, lid, edge=bd.Edge.make_circle(10))
    with pytest.raises(HingeError, match="neither face at the edge looks at the other body"):
        hinge.fit(box, lid, edge=box.edges().group_by(Axis.Z)[0].sort_by(Axis.Y)[0])
    with pytest.raises(HingeError, match="overlap by 1 mm beside the edge"):
        hinge.fit(box, Pos(0, -1.3, 0) * lid, edge=upper_edge(box, Axis.Y))
    with pytest.raises(HingeError, match="either the edge or the place"):
        hinge.fit(box, lid, Location(), edge=upper_edge(box, Axis.Y))
    with pytest.raises(HingeError, match="drawn at 30°: an edge tells the axis"):
        SingleHinge(60, clearance=0.3, angle=30).fit(box, lid, edge=upper_edge(box, Axis.Y))


@pytest.mark.parametrize(
    ("closed", "limits", "lower", "upper"),
    [(0, (0, 110), False, True), (180, (70, 180), True, False)],
)
def test_a_lid_opens_by_an_angle(closed: float, limits, lower: bool, upper: bool):
    drawn = 0 if closed == 0 else 180
    spec = SingleSpec.read(
        40, clearance=0.3, opens=110, closed=closed, angle=drawn, leaf=Bracket(7, 7)
    )
    assert spec.angular_range == limits
    assert (spec.stops.lower, spec.stops.upper) == (lower, upper)


@pytest.mark.slow
@pytest.mark.parametrize("closed", [0, 180])
def test_a_lid_stops_where_it_should(closed: float):
    box, lid = (Pos(0, side * 20, 0) * Box(40, 39.7, 36) for side in (-1, 1))
    hinge = SingleHinge(
        40, clearance=0.3, opens=110, closed=closed, angle=90, leaf=Bracket(7, 7), radius=2.5
    )
    turned = lid.rotate(Axis((0, 0, 18.15), (1, 0, 0)), 90)
    one, other = hinge.fit(box, turned, hinge_location((0, 0, 18.15), (1, 0, 0), (0, 0, 1)))
    stop = 110 if closed == 0 else 70
    sign = 1 if closed == 0 else -1
    before, at, past = hinge.sweep(one, other, [stop - sign * 8, stop, stop + sign * 5]).poses
    assert before.gap > 0.2
    assert at.gap == pytest.approx(0.0, abs=0.02)
    assert past.overlap > 1.0


@pytest.mark.parametrize(
    ("keywords", "words"),
    [
        ({"opens": 200}, "opens is 200"),
        ({"opens": 0}, "opens is 0"),
        ({"opens": 90, "stops": True}, "stands for angular_range and stops"),
        ({"opens": 90, "angular_range": (0, 90)}, "stands for angular_range and stops"),
        ({"opens": 90, "closed": 45}, "closed is 45: give 0 or 180"),
    ],
)
def test_openings_that_make_no_sense(keywords, words: str):
    with pytest.raises(HingeError, match=words):
        SingleHinge(40, **keywords)
