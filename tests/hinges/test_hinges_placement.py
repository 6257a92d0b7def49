"""Joints lie on the axis that the knuckles have, however a part is placed."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import pytest

pytest.importorskip("build123d")  # a newer one is tried in an environment with little else

import build123d as bd
from build123d import (
    Align,
    BuildPart,
    GridLocations,
    Location,
    Locations,
    Mode,
    Part,
    Plane,
    Pos,
    Rot,
    Vector,
)
from OCP.BRepAdaptor import BRepAdaptor_Surface

from hinges import DoubleHinge, HingeError, SingleHinge
from hinges.double import DoubleHingePart
from hinges.single import HingeHalf

SINGLE = SingleHinge(20, clearance=0.3, angle=30)
DOUBLE = DoubleHinge(20, first="+y", second="+z", turns=(180, 90), angles=(20, 40), clearance=0.3)
TILTED = Plane(origin=(3, -4, 5), x_dir=(1, 2, 0), z_dir=(2, -1, 3))


def measured_axes(part: Any, radius: float) -> list[tuple[Vector, Vector]]:
    """Point and direction of the axis of every round face with the radius of the barrel."""
    found = []
    for face in part.faces():
        if face.geom_type == bd.GeomType.CYLINDER:
            cylinder = BRepAdaptor_Surface(face.wrapped).Cylinder()
            if abs(cylinder.Radius() - radius) < 1e-9:
                axis = cylinder.Axis()
                found.append((Vector(axis.Location()), Vector(axis.Direction())))
    assert found
    return found


def off_axis(location: Location, axes: list[tuple[Vector, Vector]]) -> float:
    """How far a joint's z axis is from the nearest measured axis: an offset or a tilt."""
    plane = Plane(location)
    best = 1e9
    for point, direction in axes:
        tilt = plane.z_dir.cross(direction).length
        offset = (plane.origin - point).cross(direction).length
        best = min(best, max(tilt, offset))
    return best


Maker = Callable[..., Any]
MAKERS: dict[str, Maker] = {
    "whole": lambda **more: SingleHinge(20, clearance=0.3, angle=30, **more),
    "parent half": lambda **more: HingeHalf(SINGLE, "parent", **more),
    "child half": lambda **more: HingeHalf(SINGLE, "child", **more),
    "double parent": lambda **more: DoubleHingePart(DOUBLE, "parent", **more),
    "double link": lambda **more: DoubleHingePart(DOUBLE, "link", **more),
    "double child": lambda **more: DoubleHingePart(DOUBLE, "child", **more),
}


def in_builder(make: Maker, *planes: Plane, locations: Any = None, **more: Any) -> Any:
    with BuildPart(*planes):
        if locations is None:
            return make(**more)
        with locations:
            return make(**more)


def nested(make: Maker) -> Any:
    with BuildPart(Plane.XZ), Locations(Location((1, 2, 3), (10, 20, 30))), Locations((5, 0, 0)):
        return make(rotation=(0, 40, 0))


MODES: dict[str, Callable[[Maker], Any]] = {
    "plain": lambda make: make(),
    "algebra": lambda make: Pos(1, 2, 3) * Rot(10, 20, 30) * make(),
    "plane": lambda make: TILTED * make(),
    "rotation": lambda make: make(rotation=(10, 20, 30)),
    "align": lambda make: make(align=(Align.MIN, Align.MAX, Align.CENTER)),
    "align and rotation": lambda make: make(align=Align.MIN, rotation=(90, 0, 45)),
    "builder": in_builder,
    "builder on a plane": lambda make: in_builder(make, Plane.XZ),
    "builder on a tilted plane": lambda make: in_builder(make, TILTED, rotation=(0, 0, 45)),
    "locations": lambda make: in_builder(make, locations=Locations((7, 8, 9))),
    "nested": nested,
    "private": lambda make: in_builder(make, Plane.YZ, mode=Mode.PRIVATE),
    "copy": lambda make: copy.copy(Pos(1, 2, 3) * make()),
    "deepcopy": lambda make: copy.deepcopy(make(rotation=(10, 20, 30))),
    "moved": lambda make: make(rotation=(10, 20, 30)).moved(Location((1, 2, 3), (4, 5, 6))),
    "translate": lambda make: make().translate((1, 2, 3)),
    "rotate": lambda make: (Pos(1, 2, 3) * make()).rotate(bd.Axis((1, 0, 0), (1, 1, 1)), 50),
    "mirrored": lambda make: (Pos(1, 2, 3) * make()).mirror(TILTED),
    "mirrored and moved": lambda make: Rot(10, 20, 30) * make().mirror(Plane.XZ),
    "mirrored twice": lambda make: make().mirror(Plane.YZ).mirror(TILTED),
}


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("kind", MAKERS)
def test_joints_lie_on_the_axis_of_the_knuckles(kind: str, mode: str) -> None:
    part = MODES[mode](MAKERS[kind])
    hinge = DOUBLE if kind.startswith("double") else SINGLE
    axes = measured_axes(part, hinge.spec.radius)
    names = [name for name in part.joints if not (kind == "whole" and name == "parent")]
    assert names
    for name in names:
        assert off_axis(part.joints[name].location, axes) < 1e-9, name
        assert part.joints[name].parent is part


