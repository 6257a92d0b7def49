"""The single hinge as a build123d part: solids, joints, cutters, stops, detents."""

import ast
import inspect
import subprocess
import sys
from dataclasses import fields
from itertools import pairwise
from math import pi
from pathlib import Path

import manifold3d as m3
import numpy as np
import pytest
from build123d import (
    Axis,
    Box,
    BuildPart,
    Location,
    Locations,
    Mode,
    Plane,
    Pos,
    Vector,
)
from hinge_measure import gap, mesh_of, overlap, turned

import hinges
from hinges import (
    Bracket,
    ConePin,
    Detents,
    DoubleHinge,
    FitError,
    HingeCarve,
    HingeError,
    HingeHalf,
    Leaf,
    ScrewPin,
    SingleHinge,
    Stops,
    StraightPin,
    hinge_location,
)
from hinges.options import (
    DoubleHingeKeywords,
    DoubleHingeOptions,
    SingleHingeKeywords,
    SingleHingeOptions,
)
from hinges.plan_single import SingleSpec, plan_single

HOME = Path(hinges.__file__).parent
PLACEMENT = ("rotation", "align", "mode")  # what every build123d part has


def volume_of(shape):
    if shape is None:
        return 0.0
    return shape.volume if hasattr(shape, "volume") else sum(one.volume for one in shape)


def shells_apart(one, other):
    return one.solid().shells()[0].distance_to(other.solid().shells()[0])


def test_it_stands_on_its_own():
    for path in HOME.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            names = [alias.name for alias in getattr(node, "names", [])]
            names.append(getattr(node, "module", None) or "")
            assert not any(name.split(".")[0] == "fabfold" for name in names), path


def test_import_is_light():
    code = "import hinges, sys; print([m for m in ('build123d','OCP','scipy') if m in sys.modules])"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, encoding="utf-8", check=True
    )
    assert done.stdout.strip() == "[]"


def test_every_public_name_resolves():
    for name in hinges.__all__:
        found = getattr(hinges, name)
        assert found.__name__ == name
        assert getattr(sys.modules[found.__module__], name) is found
    with pytest.raises(AttributeError):
        _ = hinges.nothing


@pytest.mark.parametrize(
    ("part", "options", "keywords"),
    [
        (SingleHinge, SingleHingeOptions, SingleHingeKeywords),
        (DoubleHinge, DoubleHingeOptions, DoubleHingeKeywords),
    ],
)
def test_keywords_types_and_defaults_are_told_once(part, options, keywords):
    parameters = inspect.signature(part.__init__).parameters
    own = [name for name in parameters if name not in ("self", "length", "size", *PLACEMENT)]
    assert set(own) == {field.name for field in fields(options)} == set(annotations_of(keywords))
    for field in fields(options):
        parameter = parameters[field.name]
        assert parameter.kind is inspect.Parameter.KEYWORD_ONLY
        assert parameter.default == field.default
        assert parameter.annotation == field.type == annotations_of(keywords)[field.name]
    with pytest.raises(TypeError, match="thickness"):
        options(thickness=2.0)


def annotations_of(keywords):
    """What a TypedDict's keys are annotated with, as it is written."""
    found = {}
    for name, kind in keywords.__annotations__.items():
        found[name] = kind.__forward_arg__ if hasattr(kind, "__forward_arg__") else kind
    return found


@pytest.mark.slow
def test_the_proven_recipe_on_exact_solids():
    hinge = SingleHinge(20, radius=2.5, pin=ConePin(1.5), clearance=0.3)
    parent, child = hinge.parent_half, hinge.child_half
    for angle in range(0, 181, 30):
        parent.joints["hinge"].connect_to(child.joints["hinge"], angle=angle)
        assert shells_apart(parent, child) == pytest.approx(0.3, abs=1e-6)
        assert volume_of(parent.solid().intersect(child.solid())) == pytest.approx(0.0, abs=1e-9)


def test_two_solids_in_every_pose():
    flat = SingleHinge(20, clearance=0.3)
    for angle in (0, 45, 90, 180):
        parent, child = SingleHinge(20, clearance=0.3, angle=angle).solids()
        assert parent.is_valid
        assert child.is_valid
        wanted = flat.child_half.center().rotate(Axis.Z, angle)
        assert (child.center() - wanted).length == pytest.approx(0.0, abs=1e-6)
        assert (parent.center() - flat.parent_half.center()).length == pytest.approx(0.0, abs=1e-6)


