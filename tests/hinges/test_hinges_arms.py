"""Arms: axes outside of the bodies, bodies of unequal height, turns beyond 180°."""

from __future__ import annotations

import re

import pytest

pytest.importorskip("build123d")  # a newer one is tried in an environment with little else

import build123d as bd
import manifold3d as m3
from build123d import Align, Axis, Box, Part, Pos
from hinge_environment import needs_cadquery
from hinge_measure import exact, mesh_of, single_gaps

from hinges import (
    Arm,
    Bracket,
    ConePin,
    FilamentPin,
    FitError,
    HingeError,
    Leaf,
    SingleHinge,
    Stops,
    play,
)
from hinges.clearance import Clearance
from hinges.knuckles import lay_out_knuckles
from hinges.mesh import double_hinge_meshes, single_hinge_meshes
from hinges.plan_single import SinglePlan, SingleSpec, plan_single
from hinges.turn_sweep import mesh_of_part

ROUND = [10.0 * step for step in range(19)]
#: An arm that stands straight out of its wall and ends at its top.
FLAT = {"angle": 90.0, "clear_top": True}
LAYOUT = lay_out_knuckles(30, 3, 3.0, Clearance(0.3), 0.0)


def planned(length: float = 40, **options) -> SinglePlan:
    return plan_single(SingleSpec.read(length, clearance=0.3, **options))


def bodies(hinge: SingleHinge, parent_thick: float, child_thick: float, long: float = 40):
    """A box and a lid in the hinge's frame, where its arms reach, in its drawn pose."""
    (aside, below), (other_aside, other_below) = hinge.corners
    parent = Box(30, parent_thick, long, align=(Align.MAX, Align.MAX, Align.CENTER))
    child = Box(30, child_thick, long, align=(Align.MIN, Align.MAX, Align.CENTER))
    lid = Pos(other_aside, -other_below) * child
    return Pos(-aside, -below) * parent, lid.rotate(Axis.Z, hinge.spec.angle)