@pytest.mark.parametrize("kind", ["whole", "parent half", "double link"])
def test_a_pickled_part_keeps_its_joints(kind: str) -> None:
    from build123d.persistence import modify_copyreg

    modify_copyreg()
    part = pickle.loads(pickle.dumps(MAKERS[kind](rotation=(10, 20, 30))))
    hinge = DOUBLE if kind.startswith("double") else SINGLE
    axes = measured_axes(part, hinge.spec.radius)
    assert all(
        off_axis(part.joints[name].location, axes) < 1e-9
        for name in part.joints
        if not (kind == "whole" and name == "parent")
    )


@pytest.mark.slow
@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("mode", MODES)
def test_halves_made_anywhere_meet_at_the_same_angle(mode: str, mirrored: bool) -> None:
    """The child, wherever it was made, comes to lie as the hinge drawn at that angle has it."""
    if mirrored and "mirrored" in mode:
        pytest.skip("one mirror is enough")
    parent = MODES[mode](MAKERS["parent half"])
    child = Location((50, 60, 70), (80, 10, 20)) * MAKERS["child half"]()
    flipped = getattr(parent, "flipped", False)
    if flipped != getattr(child, "flipped", False):
        child = child.mirror(Plane.XY)
    for angle in (0, 75, 180):
        parent.joints["hinge"].connect_to(child.joints["hinge"], angle=angle)
        drawn = SingleHinge(20, clearance=0.3, angle=angle).child_half
        if flipped:
            drawn = drawn.mirror(Plane.XY)
        want = (parent.place * drawn).center(bd.CenterOf.MASS)
        assert (child.center(bd.CenterOf.MASS) - want).length < 1e-6


def same_solid(one: Any, other: Any) -> bool:
    both = one.intersect(other) or ()
    solids = both.solids() if hasattr(both, "solids") else [s for b in both for s in b.solids()]
    return abs(sum(s.volume for s in solids) - one.volume) < 1e-6 * one.volume


@pytest.mark.parametrize(
    "place",
    [
        lambda hinge: Pos(0, 0, 100) * hinge,
        lambda hinge: TILTED * hinge,
        lambda hinge: (Pos(1, 2, 3) * hinge).mirror(Plane.XZ),
    ],
)
def test_halves_lie_where_the_hinge_lies(place: Callable[[Any], Any]) -> None:
    hinge = place(SingleHinge(20, clearance=0.3, angle=30))
    parent, child = hinge.parent_half, hinge.child_half
    axes = measured_axes(hinge, hinge.spec.radius)
    assert off_axis(parent.joints["hinge"].location, axes) < 1e-9
    assert off_axis(child.joints["hinge"].location, axes) < 1e-9
    whole = hinge.solids()
    assert sum(same_solid(parent, solid) for solid in whole) == 1
    assert sum(same_solid(child, solid) for solid in whole) == 1


def boxes(height: float = 0.0) -> tuple[Part, Part]:
    one = Pos(-5.2, -5.2, 0) * bd.Box(10, 10, 20)
    other = Pos(5.2, -5.2, 0) * bd.Box(10, 10, 20)
    return Pos(0, 0, height) * one, Pos(0, 0, height) * other


