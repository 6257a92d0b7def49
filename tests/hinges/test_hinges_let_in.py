"""What `fit` looks at: quadrants, the turn, the length of the edge, and what stands out."""

from __future__ import annotations

import pytest

pytest.importorskip("build123d")  # a newer one is tried in an environment with little else

import build123d as bd
from build123d import Box, BuildPart, Location, Part, Pos, Rot

from hinges import Bracket, DoubleHinge, HingeError, SingleHinge, hinge_location
from hinges.turn_sweep import mesh_of_part


def pair(length: float = 40, wide: float = 30, thick: float = 20, gap: float = 0.3):
    """Two boxes beside one another below y = 0, half a gap inside their quadrants."""
    made = []
    for side in (-1, 1):
        box = Box(wide - gap / 2, thick - gap / 2, length)
        made.append(Pos(side * (wide / 2 + gap / 4), -(thick / 2 + gap / 4), 0) * box)
    return made


@pytest.mark.slow
def test_sound_bodies_turn_with_their_gap():
    hinge = SingleHinge(40, clearance=0.3)
    parent, child = hinge.fit(*pair())
    swept = hinge.sweep(parent, child)
    assert [pose.angle for pose in swept.poses] == [5.0 * step for step in range(37)]
    assert swept.gap == pytest.approx(0.3, abs=0.02)
    assert swept.worst.overlap == 0.0
    # The measure does not depend on where the joints have put the child.
    parent.joints["hinge"].connect_to(child.joints["hinge"], angle=120)
    again = hinge.sweep(parent, child, [0, 90, 180])
    assert [pose.gap for pose in again.poses] == pytest.approx(
        [swept.poses[index].gap for index in (0, 18, 36)], abs=1e-4
    )


@pytest.mark.slow
@pytest.mark.parametrize("angle", [30, 110, 180])
def test_bodies_drawn_at_any_angle(angle: float):
    hinge = SingleHinge(40, clearance=0.3, angle=angle)
    parent, child = pair()
    parent, child = hinge.fit(parent, child.rotate(bd.Axis.Z, angle))
    assert hinge.sweep(parent, child, range(0, 181, 10)).gap == pytest.approx(0.3, abs=0.02)


def test_bodies_the_wrong_way_round():
    parent, child = pair()
    with pytest.raises(HingeError, match=r"overlap by .* the wrong way round: swap them"):
        SingleHinge(40, clearance=0.3).fit(child, parent)


@pytest.mark.slow
def test_a_body_above_the_axis():
    parent, child = pair()
    with pytest.raises(HingeError, match=r"overlap by .* the child reaches 3.85 mm outwards"):
        SingleHinge(40, clearance=0.3).fit(parent, Pos(0, 4.15, 0) * child)
    hinge = SingleHinge(40, clearance=0.3, angular_range=(0, 60))
    parent, child = hinge.fit(parent, Pos(0, 4.15, 0) * child, check=False)
    assert hinge.sweep(parent, child, [180]).worst.overlap > 100


def test_a_hinge_longer_than_its_edge():
    with pytest.raises(HingeError, match=r"beyond the parent body, which is 40 mm long there"):
        SingleHinge(60, clearance=0.3).fit(*pair(length=40))


@pytest.mark.slow
def test_bodies_that_touch_print_in_one_piece():
    flush = [Pos(side * 15, -10, 0) * Box(30, 20, 40) for side in (-1, 1)]
    with pytest.raises(HingeError, match=r"0 mm apart and print in one piece: keep each"):
        SingleHinge(40, clearance=0.3).fit(*flush)


def outside(part: Part, bounds: Part) -> float:
    left = part.cut(bounds)
    solids = left.solids() if hasattr(left, "solids") else [s for one in left for s in one.solids()]
    return float(sum(solid.volume for solid in solids))


@pytest.mark.slow
def test_no_fin_stands_out_of_a_thin_lid():
    """The bracket is 4 mm deep, the lid 2: what is not barrel stays within the lid."""
    hinge = SingleHinge(40, clearance=0.3, radius=2.5)
    parent, _ = pair()
    lid = Pos(15.075, -1.15, 0) * Box(29.85, 2.0, 40)
    _, fitted = hinge.fit(parent, lid)
    room = Pos(15.075, -1.15, 0) * Box(29.85, 2.0, 40)
    barrel = bd.Cylinder(2.52, 100)
    assert outside(fitted, room + barrel) < 1e-3
    assert hinge.child_half.bounding_box().min.Y < -3.5  # what would have stood out
    assert len(fitted.solids()) == 1