@pytest.mark.slow
@pytest.mark.parametrize(
    "leaf",
    [
        Arm(),
        Arm(**FLAT),
        Arm(fill=False),
        Arm.pair(26.0),
        Arm.pair(-8.0, offset=6.0, fill=False, round_bottom=1.5, round_top=0.5),
        Arm(angle=20.0, offset=5.0),
        Arm(angle=60.0, height=0.0, offset=4.0, clear_top=1.0),
        (Bracket(), Arm(**FLAT)),
        (Arm(**FLAT), Leaf(14.0)),
        (Bracket(9.0, 5.0), Leaf(14.0)),
        # the axis nearer to the wall than the barrel is thick, with a groove in it
        Arm(offset=2.0, root=3.0, **FLAT),
        (Arm(), Arm(offset=7.0, angle=70.0, clear_top=True)),
    ],
    ids=str,
)
def test_the_gap_is_the_clearance_at_every_angle(leaf):
    plan = planned(leaf=leaf)
    gaps = single_gaps(plan, ROUND)
    assert gaps[:, 0].min() == pytest.approx(0.3, abs=1e-5)
    assert gaps[:, 0].max() == pytest.approx(0.3, abs=1e-5)
    assert gaps[:, 1].max() == 0.0
    for half, shape in (("parent", plan.parent), ("child", plan.child)):
        assert exact(shape, half).volume == pytest.approx(mesh_of(shape).volume(), rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(("angle", "step"), [(0.0, 26.0), (180.0, 26.0), (70.0, -10.0)])
def test_a_box_and_a_lower_lid_print_in_place(angle, step):
    hinge = SingleHinge(40, clearance=0.3, leaf=Arm.pair(step), angle=angle)
    box, lid = hinge.fit(*bodies(hinge, 36.0, 36.0 - step), check=False)
    assert [len(part.solids()) for part in (box, lid)] == [1, 1]
    swept = hinge.sweep(box, lid, ROUND)
    assert swept.gap == pytest.approx(0.3, abs=0.01)
    assert swept.worst.overlap == 0.0
    # Both lie on one bed at 0°, and the lid one gap above the box at 180°.
    box.joints["hinge"].connect_to(lid.joints["hinge"], angle=0)
    assert pytest.approx(box.bounding_box().min.Y, abs=1e-6) == lid.bounding_box().min.Y
    box.joints["hinge"].connect_to(lid.joints["hinge"], angle=180)
    over = Box(100, 100, 100).moved(bd.Location((-60, 0, 0)))  # without arms and barrels
    assert pytest.approx(0.5 * step + 0.15, abs=1e-6) == (lid & over).bounding_box().min.Y
    assert pytest.approx(0.5 * step - 0.15, abs=1e-6) == (box & over).bounding_box().max.Y


@pytest.mark.slow
def test_the_fit_looks_at_bodies_on_arms():
    hinge = SingleHinge(40, clearance=0.3, leaf=Arm.pair(10.0))
    box, lid = bodies(hinge, 20.0, 10.0)
    with pytest.raises(HingeError, match=r"at 180° the bodies overlap .* that their arms reach"):
        hinge.fit(box, Pos(0, 2, 0) * lid)
    with pytest.raises(HingeError, match=r"must reach the arm .* wall lies 5\.4 mm beside"):
        hinge.fit(box, Pos(2, 0, 0) * lid)
    with pytest.raises(HingeError, match="beyond the child body"):
        hinge.fit(box, bodies(hinge, 20.0, 10.0, long=30)[1])


@pytest.mark.slow
def test_what_reaches_below_a_thin_body_is_trimmed():
    hinge = SingleHinge(40, clearance=0.3, leaf=Arm())
    box, lid = bodies(hinge, 20.0, 4.0)
    _, lid = hinge.fit(box, lid)
    assert hinge.child_half.bounding_box().min.Y < -8.0
    assert pytest.approx(-4.15) == lid.bounding_box().min.Y


def test_as_meshes():
    pieces = single_hinge_meshes(40, 0.3, leaf=Arm.pair(14.0))
    plan = planned(
        radius=pieces.barrel_radius_mm, pin=ConePin(pieces.pin_radius_mm), leaf=Arm.pair(14.0)
    )
    for mesh, shape in ((pieces.parent_half, plan.parent), (pieces.child_half, plan.child)):
        solid = m3.Manifold(m3.Mesh(mesh.vertices.astype("f4"), mesh.faces.astype("u4")))
        assert solid.status() == m3.Error.NoError
        assert solid.volume() == pytest.approx(exact(shape).volume, rel=0.01)
    with pytest.raises(HingeError, match="leave leaf out"):
        double_hinge_meshes(20, 0.3, leaf=Arm())


@pytest.mark.slow
def test_a_loose_pin_and_play():
    hinge = SingleHinge(60, knuckles=5, pin=FilamentPin(), clearance=0.3, leaf=Arm.pair(12.0))
    assert play(hinge).radial == pytest.approx(0.2)
    assert play(SingleHinge(40, clearance=0.3, leaf=Arm())).radial == pytest.approx(0.3 * 2**0.5)
    hardware = hinge.hardware
    assert hardware is not None
    assert pytest.approx(60) == hardware.bounding_box().size.Z


@pytest.mark.slow
@pytest.mark.parametrize("own", [0, 1])
def test_on_an_edge_of_either_body(own):
    hinge = SingleHinge.along(
        Box(60, 1, 1).edges().filter_by(Axis.X)[0], clearance=0.3, leaf=Arm.pair(26.0)
    )
    apart = hinge.corners[0][0] + hinge.corners[1][0]
    up = (Align.CENTER, Align.MAX, Align.MIN)

    def laid(aside: float = 0.0, higher: float = 0.0) -> tuple[Part, Part, bd.Edge]:
        box = Box(60, 40, 36, align=up)
        lid = Pos(0, 40 + apart + aside, higher) * Box(60, 40, 10, align=up)
        edges = (box, lid)[own].edges().group_by(Axis.Z)[-1].sort_by(Axis.Y)
        return box, lid, edges[-1 if own == 0 else 0]

    box, lid, edge = laid()
    box, lid = hinge.fit(box, lid, edge=edge, check=False)
    assert pytest.approx(23.15) == box.joints["hinge"].location.position.Z
    assert hinge.sweep(box, lid, [0, 90, 180]).gap == pytest.approx(0.3, abs=0.01)
    box, lid, edge = laid(aside=1.0)
    with pytest.raises(HingeError, match=r"are 7\.8 mm apart and their arms hold them 6\.8 mm"):
        hinge.fit(box, lid, edge=edge)
    box, lid, edge = laid(higher=1.0)
    with pytest.raises(HingeError, match=r"give leaf=Arm\.pair\(25\)"):
        hinge.fit(box, lid, edge=edge)


@pytest.mark.slow
def test_a_lid_that_opens_by_270_degrees():
    arms = (Arm(offset=4.0, **FLAT), Arm(**FLAT))
    hinge = SingleHinge(40, clearance=0.3, leaf=arms, opens=270, closed=180)
    assert hinge.spec.angular_range == (-90.0, 180.0)
    assert hinge.spec.stops is None
    box, lid = hinge.fit(*bodies(hinge, 30.0, 3.0), check=False)
    angles = [-90.0 + 15.0 * step for step in range(19)]
    swept = hinge.sweep(box, lid, angles)
    assert swept.gap == pytest.approx(0.3, abs=0.01)
    assert swept.worst.overlap == 0.0
    box.joints["hinge"].connect_to(lid.joints["hinge"], angle=-90)
    # it hangs beside the wall of its box, 4 mm from the axis
    assert lid.bounding_box().center().Y < -10.0
    assert mesh_of_part(box).min_gap(mesh_of_part(lid), 3.0) == pytest.approx(0.3, abs=0.01)
    with pytest.raises(HingeError, match=r"overlap .* an offset of 5\.3 mm or more"):
        hinge.fit(*bodies(hinge, 30.0, 5.0))


@pytest.mark.slow
def test_two_plates_with_the_axis_in_their_middle_turn_to_both_sides():
    # flush with barrels as thick as the plates
    flush = Arm(offset=5.0, rise=-2.15, angle=90.0, clear_top=True)
    hinge = SingleHinge(
        40, radius=2.0, clearance=0.3, leaf=flush, angular_range=(-130, 130), pin=ConePin(1.0)
    )
    plates = bodies(hinge, 4.0, 4.0)
    parent, child = hinge.fit(*plates, check=False)
    swept = hinge.sweep(parent, child, [-130.0 + 260.0 * step / 18 for step in range(19)])
    assert swept.gap == pytest.approx(0.3, abs=0.01)
    assert swept.worst.overlap == 0.0
    with pytest.raises(HingeError, match=r"below -90° the child goes on under its parent"):
        hinge.fit(bodies(hinge, 30.0, 4.0)[0], plates[1])


@pytest.mark.parametrize(
    ("options", "rule", "words"),
    [
        ({"leaf": Arm(height=0.0)}, "arm", "use a height of 1.04 mm or more"),
        ({"leaf": Arm(rise=10.0, height=0.0, clear_top=True)}, "arm", "what clear_top leaves"),
        ({"leaf": Arm(clip=0.2)}, "arm", "the foot of the arm on its wall is 0.05 mm"),
        ({"leaf": Arm(round_top=9.0, fill=False)}, "arm", "beside its round_top"),
        ({"leaf": Arm(offset=1.0, **FLAT)}, "bracket", "behind or below the grooves"),
        ({"leaf": (Bracket(), Arm())}, "arm", "the child's arm beside the parent at 0°"),
        ({"leaf": (Arm(), Bracket())}, "arm", "the parent's arm beside the child at 0°"),
        ({"leaf": Arm(rise=-1.0)}, "range", "the two tops at 180° is -1.7 mm"),
        ({"leaf": Arm(), "opens": 270, "closed": 180}, "arm", "at -90°"),
        ({"opens": 270, "closed": 180}, "range", r"an axis outside of both bodies, on leaf=Arm"),
        ({"leaf": Arm(**FLAT), "angular_range": (-120, 170)}, "range", "the turn is 290 °"),
        ({"leaf": Arm(**FLAT), "angular_range": (0, 200)}, "range", "the high end of the range"),
    ],
    ids=str,
)
def test_an_arm_that_cannot_work_is_refused(options, rule, words):
    with pytest.raises(FitError, match=words) as refusal:
        planned(**options)
    assert refusal.value.rule == rule
    assert refusal.value.advice


def test_what_is_asked_for_can_be_had():
    """The advice of a refusal works."""
    with pytest.raises(FitError) as refusal:
        planned(leaf=Arm(height=0.0))
    found = re.search(r"a height of ([\d.]+) mm", refusal.value.advice)
    assert found
    assert planned(leaf=Arm(height=float(found[1]))).spec.on_arms
    assert planned(leaf=Arm(height=0.0, clear_top=True)).spec.on_arms
    assert planned(leaf=Arm(rise=-1.0), angular_range=(0, 120)).spec.on_arms


def test_an_arm_is_shown_by_its_call():
    hinge = SingleHinge(40, clearance=0.3, leaf=Arm.pair(14.0, clear_top=1.5))
    again = eval(repr(hinge))
    assert again.spec == hinge.spec
    assert repr(Arm()) == "Arm()"


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Arm(angle=0), "angle is 0: give an angle above 0 and up to 90"),
        (lambda: Arm(offset=0), "offset is 0 mm: give a length above 0"),
        (lambda: Arm(height=-1), "height is -1 mm: give a length of 0 or more"),
        (lambda: Arm(rise="x"), "an arm's rise is 'x': give a finite number"),
        (lambda: Arm(clear_top=0), "clear_top is 0: give True, False or the distance"),
        (lambda: Arm(round_top=1), "give fill=False"),
        (lambda: SingleHinge(20, leaf=(Arm(), 3)), r"give Bracket\(...\), Leaf"),
        (lambda: SingleHinge(20, leaf=(Arm(),)), r"or a pair of them"),
        (lambda: SingleHinge(40, leaf=Arm(), stops=Stops()), "arms have none: leave stops out"),
        (lambda: SingleHinge(40, leaf=Arm(), opens=270), "draw it so and give closed=180"),
    ],
)
def test_nonsense_is_refused_in_a_sentence(make, words):
    with pytest.raises(HingeError, match=words):
        make()


