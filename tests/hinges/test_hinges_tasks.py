"""What new users set out to make, with public names alone; every gap is measured on meshes."""

import copy
import pickle
from dataclasses import replace

import lib3mf
import manifold3d as m3
import numpy as np
import pytest
from build123d import (
    Align,
    Axis,
    Box,
    GeomType,
    Part,
    Plane,
    Pos,
    Rot,
    import_step,
)
from hinge_environment import needs_cadquery
from hinge_examples import load
from part_measure import gap, least_gap, overhang, sound

from hinges import (
    BallSocket,
    Bracket,
    Detents,
    DoubleHinge,
    FilamentPin,
    FitError,
    Leaf,
    LivingHinge,
    RodPin,
    ScrewPin,
    SingleHinge,
    SnapTongue,
    hinge_location,
    write_3mf,
    write_step,
)

LOW = (Align.CENTER, Align.CENTER, Align.MIN)
ANGLES = (0, 45, 90, 135, 180)


def tray(wide, deep, high, wall, floor=2.0):
    """A box open above, standing on z = 0."""
    return Box(wide, deep, high, align=LOW) - Pos(0, 0, floor) * Box(
        wide - 2 * wall, deep - 2 * wall, high, align=LOW
    )


def side_by_side(wide, deep, high, wall, between=0.3):
    """A box and its lid, both open above."""
    step = 0.5 * (deep + between)
    return Pos(0, -step) * tray(wide, deep, high, wall), Pos(0, step) * tray(wide, deep, 8, wall)


def turned(parent, child, angle, joint="hinge"):
    """The child at an angle, by its joint."""
    parent.joints[joint].connect_to(child.joints[joint], angle=angle)
    return child


def gaps(parent, child, angles, joint="hinge"):
    return [gap(parent, turned(parent, child, angle, joint)) for angle in angles]


@pytest.fixture(scope="module")
def boxes():
    """A box and a lid with walls of 3 mm, side by side, and where their hinge goes."""
    step = 0.5 * 40.3
    place = hinge_location((0, 0, 20.15), along=(1, 0, 0), outwards=(0, 0, 1))
    return Pos(0, -step) * tray(60, 40, 20, 3), Pos(0, step) * tray(60, 40, 20, 3), place


@pytest.mark.slow
def test_a_case_for_a_board_with_walls_of_two_mm_opens_by_110_degrees():
    example = load("11_board_case_build123d")
    plain = overhang(example.case())
    case, lid = example.main()
    assert sound(case, lid)
    assert case.joints["hinge"].angular_range == (70.0, 180.0)
    recesses = 5 * 2 * np.pi * 1.4**2 * 4  # the upper halves of cones
    assert overhang(case) < plain + recesses
    board = Pos(0, -31.15, 5.1) * Box(85, 56, 1.6, align=LOW)
    assert gap(case, board) == pytest.approx(0.1, abs=0.01)  # on its posts, clear of the hinge
    assert gaps(case, lid, (90, 135, 180)) == pytest.approx([0.3] * 3, abs=0.01)
    assert gap(case, turned(case, lid, 70)) == pytest.approx(0.0, abs=0.005)  # on its stop
    assert 0.0 < gap(case, turned(case, lid, 70.5)) < 0.1


@pytest.mark.slow
def test_a_gridfinity_box_of_two_by_one_with_a_pin_of_filament():
    box, lid, pin = load("12_gridfinity_box_build123d").main()
    assert sound(box, lid)
    assert pytest.approx(83.5) == box.bounding_box().size.X
    assert gaps(box, lid, ANGLES) == pytest.approx([0.3] * 5, abs=0.01)
    assert gap(box, pin) == pytest.approx(0.05, abs=0.01)  # gripped
    assert gap(lid, pin) == pytest.approx(0.15, abs=0.01)  # free


