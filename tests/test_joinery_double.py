"""Double hinges as printed bodies: link plates placed, let in, grooved, proven and exported."""

import json
from dataclasses import replace

import lib3mf
import manifold3d
import numpy as np
import pygltflib
import pytest
from build123d import import_step
from double_models import RIGID, full_solid, hand_tree, motion_of, planned
from joinery_models import posed, voxels_of

from fabfold.errors import GeometryError
from fabfold.joinery.barrel_sweeps import Sweep
from fabfold.joinery.build import build_bodies
from fabfold.joinery.cutting import BodyCutter
from fabfold.joinery.hinge_placement import double_layout, hinge_frames, place_hinges
from fabfold.joinery.links import link_body
from fabfold.joinery.pockets import grown_corners
from fabfold.joinery.sizes import hinge_size, smallest_voxel
from fabfold.joinery.tally import BuildTally
from fabfold.kit.checking import run_checks
from fabfold.kit.stages import BuiltTree, PlannedTree
from fabfold.kit.step_process import StepProcess
from fabfold.kit.writing import write_kit
from fabfold.printing.print_mode import print_mode
from fabfold.printing.profiles import load_profile
from fabfold.progress import SilentProgress
from fabfold.proof.certify import certify
from fabfold.recipe.recipe import Recipe
from fabfold.solid.closed_solid import Solid
from fabfold.tree.catalogue import double_joints
from fabfold.tree.kinematics_check import check_tree
from hinges.exceptions import FitError

VOXEL, CLEARANCE = 20.0, 0.3
PAIR = [[0, 0, 0], [1, 0, 0]]


def build(tree, clearance=CLEARANCE, path=None):
    """Bodies and path of a tree of full cubes."""
    motion = motion_of(tree, path or planned(tree))
    voxels = voxels_of(tree.source, full_solid(tree))
    return (
        voxels,
        motion,
        build_bodies(voxels, tree, motion, voxel_mm=VOXEL, clearance_mm=clearance),
    )


def proven(tree, motion, joinery, least=0.285):
    meshes = [(body.vertices, body.faces) for body in joinery.bodies]
    return certify(tree, motion, meshes, VOXEL, joinery.origin_mm, least)


def least_gap(tree, motion, joinery, step_deg=30.0):
    """Smallest distance of any two bodies at sampled angles; every pose keeps its solids apart."""
    least = 1.0
    for before, after in zip(motion.angles_deg[:-1], motion.angles_deg[1:], strict=True):
        count = round(np.abs(after - before).max() / step_deg)
        for share in np.arange(count + 1) / count:
            solids = posed(joinery, tree, before + share * (after - before))
            whole = manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add)
            assert len(whole.decompose()) == len(tree.bodies)
            for i, one in enumerate(solids):
                for other in solids[i + 1 :]:
                    least = min(least, one.min_gap(other, 1.0))
    return least


@pytest.mark.slow
@pytest.mark.parametrize("clearance", [0.3, 0.5])
def test_every_double_hinge_of_the_catalogue_fits(clearance):
    """All 84 pairs of axes and turns: the link lies in its face, its knuckles about the axes."""
    size = hinge_size(VOXEL, clearance)
    joints = double_joints(0, neighbours_only=False)
    assert len(joints) == 84
    for joint in joints:
        tree = hand_tree(PAIR, [(0, 1, ("D", joint.sides, joint.turns))])
        # Where the cubes go on the way does not matter here.
        path = [(h, 1) for h in (1, 0) for _ in range(joint.turns[h])]
        hinges = place_hinges(tree, motion_of(tree, path), size, VOXEL)
        plate = hinges.plates[1]
        assert [len(halves) for halves in hinges.halves] == [1, 0, 1]
        assert len(plate.solid.decompose()) == 1
        lowest, highest = plate.corners[:, 0].min(), plate.corners[:, 0].max()
        assert (lowest + highest) / 2 == pytest.approx(VOXEL / 2)
        assert 1.5 <= highest - lowest <= 2.0 + 1e-9
        low, high = np.reshape(plate.solid.bounding_box(), (2, 3))
        for hinge in tree.hinges:
            reach = np.abs(np.array(hinge.point) - (0.5, 0.0, 0.0)) > 0.25
            outer = np.where(np.array(hinge.point) > 0, high, low)[reach]
            beyond = np.abs(outer) - VOXEL / 2
            np.testing.assert_allclose(beyond, size.barrel_radius_mm, atol=0.01)
            assert np.abs(outer).item() > VOXEL / 2


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sides", "turns"),
    [
        ((0, 1), (1, 1)),
        ((0, 2), (1, 3)),
        ((2, 1), (3, 3)),
        ((2, 3), (2, 2)),
    ],
)
def test_bodies_stay_apart_at_every_angle(sides, turns):
    tree = hand_tree(PAIR, [(0, 1, ("D", sides, turns))])
    assert check_tree(tree) == []
    _, motion, joinery = build(tree)
    assert [body.name for body in joinery.bodies] == ["body-00", "link-00", "body-01"]
    assert least_gap(tree, motion, joinery) >= CLEARANCE - 1e-3
    certificate = proven(tree, motion, joinery)
    assert certificate["min_gap_mm"] >= 0.285
    assert certificate["seen_gap_mm"] == pytest.approx(CLEARANCE, abs=1e-3)
    parent, link, child = (body.volume for body in joinery.bodies)
    # A plate of 2 mm, 14.4 mm wide where it is free, with one row of knuckles at two edges.
    assert 500.0 < link < 650.0
    # A body gives up half the plate, and as much again where the plate comes to lie on it.
    pocket = [(1.0 + CLEARANCE) * 15.0 * 17.5 * (1 + (turn == 3)) for turn in turns]
    cell = (VOXEL - CLEARANCE) ** 3
    for volume, taken in zip((parent, child), pocket, strict=True):
        assert 0.6 * taken < cell - volume < 1.6 * taken