def test_material_lies_in_its_quadrants():
    hinge = SingleHinge(20, clearance=0.3)
    r = hinge.spec.radius
    parent, child = hinge.parent_half.bounding_box(), hinge.child_half.bounding_box()
    assert pytest.approx(r) == parent.max.X
    assert pytest.approx(-r) == child.min.X
    assert -r - 1 > parent.min.X
    assert r + 1 < child.max.X
    for box in (parent, child):
        assert pytest.approx(r) == box.max.Y
        assert pytest.approx(10 - hinge.spec.margin) == box.max.Z


@pytest.mark.parametrize("angle", [0.0, 30.0])
def test_the_joint_sits_on_the_true_axis(angle):
    hinge = SingleHinge(30, clearance=0.4, angle=angle)
    parent, child = hinge.parent_half, hinge.child_half
    start = child.center()
    joint = parent.joints["hinge"]
    assert joint.angular_range == (0.0, 180.0)
    joint.connect_to(child.joints["hinge"], angle=angle)
    assert (child.center() - start).length == pytest.approx(0.0, abs=1e-6)
    joint.connect_to(child.joints["hinge"], angle=150.0)
    wanted = start.rotate(Axis.Z, 150.0 - angle)
    assert (child.center() - wanted).length == pytest.approx(0.0, abs=1e-6)
    with pytest.raises(ValueError, match="range"):
        joint.connect_to(child.joints["hinge"], angle=190.0)


def test_rotation_and_placement_carry_the_axis_along():
    hinge = SingleHinge(20, clearance=0.3, rotation=(0, 90, 0))
    frame = Plane(hinge.joints["hinge"].location)
    assert abs(frame.z_dir.dot(Vector(1, 0, 0))) == pytest.approx(1.0)
    assert frame.origin.length == pytest.approx(0.0, abs=1e-9)
    assert pytest.approx(20 - 2 * hinge.spec.margin) == hinge.bounding_box().size.X


def test_in_a_builder_it_adds_at_every_location():
    with BuildPart() as built, Locations((0, 0, 0), (0, 0, 40), (50, 0, 0)):
        SingleHinge(20, clearance=0.3)
    assert len(built.part.solids()) == 6


def test_cutter_and_half_in_a_builder():
    hinge = SingleHinge(20, clearance=0.3)
    with BuildPart() as built:
        with Locations((-10, -10, 0)):
            Box(19.7, 19.7, 19.7)
        HingeCarve(hinge, "parent")
        HingeHalf(hinge, "parent")
    assert len(built.part.solids()) == 1
    other = Pos(10, -10, 0) * Box(19.7, 19.7, 19.7) - hinge.child_carve + hinge.child_half
    assert shells_apart(built.part, other) == pytest.approx(0.3, abs=1e-6)


@pytest.mark.slow
def test_three_lines_let_it_into_two_bodies():
    box, lid = Pos(0, -15, 0) * Box(40, 29.7, 20), Pos(0, 15, 0) * Box(40, 29.7, 20)
    hinge = SingleHinge(40, clearance=0.3)
    box, lid = hinge.fit(box, lid, hinge_location((0, 0, 10.15), (1, 0, 0), (0, 0, 1)))
    assert len(box.solids()) == len(lid.solids()) == 1
    for angle in (0.0, 60.0, 180.0):
        box.joints["hinge"].connect_to(lid.joints["hinge"], angle=angle)
        assert shells_apart(box, lid) == pytest.approx(0.3, abs=1e-6)
    # along +x with z outwards the child is on the side z × x = +y: it folds onto the top
    assert pytest.approx(30.3) == lid.bounding_box().max.Z


def test_a_body_out_of_reach_is_refused():
    hinge = SingleHinge(20, clearance=0.3)
    near = Pos(10, -10, 0) * Box(19.7, 19.7, 19.7)
    with pytest.raises(HingeError, match="must reach the bracket"):
        hinge.fit(Pos(-100, 0, 0) * Box(10, 10, 20), near)
    with pytest.raises(HingeError, match=r"14\.4 mm long and reach 2\.2 mm beyond the parent body"):
        hinge.fit(Pos(-100, 0, 0) * Box(10, 10, 10), near)