@pytest.mark.slow
def test_the_gridfinity_box_in_place():
    example = load("12_gridfinity_box_build123d")
    step, high = 0.5 * (example.DEEP + 0.3), 30.0
    box, lid = Pos(0, -step) * example.tray(2.2, high), Pos(0, step) * example.tray(1.2, high)
    hinge = SingleHinge(71.5, knuckles=5, clearance=0.3, leaf=Bracket(gusset=True))
    place = hinge_location((0, 0, high + 0.15), along=(1, 0, 0), outwards=(0, 0, 1))
    box, lid = hinge.fit(box, lid, place)
    assert sound(box, lid)
    assert gaps(box, lid, ANGLES) == pytest.approx([0.3] * 5, abs=0.01)
    closed = turned(box, lid, 180).bounding_box()
    assert pytest.approx(41.5 + 0.15 + hinge.spec.radius) == closed.size.Y  # the barrel is behind


@pytest.mark.slow
def test_a_piano_hinge_of_31_knuckles():
    hinge = SingleHinge(
        200, knuckles=31, clearance=0.3, leaf=Leaf(14, 2, holes=8, hole=3.2, sink=6)
    )
    parent, child = hinge.parent_half, hinge.child_half
    assert sound(parent, child)
    assert len(hinge.plan.layout.knuckles) == 31
    assert gaps(parent, child, (0, 120)) == pytest.approx([0.3] * 2, abs=0.01)


@pytest.mark.slow
def test_a_hinge_of_eight_mm_for_eyeglasses():
    printed = SingleHinge(8, clearance=0.15, leaf=Leaf(6, 1.2))  # the barrel is as wide as it must
    assert printed.spec.radius == pytest.approx(1.6, abs=0.05)
    screwed = SingleHinge(8, clearance=0.15, pin=ScrewPin("M1.6", end="nut"), leaf=Leaf(8, 1.5))
    for hinge in (printed, screwed):
        parent, child = hinge.parent_half, hinge.child_half
        assert sound(parent, child)
        assert gaps(parent, child, ANGLES) == pytest.approx([0.15] * 5, abs=0.01)
        assert parent.bounding_box().size.Z <= 8.0 + 1e-6