CHAINS = {
    "D beside S": (
        [[0, 0, 0], [1, 0, 0], [2, 0, 0]],
        [(0, 1, ("D", (0, 1), (2, 2))), (1, 2, ("S", (2,), (2,)))],
    ),
    "S before D": (
        [[0, 0, 0], [1, 0, 0], [2, 0, 0]],
        [(0, 1, ("S", (2,), (1,))), (1, 2, ("D", (0, 2), (1, 1)))],
    ),
    "two D in a row": (
        [[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]],
        [(0, 1, ("D", (0, 2), (1, 1))), (1, 2, RIGID), (2, 3, ("D", (1, 3), (1, 2)))],
    ),
    "plate comes to lie between others": (
        [[0, 0, 0], [1, 0, 0], [-1, 0, 0]],
        [(0, 1, ("D", (0, 1), (2, 1))), (0, 2, ("S", (0,), (2,)))],
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", CHAINS)
def test_chains_are_proven(name):
    tree = hand_tree(*CHAINS[name])
    assert check_tree(tree) == []
    _, motion, joinery = build(tree)
    assert len(joinery.bodies) == len(tree.hinges) + 1
    certificate = proven(tree, motion, joinery)
    assert certificate["seen_gap_mm"] == pytest.approx(CLEARANCE, abs=1e-3)


def test_a_third_body_gets_a_pocket_for_the_plate():
    """Where the plate comes to lie on a body that is not its own, that body is let in."""
    tree = hand_tree(*CHAINS["plate comes to lie between others"])
    _, _, joinery = build(tree)
    solids = posed(joinery, tree, tree.fold_angles)
    link = [body.name for body in tree.bodies].index("link-00")
    edge = tree.edges[tree.bodies[link].edge]
    pose = tree.body_poses(tree.fold_angles)[link]
    middle = pose[:3, :3] @ (tree.source[[edge.parent, edge.child]].mean(axis=0)) + pose[:3, 3]
    normal = pose[:3, :3] @ (tree.source[edge.child] - tree.source[edge.parent]).astype(float)
    poses = tree.body_poses(tree.fold_angles)[tree.voxel_body]
    places = np.einsum("nij,nj->ni", poses[:, :3, :3], tree.source) + poses[:, :3, 3]
    third = [
        (body, sign)
        for body, place in zip(tree.voxel_body.tolist(), places, strict=True)
        for sign in (1.0, -1.0)
        if np.allclose(place, middle + sign * normal / 2) and body not in (0, link + 1)
    ]
    assert third
    origin = np.array(joinery.origin_mm)
    for body, sign in third:
        # From the middle of the face into the cell: first air, then material.
        start = origin + VOXEL * middle
        hits = solids[body].ray_cast(tuple(start), tuple(start + sign * 0.45 * VOXEL * normal))
        assert hits[0].distance * 0.45 * VOXEL == pytest.approx(1.0 + CLEARANCE, abs=0.05)
    assert joinery.carved_mm3 > 300.0
    assert any("link plates can pass" in note for note in joinery.notes)


def test_both_axes_on_one_edge_where_they_fit():
    tree = hand_tree(PAIR, [(0, 1, ("D", (0, 0), (1, 1)))])
    _, motion, joinery = build(tree)
    assert proven(tree, motion, joinery)["seen_gap_mm"] == pytest.approx(CLEARANCE, abs=1e-3)
    with pytest.raises(GeometryError, match=r"voxels 0 and 1 \(link-00, 90° and 90°\).*web"):
        build(tree, 0.5)


@pytest.mark.slow
def test_quarter_turns_of_single_hinges():
    tree = hand_tree(
        [[0, 0, 0], [1, 0, 0], [2, 0, 0]], [(0, 1, ("S", (0,), (1,))), (1, 2, ("S", (3,), (1,)))]
    )
    assert sorted(np.abs(tree.fold_angles)) == [90.0, 90.0]
    _, motion, joinery = build(tree)
    assert proven(tree, motion, joinery)["seen_gap_mm"] == pytest.approx(CLEARANCE, abs=1e-3)
    assert least_gap(tree, motion, joinery) >= CLEARANCE - 1e-3


def test_an_axis_that_turns_into_the_face_is_refused():
    tree = hand_tree(PAIR, [(0, 1, ("D", (0, 1), (1, 1)))])
    motion = motion_of(tree, [(0, 1), (1, 1)])
    frames = hinge_frames(tree)
    assert double_layout(tree, motion, tree.edges[0], frames) == ("-y", (90.0, 90.0))
    # Turning 180° on the way asks for room for 180°.
    further = motion_of(tree, [(0, 1), (0, 1), (1, 1), (0, -1)])
    assert double_layout(tree, further, tree.edges[0], frames) == ("-y", (180.0, 90.0))
    wrong = replace(motion, angles_deg=-motion.angles_deg)
    with pytest.raises(GeometryError, match=r"hinge-00.*turns away from the shared face"):
        double_layout(tree, wrong, tree.edges[0], frames)


def test_two_plates_in_one_face_are_refused():
    """Two plates that come to lie on one face: the later one has nowhere to be."""
    tree = hand_tree(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 2, 0]],
        [
            (0, 2, RIGID),
            (0, 1, ("D", (0, 1), (1, 2))),
            (2, 3, ("R", (), ())),
        ],
    )
    # The first link in a pose where the plate of another one would be: a copy of it, as a tool.
    motion = motion_of(tree, planned(tree))
    size = hinge_size(VOXEL, CLEARANCE)
    hinges = place_hinges(tree, motion, size, VOXEL)
    plate = hinges.plates[1]
    corners = grown_corners(plate, CLEARANCE) / VOXEL
    other = replace(plate, bodies=(0, 0))
    sweep = Sweep(1, 2, corners, np.zeros(3), np.zeros(3), 0.0)
    cutter = BodyCutter(
        1, tree, replace(hinges, plates={1: plate, 2: other}), [], [sweep], size, VOXEL
    )
    with pytest.raises(GeometryError, match=r"link-00: .* cut it apart"):
        link_body(cutter, BuildTally())