def test_an_unknown_side_is_refused():
    with pytest.raises(HingeError, match="side"):
        HingeHalf(SingleHinge(20), "left", mode=Mode.PRIVATE)
    with pytest.raises(HingeError, match="right angles"):
        hinge_location((0, 0, 0), (1, 0, 0), (1, 1, 0))


def test_equal_hinges_are_built_once():
    one, other = SingleHinge(20, clearance=0.3), SingleHinge(20, clearance=0.3)
    assert one.spec == other.spec
    assert one.plan is other.plan
    assert one.parent_half.solid().wrapped.TShape() == other.parent_half.solid().wrapped.TShape()


def test_upper_stop_holds_at_its_angle():
    spec = SingleSpec.read(
        30, clearance=0.3, stops=True, angular_range=(0, 110), leaf=Bracket(6, 6)
    )
    plan = plan_single(spec)
    parent, child = mesh_of(plan.parent), mesh_of(plan.child)
    free = 110 - spec.stops.clear_angle(plan.layout, spec.gap)
    assert gap(parent, turned(child, free), 0.5) == pytest.approx(0.3, abs=0.005)
    assert overlap(parent, turned(child, 109.9)) == pytest.approx(0.0, abs=1e-6)
    assert gap(parent, turned(child, 110.0), 0.5) == pytest.approx(0.0, abs=0.005)
    past = [overlap(parent, turned(child, angle)) for angle in (111.0, 113.0, 116.0)]
    assert 0.2 < past[0] < past[1] < past[2]


def test_lower_stop_holds_at_its_angle():
    spec = SingleSpec.read(
        30,
        clearance=0.3,
        angle=60.0,
        stops=Stops(lower=True, upper=True),
        angular_range=(30, 120),
        leaf=Bracket(6, 6),
    )
    plan = plan_single(spec)
    parent, child = mesh_of(plan.parent), mesh_of(plan.child)
    for stop, past in ((30.0, 28.0), (120.0, 122.0)):
        assert gap(parent, turned(child, stop), 0.5) == pytest.approx(0.0, abs=0.005)
        assert overlap(parent, turned(child, past)) > 0.5
    assert gap(parent, turned(child, 75.0), 0.5) == pytest.approx(0.3, abs=0.005)


def test_a_stop_at_180_degrees():
    spec = SingleSpec.read(30, clearance=0.3, stops=True, leaf=Bracket(6, 6))
    plan = plan_single(spec)
    parent, child = mesh_of(plan.parent), mesh_of(plan.child)
    assert gap(parent, turned(child, 180.0), 0.5) == pytest.approx(0.0, abs=0.005)
    assert overlap(parent, turned(child, 181.0)) > 0.1
    assert gap(parent, child, 0.5) == pytest.approx(0.3, abs=0.005)


def test_detents_press_by_their_interference_and_let_go_between():
    detents = Detents((0.0, 90.0, 180.0))
    spec = SingleSpec.read(30, clearance=0.3, radius=3.4, pin=ConePin(1.5), detents=detents)
    plan = plan_single(spec)
    parent, child = mesh_of(plan.parent), mesh_of(plan.child)
    assert gap(parent, child, 0.5) == pytest.approx(0.3, abs=0.005)  # drawn at a detent
    for angle in detents.angles:
        assert overlap(parent, turned(child, angle)) == pytest.approx(0.0, abs=1e-9)
    assert gap(parent, turned(child, 90.0), 0.5) == pytest.approx(detents.snug, abs=0.005)
    assert overlap(parent, turned(child, 50.0)) == pytest.approx(0.0, abs=1e-9)
    pressed = max(overlap(parent, turned(child, 90.0 + step)) for step in range(5, 30))
    # what is pressed in is the blunt tip of each bump: a frustum as high as the interference
    tip = 0.4 - 0.25 * (0.3 + detents.interference)
    foot = tip + 0.5 * detents.interference
    frustum = pi * detents.interference / 3.0 * (foot**2 + foot * tip + tip**2)
    assert pressed == pytest.approx(2 * frustum, rel=0.1)