@pytest.mark.slow
def test_a_cabinet_hinge_with_holes_for_screws():
    leaf = Leaf(25, 3, holes=3, hole=4, sink=8)
    hinge = SingleHinge(60, clearance=0.4, leaf=leaf, pin=RodPin(3))
    parent, child = hinge.parent_half, hinge.child_half
    assert sound(parent, child)
    for half in (parent, child):
        assert len(half.faces().filter_by(GeomType.CONE)) == 3  # a countersink a hole
    assert gap(parent, hinge.hardware) == pytest.approx(0.02, abs=0.01)
    assert gap(child, hinge.hardware) == pytest.approx(0.12, abs=0.01)
    assert gaps(parent, child, ANGLES) == pytest.approx([0.4] * 5, abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("clicks", [(0, 90), (0, 90, 180)], ids=str)
def test_it_clicks_and_runs_free_between(clicks):
    hinge = SingleHinge(40, clearance=0.3, detents=Detents(clicks), leaf=Leaf(16, 3))
    parent, child = hinge.parent_half, hinge.child_half
    assert sound(parent, child)
    assert gap(parent, child) == pytest.approx(0.3, abs=0.01)  # as it prints
    for angle in clicks[1:]:
        assert gaps(parent, child, (angle,))[0] == pytest.approx(0.05, abs=0.01)  # snug
        assert -0.1 < gaps(parent, child, (angle - 10,))[0] < 0.0  # over the ridge, pressed
    free = [angle for angle in (45, 135, 180) if angle not in clicks]
    assert gaps(parent, child, free) == pytest.approx([0.3] * len(free), abs=0.015)


@pytest.mark.slow
def test_a_lid_that_stays_where_it_is_let_go():
    hinge = SingleHinge(60, knuckles=5, clearance=0.3, friction=0.06, leaf=Leaf(16, 3))
    parent, child = hinge.parent_half, hinge.child_half
    assert sound(parent, child)
    assert gap(parent, child) == pytest.approx(0.3, abs=0.01)
    dragged = gaps(parent, child, (30, 60, 90, 120, 150, 180))
    assert dragged == pytest.approx([dragged[0]] * 6, abs=1e-3)  # alike all the way
    assert -0.1 < dragged[0] < -0.01


@pytest.mark.slow
def test_a_chain_of_five_doubles_folds_by_its_joints_alone():
    example = load("13_folding_chain_build123d")
    cubes, links = example.main()
    assert sound(*cubes, *links)
    assert least_gap(*cubes, *links) == pytest.approx(0.3, abs=0.01)
    example.fold(cubes, links)
    assert least_gap(*cubes, *links) == pytest.approx(0.3, abs=0.01)
    cells = [(0, 0, 0), (0, -1, 0), (0, -1, -1), (0, 0, -1), (0, 0, -2), (0, -1, -2)]
    for cube, cell in zip(cubes, cells, strict=True):
        core = Pos(*(20 * side for side in cell)) * Box(10, 10, 10)
        assert -gap(cube, core) == pytest.approx(10**3, rel=1e-3)  # where it belongs


@pytest.mark.slow
@needs_cadquery
def test_an_assembly_of_cadquery_closes_by_constraints():
    import cadquery as cq

    import hinges.cadquery  # noqa: F401

    def shell(y):
        whole = cq.Workplane().box(60, 39.7, 18, centered=(True, True, False))
        return whole.faces(">Z").shell(-2.4).translate((0, y, 0))

    options = {"knuckles": 5, "clearance": 0.3, "leaf": Bracket(gusset=True)}
    box = shell(-20).edges(">Y and >Z").hingeParent(outwards=(0, 0, 1), **options)
    lid = shell(20).edges("<Y and >Z").hingeChild(outwards=(0, 0, 1), **options)
    assert box.val().isValid()
    assert lid.val().isValid()
    made = cq.Assembly(box, name="box").add(lid, name="lid")
    made.constrain("box", "Fixed")
    made.constrain("box?hinge", "lid?hinge", "Point")
    made.constrain("box?hinge", "lid?hinge", "Axis", param=0)
    made.constrain("box@faces@<Z", "lid@faces@<Z", "Axis", param=180)  # one on the other
    made.solve()
    closed = lid.val().moved(made.objects["lid"].loc)
    assert closed.BoundingBox().zmax == pytest.approx(36.3, abs=1e-3)
    assert box.val().distance(closed) == pytest.approx(0.3, abs=1e-3)


@pytest.mark.slow
def test_a_hinge_in_inches():
    hinge = SingleHinge("2 in", clearance="12 thou", pin=ScrewPin("#6"), leaf=Leaf(19, 3))
    parent, child = hinge.parent_half, hinge.child_half
    assert sound(parent, child)
    assert hinge.spec.length == pytest.approx(50.8)
    assert gaps(parent, child, ANGLES) == pytest.approx([0.3048] * 5, abs=0.01)
    assert gap(child, hinge.hardware) == pytest.approx(0.2, abs=0.01)  # #6 in its clear hole


@pytest.mark.slow
@pytest.mark.parametrize(
    ("first", "second", "turns"),
    [
        ("+y", "-y", (90, 180)),
        ("+y", "-y", (270, 90)),
        ("+y", "+z", (180, 270)),
        ("-z", "-z", (180, 90)),
    ],
)
def test_a_double_hinge_through_each_of_its_ranges(first, second, turns):
    hinge = DoubleHinge(24, clearance=0.3, first=first, second=second, turns=turns)
    parent, link, child = hinge.fit(Pos(-12) * Box(*[23.7] * 3), Pos(12) * Box(*[23.7] * 3))
    assert sound(parent, link, child)
    assert least_gap(parent, link, child) == pytest.approx(0.3, abs=0.01)
    for angle in range(0, turns[0] + 1, 45):
        parent.joints["link"].connect_to(link.joints["parent"], angle=angle)
        assert gap(parent, link) == pytest.approx(0.3, abs=0.01)
    for angle in range(0, turns[1] + 1, 45):
        link.joints["child"].connect_to(child.joints["link"], angle=angle)
        assert gap(link, child) == pytest.approx(0.3, abs=0.01)


@pytest.mark.slow
def test_a_lid_snaps_shut_on_its_arc():
    example = load("14_snap_box_build123d")
    box, lid = example.main()
    spec = example.SNAP
    assert sound(box, lid)
    assert gaps(box, lid, (0, 90, 165, 180)) == pytest.approx([0.3] * 4, abs=0.01)
    # What an unbent ridge takes of the wall just before it drops into its dimple.
    assert 0.02 < -gaps(box, lid, (178,))[0] < 2.0 * spec.deflection * spec.width
    with pytest.raises(FitError, match="pressed on its way"):
        SnapTongue(replace(spec, catch=0.4))


@pytest.mark.slow
def test_a_screw_with_a_sunk_nut():
    hinge = SingleHinge(
        40, clearance=0.3, pin=ScrewPin("M3", end="nut", sunk=True), leaf=Leaf(16, 3)
    )
    parent, child = hinge.parent_half, hinge.child_half
    assert sound(parent, child)
    assert gaps(parent, child, ANGLES) == pytest.approx([0.3] * 5, abs=0.01)
    loose = hinge.hardware.bounding_box()
    assert pytest.approx((-20, 20)) == (loose.min.Z, loose.max.Z)  # nothing stands out
    assert gap(child, hinge.hardware) == pytest.approx(0.2, abs=0.01)
    _, nut = hinge.hardware.solids()
    assert gap(parent, nut) >= 0.0
    assert (parent.solid() & nut) is None or (parent.solid() & nut).volume < 1e-6


@pytest.mark.slow
def test_a_door_hinge_prints_lying_without_support():
    leaf = Leaf(20, 2, flat=True, holes=3, hole=3.4, sink=6.5)
    hinge = SingleHinge(60, knuckles=5, clearance=0.3, leaf=leaf)
    parent, child = hinge.parent_half, hinge.child_half
    assert sound(parent, child)
    for half in (parent, child):
        assert overhang(half, up=(0, 1, 0)) < 1.0
        assert pytest.approx(-0.5 * 2**0.5 * 3.0, abs=0.05) == half.bounding_box().min.Y
    assert gaps(parent, child, ANGLES) == pytest.approx([0.3] * 5, abs=0.01)


@pytest.mark.slow
def test_a_hinge_by_an_edge():
    box, lid = Pos(0, -20, 0) * Box(60, 39.7, 36), Pos(0, 20, 0) * Box(60, 39.7, 36)
    edge = box.edges().group_by(Axis.Z)[-1].sort_by(Axis.Y)[-1]
    hinge = SingleHinge.along(edge, clearance=0.3)
    box, lid = hinge.fit(box, lid, edge=edge)
    assert sound(box, lid)
    assert gaps(box, lid, ANGLES) == pytest.approx([0.3] * 5, abs=0.01)
    assert pytest.approx(18.15 + 36.15) == lid.bounding_box().max.Z  # turned over, on the box


@pytest.mark.slow
@needs_cadquery
def test_a_hinge_by_an_edge_in_cadquery():
    import cadquery as cq

    import hinges.cadquery  # noqa: F401

    box = cq.Workplane().box(60, 39.7, 36).translate((0, -20, 0))
    lid = cq.Workplane().box(60, 39.7, 36).translate((0, 20, 0))
    box = box.edges(">Y and >Z").hingeParent(clearance=0.3, outwards=(0, 0, 1))
    lid = lid.edges("<Y and >Z").hingeChild(clearance=0.3, outwards=(0, 0, 1))
    for angle in ANGLES:
        opened = lid.rotate((0, 0, 18.15), (1, 0, 18.15), angle)
        assert box.val().distance(opened.val()) == pytest.approx(0.3, abs=1e-3)


def read_3mf(path):
    """All meshes of a file as one."""
    model = lib3mf.get_wrapper().CreateModel()
    model.QueryReader("3mf").ReadFromFile(str(path))
    meshes, made = model.GetMeshObjects(), []
    while meshes.MoveNext():
        mesh = meshes.GetCurrentMeshObject()
        points = [tuple(point.Coordinates) for point in mesh.GetVertices()]
        faces = [tuple(face.Indices) for face in mesh.GetTriangleIndices()]
        made.append(m3.Manifold(m3.Mesh64(np.array(points), np.array(faces, dtype=np.uint64))))
    return m3.Manifold.compose(made)


@pytest.mark.slow
def test_files_of_a_box_and_its_lid(boxes, tmp_path):
    box, lid, place = boxes
    hinge = SingleHinge(60, knuckles=5, clearance=0.3, leaf=Bracket(gusset=True))
    parts = hinge.fit(box, lid, place, check=False)
    for slicer in ("prusa", "bambu"):
        made = write_3mf(parts, tmp_path / f"{slicer}.3mf", names=["box", "lid"], slicer=slicer)
        volumes = sorted(piece.volume() for piece in read_3mf(made).decompose())
        assert volumes == pytest.approx(sorted(part.volume for part in parts), rel=2e-3)
    read = import_step(write_step(parts, tmp_path / "box.step", names=["box", "lid"]))
    assert [part.label for part in read.children] == ["box", "lid"]
    assert [len(part.solids()) for part in read.children] == [1, 1]
    assert gap(*read.children) == pytest.approx(0.3, abs=0.01)


def test_a_living_hinge_in_a_plate():
    plate = Part() + Box(60, 2, 40, align=(Align.CENTER, Align.MIN, Align.CENTER))
    fold = LivingHinge(40, 2.0, angle=90, material="pp", use="few")
    cut = plate - fold
    assert sound(cut)
    thin = cut & (Pos(0, 1) * Box(0.9 * fold.land, 2, 60))
    box = thin.bounding_box()
    assert pytest.approx(fold.web) == box.size.Y
    assert pytest.approx(0.0) == box.min.Y  # the web is at the lower face
    assert fold.strain == pytest.approx(fold.web * np.pi / 2 / (2 * fold.land))


@pytest.mark.slow
def test_a_ball_in_its_socket():
    joint = BallSocket(6, clearance=0.3, swing=25)
    socket, ball = joint.socket, joint.ball
    assert sound(socket, ball)
    for angles in ((0, 0, 0), (25, 0, 0), (0, -25, 0), (0, 25, 90)):
        socket.joints["socket"].connect_to(ball.joints["ball"], angles=angles)
        assert gap(socket, ball) == pytest.approx(0.3, abs=0.02)
    drawn = Pos(0, 0, joint.retention + 0.3 + 1.0) * joint.ball
    assert gap(socket, drawn) < 0.0  # the mouth is narrower than the ball


@pytest.mark.slow
def test_mirrored_copied_and_pickled_hinges_are_as_good():
    hinge = SingleHinge(40, clearance=0.3, opens=110)
    volume = hinge.parent_half.volume
    for other in (
        copy.deepcopy(hinge),
        copy.copy(hinge),
        pickle.loads(pickle.dumps(hinge)),
        hinge.mirror(Plane.XZ),
        Pos(5, 6, 7) * Rot(10, 20, 30) * hinge,
    ):
        parent, child = other.parent_half, other.child_half
        assert sound(parent, child)
        assert parent.volume == pytest.approx(volume)
        assert gaps(parent, child, (0, 60)) == pytest.approx([0.3] * 2, abs=0.01)
        assert gap(parent, turned(parent, child, 110)) == pytest.approx(0.0, abs=0.005)


@pytest.mark.slow
@pytest.mark.parametrize("bore", ["teardrop", "octagon"])
def test_a_bore_that_lies_as_it_prints(bore):
    leaf, pin = Leaf(16, 2, flat=True), FilamentPin(2.85)
    made = SingleHinge(40, clearance=0.3, pin=pin, bore=bore, leaf=leaf)
    round_ = SingleHinge(40, clearance=0.3, pin=pin, leaf=leaf)
    parent, child = made.parent_half, made.child_half
    assert sound(parent, child)
    for one, other in ((parent, round_.parent_half), (child, round_.child_half)):
        assert overhang(one, up=(0, 1, 0)) < 0.6 * overhang(other, up=(0, 1, 0))
    assert gap(parent, made.hardware) == pytest.approx(0.05, abs=0.01)
    assert gap(child, made.hardware) == pytest.approx(0.15, abs=0.01)
    assert gaps(parent, child, ANGLES) == pytest.approx([0.3] * 5, abs=0.01)