@pytest.mark.parametrize(("across", "fate"), [(True, "cut"), (False, "kept")])
def test_a_barrel_may_groove_a_link_but_not_cut_it(across, fate):
    tree = hand_tree(
        [[0, 0, 0], [1, 0, 0], [2, 0, 0]],
        [(0, 1, ("D", (0, 1), (1, 1))), (1, 2, ("S", (2,), (2,)))],
    )
    motion = motion_of(tree, planned(tree))
    size = hinge_size(VOXEL, CLEARANCE)
    hinges = place_hinges(tree, motion, size, VOXEL)
    plate = hinges.plates[1]
    ends = [[0.5, 0.0, -0.5], [0.5, 0.0, 0.5]] if across else [[0.5, -0.5, 0.4], [0.5, 0.5, 0.4]]
    sweep = Sweep(1, 2, np.array(ends), np.zeros(3), np.zeros(3), 0.0)
    cutter = BodyCutter(1, tree, hinges, [sweep], [], size, VOXEL)
    tally = BuildTally()
    if fate == "cut":
        with pytest.raises(GeometryError, match="link-00: hinge-02 cut it apart"):
            link_body(cutter, tally)
    else:
        solid = link_body(cutter, tally)
        assert len(solid.decompose()) == 1
        assert tally.links_cut == 1
        assert tally.links_mm3 == pytest.approx(plate.solid.volume() - solid.volume())
        assert tally.links_mm3 > 1.0