@pytest.mark.slow
def test_fit_keeps_to_the_place_of_the_hinge() -> None:
    moved = Pos(0, 0, 100) * SingleHinge(20, clearance=0.3)
    parent, child = moved.fit(*boxes(100))
    assert pytest.approx(100) == parent.joints["hinge"].location.position.Z
    parent.joints["hinge"].connect_to(child.joints["hinge"], angle=180)
    assert pytest.approx(10.2) == child.bounding_box().max.Y
    both = SingleHinge(20, clearance=0.3).fit(*boxes(100), at=Pos(0, 0, 100))
    assert both[0].volume == pytest.approx(parent.volume)
    assert pytest.approx(90) == both[0].bounding_box().min.Z


@pytest.mark.slow
def test_a_mirrored_pair_still_folds() -> None:
    parent, child = (part.mirror(TILTED) for part in SingleHinge(20, clearance=0.3).fit(*boxes()))
    for angle in (0, 90, 180):
        parent.joints["hinge"].connect_to(child.joints["hinge"], angle=angle)
        assert parent.distance_to(child) > 0.2


def test_halves_inside_a_builder_are_one() -> None:
    with BuildPart() as built, GridLocations(50, 0, 3, 1):
        hinge = SingleHinge(20, clearance=0.3)
        half = hinge.parent_half
    assert len(half.solids()) == 1
    assert len(built.part.solids()) == 6
    names = sorted(built.part.joints)
    assert names == ["hinge", "hinge 2", "hinge 3", "parent", "parent 2", "parent 3"]
    axes = measured_axes(built.part, hinge.spec.radius)
    for name in names[:3]:
        assert off_axis(built.part.joints[name].location, axes) < 1e-9
    places = sorted(round(built.part.joints[name].location.position.X) for name in names[:3])
    assert places == [-50, 0, 50]


def test_two_builders_meet_through_their_joints() -> None:
    with BuildPart(Plane.XZ) as one:
        HingeHalf(SINGLE, "parent")
    with BuildPart(TILTED) as other:
        HingeHalf(SINGLE, "child")
    parent, child = one.part, other.part
    parent.joints["hinge"].connect_to(child.joints["hinge"], angle=120)
    want = Plane.XZ.location * SingleHinge(20, clearance=0.3, angle=120).child_half
    assert (child.center(bd.CenterOf.MASS) - want.center(bd.CenterOf.MASS)).length < 1e-6


@pytest.mark.slow
def test_a_name_that_a_body_has_given_is_refused() -> None:
    _, child = SingleHinge(20, clearance=0.3).fit(*boxes())
    third = Pos(-5.2, -5.2, 20.4) * bd.Box(10, 10, 20)
    with pytest.raises(HingeError, match="already has a joint named 'hinge'"):
        SingleHinge(20, clearance=0.3).fit(child, third)


@pytest.mark.slow
def test_a_chain_of_doubles_folds_by_its_joints() -> None:
    """Three double hinges between four boxes in a row; all fold by joints alone."""
    size, gap = 20.0, 0.3
    hinge = DoubleHinge(size, clearance=gap, first="+y", second="-y")
    step = size + 2 * hinge.spec.gap + hinge.spec.plate
    side = size - hinge.spec.gap
    row = [Pos(step * index, 0, 0) * bd.Box(side, side, side) for index in range(4)]
    at = [Pos(step * (index + 0.5), 0, 0) for index in range(3)]
    links = []
    for index, place in enumerate(at):
        name = f"link {index}"
        one, link, other = hinge.fit(row[index], row[index + 1], place, joint=name)
        row[index], row[index + 1] = one, other
        links.append(link)
    assert sorted(row[2].joints) == ["link 1", "link 2"]
    for first, second in ((0, 0), (90, 0), (90, 180), (180, 90)):
        for index, link in enumerate(links):
            name = f"link {index}"
            row[index].joints[name].connect_to(link.joints["parent"], angle=first)
            link.joints["child"].connect_to(row[index + 1].joints[name], angle=second)
        axes = measured_axes(row[2], hinge.spec.radius)
        for joint in row[2].joints.values():
            assert off_axis(joint.location, axes) < 1e-9
        for index, link in enumerate(links):
            assert row[index].distance_to(link) > 0.15
            assert link.distance_to(row[index + 1]) > 0.15