def test_the_outline_is_what_was_asked_for():
    def size(arm: Arm) -> tuple[float, float, float, float]:
        return arm.section(LAYOUT, 0.3).bounds()

    r = 0.98 * 3.0
    upright = Arm(rise=10.0, height=13.0, offset=5.0, fill=False)
    low, high = upright.foot(LAYOUT, 0.3)
    assert (low, high) == pytest.approx((-18 - r * 2**0.5, -18 + r * 2**0.5))
    assert size(upright) == pytest.approx((-r, low - 0.4, 5.4, 0.0))
    # filled up to the top of its body: a trapezium between stem, slope and wall
    more = Arm(rise=10.0, height=13.0, offset=5.0)
    added = more.section(LAYOUT, 0.3).area() - upright.section(LAYOUT, 0.3).area()
    wide, tall = 5.4 - r, -10.15 - high + 0.4
    assert added == pytest.approx(wide * tall - 0.5 * wide**2, rel=1e-6)
    assert size(Arm(clip=4.0))[1] == pytest.approx(-4.0)
    flat = Arm(offset=5.0, **FLAT).section(LAYOUT, 0.3)
    assert flat.area() == pytest.approx(5.4 * (r - 0.15))
    plain, rounded = (
        Arm(angle=90.0, offset=9.0, round_bottom=radius).section(LAYOUT, 0.3).area()
        for radius in (0.0, 2.0)
    )
    # The Bézier curve of degree 4 over the unit corner encloses 0.17886 of it.
    in_wall = 0.4 * 2.0
    assert rounded - plain - in_wall == pytest.approx(0.17886 * 4.0, rel=0.01)


@pytest.mark.slow
@needs_cadquery
def test_in_cadquery():
    import cadquery as cq

    import hinges.cadquery  # noqa: F401

    options = {"clearance": 0.3, "leaf": Arm.pair(26.0)}
    near = 3.4
    box = (
        cq.Workplane().box(60, 40, 36, centered=(True, False, False)).translate((0, -40 - near, 0))
    )
    lid = cq.Workplane().box(60, 40, 10, centered=(True, False, False)).translate((0, near, 0))
    box = box.edges(">Y and >Z").hingeParent(outwards=(0, 0, 1), **options)
    lid = lid.edges("<Y and >Z").hingeChild(outwards=(0, 0, 1), **options)
    assert box.solids().size() == lid.solids().size() == 1
    gap = box.val().distance(lid.val())
    assert gap == pytest.approx(0.3, abs=1e-6)
    assert box.val().intersect(lid.val()).Volume() == pytest.approx(0.0, abs=1e-9)