@pytest.mark.slow
def test_the_same_bytes_again():
    tree = hand_tree(*CHAINS["D beside S"])
    one, other = build(tree)[2], build(tree)[2]
    for first, second in zip(one.bodies, other.bodies, strict=True):
        assert first.vertices.tobytes() == second.vertices.tobytes()
        assert first.faces.tobytes() == second.faces.tobytes()


@pytest.fixture(scope="module")
def kit(tmp_path_factory):
    """A whole kit of three bodies and a link, with the report's checks."""
    profile = load_profile("mjf-pa12")
    tree = hand_tree(*CHAINS["plate comes to lie between others"])
    voxels, motion, joinery = build(tree, profile.clearance_mm)
    meshes = [(body.vertices, body.faces) for body in joinery.bodies]
    certificate = certify(tree, motion, meshes, VOXEL, joinery.origin_mm, profile.min_gap_mm)
    made = BuiltTree(
        PlannedTree(voxels, tree, replace(motion, certificate=certificate)), joinery, ()
    )
    mode = print_mode(profile)
    checks = run_checks(made, mode, SilentProgress())
    folder = tmp_path_factory.mktemp("double")
    solid = Solid("arm", voxels.vertices * VOXEL, voxels.faces)
    recipe = Recipe(model="arm.stl", template="box-2x2x2")
    with StepProcess(folder / "arm.step", made) as step:
        write_kit(folder, recipe, mode, solid, made, checks, SilentProgress(), step.wait)
    return folder, tree, joinery, checks


@pytest.mark.slow
def test_a_kit_with_a_link_passes_its_checks(kit):
    _, _, _, checks = kit
    assert [check.name for check in checks if not check.ok] == []
    notes = {check.name: check.note for check in checks}
    assert "a link plate" in notes["smallest body"]


@pytest.mark.slow
def test_a_kit_names_its_link_everywhere(kit):
    folder, tree, joinery, _ = kit
    names = [body.name for body in tree.bodies]
    assert "link-00" in names
    data = json.loads((folder / "tree.json").read_text(encoding="utf-8"))
    link = next(body for body in data["bodies"] if body["name"] == "link-00")
    assert link["voxels"] == []
    assert data["edges"][link["edge"]]["type"] == "D"
    assert data["joints"] == {"S": 1, "D": 1}
    assert sorted(path.stem for path in (folder / "bodies").glob("*.stl")) == sorted(names)
    wrapper = lib3mf.get_wrapper()
    model = wrapper.CreateModel()
    model.QueryReader("3mf").ReadFromFile(str(folder / "arm.3mf"))
    objects = model.GetMeshObjects()
    found = []
    while objects.MoveNext():
        found.append(objects.GetCurrentMeshObject().GetName())
    assert set(names) <= set(found)
    glb = pygltflib.GLTF2().load(str(folder / "fold.glb"))
    nodes = {node.name: node for node in glb.nodes}
    parent = glb.nodes[1 + tree.hinges[names.index("link-00") - 1].parent]
    assert glb.nodes.index(nodes["link-00"]) in parent.children
    step = import_step(folder / "arm.step")
    solids = {solid.label: solid for child in step.children for solid in [child]}
    assert set(names) <= set(solids)
    for body in joinery.bodies:
        assert solids[body.name].volume == pytest.approx(body.volume, rel=0.02)
    kinds = {str(face.geom_type) for face in solids["link-00"].faces()}
    assert any("CYLINDER" in kind for kind in kinds)
    assert any("CONE" in kind for kind in kinds)


@pytest.mark.parametrize(("clearance", "voxel"), [(0.3, 19.0), (0.5, 26.0)])
def test_both_axes_on_one_edge_want_a_larger_voxel(clearance, voxel):
    made = hinge_size(voxel, clearance).double("+y", (90.0, 90.0))
    assert made.knuckles == 5
    with pytest.raises(FitError, match="web"):
        hinge_size(voxel - 1.0, clearance).double("+y", (90.0, 90.0))


@pytest.mark.parametrize("clearance", [0.2, 0.3, 0.5, 0.6])
def test_a_double_hinge_fits_wherever_a_single_one_does(clearance):
    size = hinge_size(smallest_voxel(clearance), clearance)
    for second in ("-y", "+z"):
        assert size.double(second, (270.0, 270.0)).plate_mm >= 0.8