@pytest.mark.parametrize("shift", [-0.3, -0.15, 0.0, 0.1, 0.25])
def test_a_detent_cannot_be_escaped_by_the_axial_play(shift):
    """Wherever the child stands in its axial play, both bumps together press as deep."""
    detents = Detents((0.0, 90.0), interference=0.07)
    spec = SingleSpec.read(30, clearance=0.3, radius=3.4, pin=ConePin(1.5), detents=detents)
    plan = plan_single(spec)
    child = turned(mesh_of(plan.child), 90.0 + 20.0).translate((0.0, 0.0, shift))
    bumps = mesh_of(plan.parent) ^ m3.Manifold.cylinder(30, 3.3, center=True)
    pressed = [part.bounding_box() for part in (bumps ^ child).decompose()]
    ridges = [box[5] - box[2] for box in pressed if abs(box[2]) < 14 and box[5] - box[2] < 0.5]
    # the two pressed depths sum up to twice the interference, unless one is out of touch
    assert sum(ridges) >= 2 * detents.interference - 1e-3
    assert sum(ridges) == pytest.approx(max(2 * 0.07, 0.07 + abs(shift)), abs=5e-3)


def test_a_bump_is_two_nozzles_wide_and_stands_at_both_ends():
    wide = {}
    for detents in (None, Detents((0.0,))):
        spec = SingleSpec.read(30, clearance=0.3, radius=3.4, pin=ConePin(1.5), detents=detents)
        wide[detents is None] = mesh_of(plan_single(spec).parent)
    bumps = (wide[False] - wide[True]).decompose()
    assert len(bumps) == 2
    for bump in bumps:
        low, high = np.array(bump.bounding_box()).reshape(2, 3)
        assert high[2] - low[2] == pytest.approx(0.37, abs=1e-3)
        middle = bump.slice(0.5 * (low[2] + high[2])).bounds()
        assert middle[2] - middle[0] == pytest.approx(0.8, abs=0.02)


def test_detents_need_a_knuckle_between_two():
    with pytest.raises(HingeError, match="between two of the parent's"):
        SingleHinge(30, knuckles=2, pin=StraightPin(1.5), radius=4, detents=Detents((0.0,)))


def test_friction_drags_all_the_way_but_where_it_is_drawn():
    hinge = SingleHinge(30, clearance=0.3, radius=3.4, pin=ConePin(1.5), friction=0.06)
    parent, child = mesh_of(hinge.plan.parent), mesh_of(hinge.plan.child)
    assert gap(parent, child, 0.5) == pytest.approx(0.3, abs=0.005)
    pressed = [overlap(parent, turned(child, angle)) for angle in range(25, 181, 15)]
    assert min(pressed) > 0.9 * max(pressed) > 0.0
    with pytest.raises(HingeError, match="share their bumps"):
        SingleHinge(30, friction=0.06, detents=Detents((0.0,)))


def test_detents_only_in_a_pose_that_prints():
    with pytest.raises(HingeError, match="pose"):
        SingleHinge(
            30, clearance=0.3, radius=3.4, pin=ConePin(1.5), angle=45, detents=Detents((0.0,))
        )