@pytest.mark.slow
@pytest.mark.parametrize("wall", [1.2, 2.0])
@pytest.mark.parametrize("gusset", [False, True])
def test_no_wedge_stands_out_of_a_wall(wall: float, gusset: bool):
    hinge = SingleHinge(40, clearance=0.3, leaf=Bracket(gusset=gusset))
    _, child = pair()
    plate = Pos(-0.15 - wall / 2, -20.15, 0) * Box(wall, 40, 40)
    fitted, _ = hinge.fit(plate, child)
    room = Pos(-0.15 - wall / 2, -20.15, 0) * Box(wall, 40, 40)
    assert outside(fitted, room + bd.Cylinder(hinge.spec.radius + 0.02, 100)) < 1e-3


@pytest.mark.slow
def test_a_bracket_may_fill_a_hollow():
    """Behind a thin wall the gusset stays: it is what carries the knuckles there."""
    hinge = SingleHinge(40, clearance=0.3, leaf=Bracket(gusset=True))
    parent, child = pair()
    hollow = parent - Pos(-15.075, -10.15, 0) * Box(26, 16, 36)
    fitted, _ = hinge.fit(hollow, child)
    plain, _ = SingleHinge(40, clearance=0.3, leaf=Bracket(gusset=True)).fit(parent, child)
    cavity = Pos(-15.075, -10.15, 0) * Box(26, 16, 36)
    inside = fitted.intersect(cavity).solids()
    assert sum(solid.volume for solid in inside) > 50
    assert plain.volume > fitted.volume


@pytest.mark.slow
def test_builders_are_bodies_and_two_solids_are_none():
    parent, child = pair()
    with BuildPart() as built:
        bd.add(parent)
    fitted, _ = SingleHinge(40, clearance=0.3).fit(built, child)
    assert len(fitted.solids()) == 1
    two = Part([*parent.solids(), *(Pos(0, 0, 100) * parent).solids()])
    with pytest.raises(HingeError, match="the parent body has 2 solids: a hinge is let into one"):
        SingleHinge(40, clearance=0.3).fit(two, child)
    with pytest.raises(HingeError, match="the child body is 3: give a Part"):
        SingleHinge(40, clearance=0.3).fit(parent, 3)


@pytest.mark.slow
def test_fit_works_where_bodies_stand():
    parent, child = pair()
    place = Location((10, 20, 30), (40, 50, 60))
    hinge = SingleHinge(40, clearance=0.3)
    parent, child = hinge.fit(place * parent, place * child, place)
    assert hinge.sweep(parent, child, range(0, 181, 30)).gap == pytest.approx(0.3, abs=0.02)


@pytest.mark.slow
def test_a_lid_on_a_box_by_its_edge():
    box, lid = Pos(0, -15, 0) * Box(40, 29.7, 20), Pos(0, 15, 0) * Box(40, 29.7, 20)
    hinge = SingleHinge(40, clearance=0.3)
    place = hinge_location((0, 0, 10.15), (1, 0, 0), (0, 0, 1))
    box, lid = hinge.fit(box, lid, place)
    assert hinge.sweep(box, lid).worst.overlap == 0.0


@pytest.mark.slow
def test_doubles_look_at_the_edge_and_at_solids():
    size, hinge = 20.0, DoubleHinge(20, clearance=0.3)
    box = Box(size - 0.3, size - 0.3, size - 0.3)
    left, right = Pos(-size / 2, 0, 0) * box, Pos(size / 2, 0, 0) * box
    hinge.fit(left, right)
    with pytest.raises(HingeError, match="beyond the child body"):
        hinge.fit(left, Pos(size / 2, 0, 0) * Box(size - 0.3, size - 0.3, 8))
    with pytest.raises(HingeError, match="has 2 solids"):
        hinge.fit(Part([*left.solids(), *(Pos(0, 50, 0) * left).solids()]), right)


def test_meshes_of_parts_keep_their_volume():
    part = Rot(10, 20, 30) * (Box(10, 10, 10) - bd.Cylinder(3, 20))
    assert mesh_of_part(part).volume() == pytest.approx(part.volume, rel=2e-3)