def test_a_leaf_with_screw_holes():
    plain = SingleHinge(40, knuckles=5, clearance=0.3, leaf=Leaf(15, 2))
    holed = SingleHinge(40, knuckles=5, clearance=0.3, leaf=Leaf(15, 2, holes=3, hole=3.2, sink=6))
    lost = plain.parent_half.volume - holed.parent_half.volume
    one = pi * (1.6**2 * 2) + pi * 1.4 / 3 * (3**2 + 3 * 1.6 - 2 * 1.6**2)
    assert lost == pytest.approx(3 * one, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("bore", ["teardrop", "octagon"])
def test_lying_bores_have_no_flat_roof(bore):
    """No face of a bore looks down by more than 45°, but for the teardrop's narrow top."""
    hinge = SingleHinge(30, pin=ScrewPin("M2"), clearance=0.3, bore=bore)
    roof = 0.0
    for face in hinge.child_half.faces():
        points, triangles = face.tessellate(0.01, 0.1)
        for a, b, c in triangles:
            corners = [points[i] for i in (a, b, c)]
            middle = (corners[0] + corners[1] + corners[2]) / 3
            normal = (corners[1] - corners[0]).cross(corners[2] - corners[0])
            inside = (middle.X**2 + middle.Y**2) ** 0.5 < 1.6
            if inside and normal.length > 0 and normal.normalized().Y < -0.75:
                roof += 0.5 * normal.length
    (long,) = (k.length for k in hinge.plan.layout.knuckles if k.owner == 1)
    allowed = {"teardrop": 0.45, "octagon": 0.83}[bore] * 1.2 * long  # width of the flat top
    assert roof <= allowed * 1.1


def test_hardware_goes_through_its_bores():
    hinge = SingleHinge(30, pin=ScrewPin("M2", end="nut"), clearance=0.3)
    loose = hinge.hardware
    assert len(loose.solids()) == 2
    for half in (hinge.parent_half, hinge.child_half):
        shared = sum(volume_of(half.solid().intersect(one)) for one in loose.solids())
        assert shared == pytest.approx(0.0, abs=1e-6)
    assert SingleHinge(20).hardware is None


def test_a_flat_leaf_has_its_feet_on_the_bed():
    hinge = SingleHinge(30, clearance=0.3, radius=3, leaf=Leaf(10, 1.9, flat=True))
    low = hinge.bounding_box().min.Y
    assert low == pytest.approx(-3 * 0.5**0.5)
    standing = sum(face.area for face in hinge.faces() if abs(face.center().Y - low) < 1e-6)
    assert standing > 30 * 10


@pytest.mark.slow
def test_flat_brackets_lie_in_plates():
    hinge = SingleHinge(30, clearance=0.3, radius=3, leaf=Bracket(flat=True))
    low = -3 * 0.5**0.5
    assert pytest.approx(low) == hinge.bounding_box().min.Y
    thick, wide = -low - 0.15, 20.0
    plates = [
        Pos(side * (0.15 + wide / 2), -0.15 - thick / 2, 0) * Box(wide, thick, 30)
        for side in (-1, 1)
    ]
    parent, child = hinge.fit(*plates, check=False)
    swept = hinge.sweep(parent, child, range(0, 181, 10))
    assert swept.gap == pytest.approx(0.3, abs=0.01)
    assert swept.worst.overlap == 0.0
    for body in (parent, child):
        assert pytest.approx(low) == body.bounding_box().min.Y
        lying = sum(face.area for face in body.faces() if abs(face.center().Y - low) < 1e-6)
        assert lying > wide * 30 * 0.9
    with pytest.raises(FitError, match="the thickness of a flat bracket") as refusal:
        SingleHinge(30, clearance=0.3, radius=3, leaf=Bracket(depth=0.5, flat=True))
    assert refusal.value.rule == "bracket"
    with pytest.raises(HingeError, match="has no gusset"):
        Bracket(flat=True, gusset=True)
    with pytest.raises(HingeError, match="bracket is flat"):
        DoubleHinge(20, bracket=Bracket(flat=True))


def test_the_hinge_moves_with_a_location():
    hinge = SingleHinge(20, clearance=0.3)
    moved = Location((5, 0, 0)) * hinge
    assert pytest.approx(hinge.center().X + 5) == moved.center().X


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [0.5, 2.0])
def test_knuckles_of_the_child_may_be_longer_or_shorter(ratio):
    hinge = SingleHinge(40, knuckles=5, ratio=ratio, clearance=0.3)
    lengths = [knuckle.length for knuckle in hinge.plan.layout.knuckles]
    assert lengths[1] == pytest.approx(ratio * lengths[0])
    assert lengths[0] == pytest.approx(lengths[2])
    assert lengths[1] == pytest.approx(lengths[3])
    gaps = [after.start - before.end for before, after in pairwise(hinge.plan.layout.knuckles)]
    assert gaps == pytest.approx([hinge.spec.clearance.axial] * 4)
    even = SingleHinge(40, knuckles=5, clearance=0.3).plan.layout
    assert (hinge.plan.layout.start, hinge.plan.layout.end) == pytest.approx((even.start, even.end))
    parent, child = mesh_of(hinge.plan.parent), mesh_of(hinge.plan.child)
    for angle in (0.0, 70.0, 180.0):
        assert gap(parent, turned(child, angle)) == pytest.approx(0.3, abs=2e-3)
    assert "ratio=" in repr(hinge)


@pytest.mark.parametrize("ratio", [0.0, -1.0, 11.0, float("nan")])
def test_a_ratio_that_makes_no_sense_is_refused(ratio):
    with pytest.raises(HingeError, match="ratio"):
        SingleHinge(40, ratio=ratio)
