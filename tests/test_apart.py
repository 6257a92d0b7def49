"""Kits printed body by body: bores and webs, order of assembly, plates and their files."""

import csv
import json
import xml.etree.ElementTree as ET
import zipfile
from dataclasses import replace

import numpy as np
import pytest

from fabfold.apart.apart_checks import check_apart
from fabfold.apart.apart_kit import prepare_apart
from fabfold.apart.pin_order import comes_away, find_order, poses_to_try
from fabfold.apart.pin_replay import replay_assembly
from fabfold.apart.plates import CONTACT_MM2, lay_out_plates, on_plate
from fabfold.errors import CheckError, GeometryError, RecipeError
from fabfold.joinery.bodies import BodyMesh
from fabfold.joinery.body_poses import poses_in_mm
from fabfold.joinery.booleans import union
from fabfold.joinery.build import build_bodies
from fabfold.joinery.cells import as_manifold
from fabfold.joinery.loose_pins import meshes_with_pins, pin_bores
from fabfold.kit.kit import Kit, open_kit
from fabfold.kit.stage_files import load_built, save_built
from fabfold.printing.print_mode import print_mode
from fabfold.printing.profiles import load_profile, profiles_folder
from fabfold.progress import SilentProgress
from fabfold.proof.certify import certify

PLA = load_profile("fdm-pla-0.4")
FIT = PLA.apart
FILAMENT = print_mode(PLA).pin_fit


def box(low, high):
    import manifold3d

    size = np.subtract(high, low)
    return manifold3d.Manifold.cube(tuple(size)).translate(tuple(low))


def arrays(solid):
    mesh = solid.to_mesh64()
    return np.array(mesh.vert_properties)[:, :3].copy(), np.array(mesh.tri_verts, dtype=np.int32)


@pytest.fixture(scope="module")
def open_bodies(bar_kit):
    """The bar's tree, its path, and its bodies with open bores."""
    planned, mode = bar_kit.fold(), print_mode(PLA)
    joinery = build_bodies(
        planned.voxels,
        planned.tree,
        planned.motion,
        voxel_mm=20.0,
        clearance_mm=FIT.clearance_mm,
        face_gap_mm=FIT.face_gap_mm,
        pin=mode.loose_pin(),
    )
    return planned.tree, planned.motion, joinery


@pytest.fixture(scope="module")
def made(open_bodies):
    tree, motion, joinery = open_bodies
    joinery, kit = prepare_apart(tree, motion, joinery, print_mode(PLA), SilentProgress())
    return tree, motion, joinery, kit


def test_the_profile_chooses_and_the_recipe_may_say_otherwise():
    chosen = print_mode(PLA)
    assert (chosen.name, chosen.face_gap_mm) == ("apart", 0.2)
    assert (chosen.profile.clearance_mm, chosen.profile.min_gap_mm) == (0.3, 0.1)
    assert chosen.loose_pin().diameter == 1.75
    powder = print_mode(load_profile("mjf-pa12"))
    assert (powder.name, powder.face_gap_mm, powder.loose_pin()) == ("in-place", None, None)
    assert print_mode(load_profile("mjf-pa12"), "apart", "rod-2").loose_pin().diameter == 2.0
    assert print_mode(PLA, clearance_mm=0.25).profile.clearance_mm == 0.25
    with pytest.raises(RecipeError, match=r"gaps of 0\.1 mm at least"):
        print_mode(PLA, clearance_mm=0.08)


@pytest.mark.slow
def test_bores_grip_and_slip_by_what_the_profile_says(made):
    tree, _, joinery, _ = made
    assert len(joinery.pins) == len(tree.hinges)
    for pin in joinery.pins:
        assert pin.length_mm == pytest.approx(20.0 - 2 * (2.5 + 0.3) - 0.8 - 0.2, abs=1e-6)
        hinge = tree.hinges[pin.hinge]
        bare = replace(joinery, pins=())
        rod = replace(joinery, pins=(pin,))
        alone = meshes_with_pins(rod)[pin.owner]
        start = len(meshes_with_pins(bare)[pin.owner][0])
        points = alone[0][start:]
        faces = alone[1][len(bare.bodies[pin.owner].faces) :] - start
        solid = as_manifold(points, faces.astype(np.int32), "pin")
        for body, wanted in ((hinge.parent, FIT.grip_mm), (hinge.child, FIT.slip_mm)):
            mesh = joinery.bodies[body]
            # The tip stands on the web: what is round is measured without it.
            shorter = solid.translate(tuple(0.15 * np.subtract(pin.tail_mm, pin.tip_mm) / 13.4))
            gap = as_manifold(mesh.vertices, mesh.faces, "body").min_gap(shorter, 1.0)
            assert gap == pytest.approx(wanted, abs=0.012)


@pytest.mark.slow
def test_a_web_with_a_hole_closes_the_far_end_and_the_way_in_is_free(made):
    _, _, joinery, kit = made
    import manifold3d

    for step in kit.steps:
        pin = joinery.pins[step.pin]
        tip, tail = np.array(pin.tip_mm), np.array(pin.tail_mm)
        z = (tail - tip) / np.linalg.norm(tail - tip)
        axis = int(np.abs(z).argmax())
        turn = np.eye(3)[:, [(axis + 1) % 3, (axis + 2) % 3, axis]]

        def rod(radius, start, end, turn=turn, axis=axis):
            low, high = sorted((start[axis], end[axis]))
            base = start.copy()
            base[axis] = low
            made = manifold3d.Manifold.cylinder(high - low, radius, radius, 64)
            return made.transform(np.column_stack([turn, base]))

        owner = joinery.bodies[pin.owner]
        body = as_manifold(owner.vertices, owner.faces, "owner")
        web = (body ^ rod(0.9, tip - 0.8 * z, tip)).volume()
        assert web == pytest.approx(np.pi * (0.9**2 - 0.5**2) * 0.8, rel=0.03)
        for index in {pin.owner, *_sides_of(step)}:
            mesh = joinery.bodies[index]
            way = rod(0.975, tip + 0.01 * z, tip + 8.0 * z)
            assert (as_manifold(mesh.vertices, mesh.faces, "body") ^ way).volume() < 1e-6


def _sides_of(step):
    return {*step.sides[0], *step.sides[1]}


@pytest.mark.slow
def test_the_path_is_proven_on_bodies_with_their_pins(made):
    tree, motion, joinery, _ = made
    proof = certify(
        tree, motion, meshes_with_pins(joinery), 20.0, joinery.origin_mm, FIT.min_gap_mm
    )
    assert FIT.min_gap_mm <= proof["min_gap_mm"] <= FIT.slip_mm


@pytest.mark.slow
def test_every_pin_is_put_in_once_and_parts_grow_together(made):
    tree, _, joinery, kit = made
    assert sorted(step.pin for step in kit.steps) == list(range(len(joinery.pins)))
    together = {frozenset({body}) for body in range(len(tree.bodies))}
    for step in kit.steps:
        rests, comes = (frozenset(side) for side in step.sides)
        assert {rests, comes} <= together
        together = (together - {rests, comes}) | {rests | comes}
        assert np.linalg.norm(step.away) == pytest.approx(1.0)
    assert together == {frozenset(range(len(tree.bodies)))}


@pytest.mark.slow
def test_the_replay_with_real_pins_agrees(made):
    tree, _, joinery, kit = made
    checks = {check.name: check for check in check_apart(joinery, kit)}
    pins = checks["pins that can be pushed in"]
    assert pins.ok
    assert pins.figure == pins.limit == len(tree.hinges)
    assert checks["plates"].figure == 1


@pytest.mark.slow
def test_the_replay_finds_a_pin_from_the_closed_end_and_a_side_from_below(made):
    tree, _, joinery, kit = made
    bores = pin_bores(tree, joinery)
    first = kit.steps[0]
    closed = [replace(first, end=-first.end), *kit.steps[1:]]
    seen = replay_assembly(tree, joinery, bores, closed, FILAMENT)
    assert seen.done == len(kit.steps) - 1
    assert f"{tree.hinges[bores[first.pin].hinge].name}: body-" in seen.faults[0]
    assert "in the way of the pin" in seen.faults[0]
    # Along the axis the knuckles of one side run into those of the other.
    x, y, z = bores[first.pin].axis.tolist()
    seen = replay_assembly(
        tree, joinery, bores, [replace(first, away=(x, y, z)), *kit.steps[1:]], FILAMENT
    )
    assert seen.done == len(kit.steps) - 1
    assert "before its place" in seen.faults[0]
    assert replay_assembly(tree, joinery, bores, kit.steps[1:], FILAMENT).done < len(kit.steps)


def test_a_kit_without_an_order_is_refused_and_the_hinge_is_named(open_bodies):
    tree, motion, joinery = open_bodies
    bore = pin_bores(tree, joinery)[0]
    # Walls of the pin's own bodies give way to it; those of a third body do not.
    other = next(index for index in range(len(tree.bodies)) if index not in bore.bodies)
    walls = []
    for end in (1, -1):
        middle = bore.face(end) + end * 12.0 * bore.axis
        walls.append(box(middle - 6.0, middle + 6.0))
    mesh = joinery.bodies[other]
    walled = union([as_manifold(mesh.vertices, mesh.faces, "other"), *walls])
    bodies = list(joinery.bodies)
    bodies[other] = BodyMesh(mesh.name, *arrays(walled))
    still = replace(motion, angles_deg=motion.angles_deg[:1], moves=motion.moves[:1])
    with pytest.raises(GeometryError, match="no order of assembly: no pin of hinge-"):
        find_order(
            tree, still, replace(joinery, bodies=tuple(bodies)),
            [bore], FILAMENT, SilentProgress(),
        )  # fmt: skip


@pytest.mark.parametrize(
    ("away", "free"), [((0, 0, 1), True), ((1, 0, 0), False), ((0, 0, -1), False)]
)
def test_a_block_leaves_a_trough_upwards_only(away, free):
    trough = box((0, 0, 0), (10, 10, 6)) - box((2, -1, 2), (8, 11, 7))
    block = box((2.2, 1, 2.2), (7.8, 9, 9))
    axis = (0, 1, 0)
    found = comes_away(arrays(trough), arrays(block), np.array(away, float), np.array(axis, float))
    assert found is free


def test_poses_begin_with_shape_a_and_eighths_come_last(bar_kit):
    motion = bar_kit.fold().motion
    poses = poses_to_try(motion)
    assert np.abs(poses[0]).max() == 0.0
    eighth = [bool((np.abs(pose) % 90 > 1e-6).any()) for pose in poses]
    assert eighth == sorted(eighth)
    assert len({pose.tobytes() for pose in poses}) == len(poses)


def test_poses_in_mm_carry_points_as_the_lattice_does(open_bodies):
    tree, motion, joinery = open_bodies
    angles = motion.angles_deg[-1]
    poses = poses_in_mm(tree, joinery, angles)
    origin = np.array(joinery.origin_mm)
    for body, pose, lattice in zip(tree.bodies, poses, tree.body_poses(angles), strict=True):
        for voxel in body.voxels:
            cell = tree.source[voxel].astype(float)
            there = lattice[:3, :3] @ cell + lattice[:3, 3]
            point = pose[:3, :3] @ (origin + 20.0 * cell) + pose[:3, 3]
            assert np.allclose(point, origin + 20.0 * there, atol=1e-9)


@pytest.mark.slow
def test_bodies_lie_flat_inside_the_bed_and_apart(made):
    _, _, joinery, kit = made
    plates = kit.plates
    boxes = []
    for index, (entry, body) in enumerate(
        zip(plates.laid, on_plate(joinery, plates, 0).bodies, strict=True)
    ):
        low, high = body.vertices.min(axis=0), body.vertices.max(axis=0)
        assert entry.body == index
        assert low[2] == pytest.approx(0.0, abs=1e-9)
        assert (low[:2] >= 5.0 - 0.1).all()
        assert (high <= np.array(plates.bed_mm) - (4.9, 4.9, 0.0)).all()
        assert np.linalg.det(plates.poses[index][:3, :3]) == pytest.approx(1.0)
        assert entry.contact_mm2 >= CONTACT_MM2 or entry.supported
        boxes.append((low, high))
    for i, (low, high) in enumerate(boxes):
        for other_low, other_high in boxes[i + 1 :]:
            apart = np.maximum(low - other_high, other_low - high)[:2].max()
            assert apart >= 4.0 - 1e-6


@pytest.mark.slow
def test_a_small_bed_takes_more_plates_and_a_tiny_one_names_the_voxel_that_fits(made):
    tree, _, joinery, _ = made
    bores = pin_bores(tree, joinery)
    longest = max(np.ptp(body.vertices, axis=0).max() for body in joinery.bodies)
    small = PLA.model_copy(update={"bed_mm": (longest + 14.0, longest + 14.0, 100.0)})
    plates = lay_out_plates(joinery, bores, small)
    assert plates.count > 1
    assert sorted(set(plates.plate.tolist())) == list(range(plates.count))
    tiny = PLA.model_copy(update={"bed_mm": (30.0, 30.0, 200.0)})
    with pytest.raises(CheckError, match=r"fits no plate of 30 × 30 × 200 mm; --voxel-mm \d+") as e:
        lay_out_plates(joinery, bores, tiny)
    assert "body-" in str(e.value)


@pytest.fixture(scope="module")
def kit_folder(searched, bar, bar_options, tmp_path_factory):
    """The bar's kit for a filament printer, exported."""
    folder = searched(tmp_path_factory.mktemp("apart") / "bar-kit")
    kit = Kit.from_model(bar, folder=folder, workers=1, profile="fdm-pla-0.4", **bar_options)
    kit.export()
    return kit, folder


@pytest.mark.slow
def test_the_kit_passes_and_its_files_agree(kit_folder):
    kit, folder = kit_folder
    report = json.loads((folder / "report.json").read_text("utf-8"))
    assert report["verdict"] == "ok"
    assert report["summary"]["print"] == "apart"
    bodies = [body.name for body in kit.join().joinery.bodies]
    assembly = json.loads((folder / "assembly.json").read_text("utf-8"))
    assert (assembly["format"], assembly["version"]) == ("fabfold-assembly", 1)
    assert sorted(name for plate in assembly["plates"] for name in plate) == sorted(bodies)
    assert len(assembly["steps"]) == report["summary"]["pins"]
    for step in assembly["steps"]:
        assert step["pin"]["gripped_by"] in step["rests"] + step["comes"]
    rows = list(csv.DictReader((folder / "bom.csv").open(encoding="utf-8")))
    pins = sum(int(row["count"]) for row in rows if row["item"].startswith("pin"))
    assert pins == report["summary"]["pins"]


@pytest.mark.slow
def test_plates_hold_every_body_by_name_and_bambu_finds_its_plates(kit_folder):
    import lib3mf

    kit, folder = kit_folder
    bodies = sorted(body.name for body in kit.join().joinery.bodies)
    for file in ("plate-1.3mf", "bar-bambu.3mf", "bar.3mf"):
        model = lib3mf.get_wrapper().CreateModel()
        reader = model.QueryReader("3mf")
        reader.SetStrictModeActive(True)
        reader.ReadFromFile(str(folder / file))
        assert reader.GetWarningCount() == 0
        found, items = model.GetMeshObjects(), model.GetBuildItems()
        names = []
        while found.MoveNext():
            names.append(found.GetCurrentMeshObject().GetName())
        assert sorted(names) == bodies
        assert items.Count() == len(bodies)
    with zipfile.ZipFile(folder / "bar-bambu.3mf") as package:
        config = ET.fromstring(package.read("Metadata/model_settings.config"))
        project = json.loads(package.read("Metadata/project_settings.config"))
        core = ET.fromstring(package.read("3D/3dmodel.model"))
    space = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
    objects = {o.get("id"): o.get("name") for o in core.iter(f"{space}object")}
    named = {
        o.get("id"): next(m.get("value") for m in o if m.get("key") == "name")
        for o in config.findall("object")
    }
    assert named == objects
    members = [
        m.get("value")
        for m in config.findall("plate/model_instance/metadata")
        if m.get("key") == "object_id"
    ]
    assert sorted(members) == sorted(objects)
    assert project["printable_area"] == ["0x0", "220x0", "220x220", "0x220"]
    told = {m.get("name"): m.text for m in core.iter(f"{space}metadata")}
    assert told["Application"].startswith("BambuStudio-")


@pytest.mark.slow
def test_a_kit_comes_back_from_its_folder(kit_folder):
    kit, _ = kit_folder
    built = kit.join()
    store = kit._store
    again = load_built(store, save_built(store, built))
    assert again.joinery.pins == built.joinery.pins
    assert again.apart.steps == built.apart.steps
    assert np.allclose(again.apart.plates.poses, built.apart.plates.poses)
    assert again.apart.plates.plate.tolist() == built.apart.plates.plate.tolist()
    assert again.joinery.face_gap_mm == 0.2


@pytest.mark.slow
def test_a_filament_printer_is_told_that_a_closed_kit_fuses(bar_kit):
    from fabfold.kit.checking import run_checks

    built = bar_kit.join()
    checks = run_checks(built, print_mode(PLA, "in-place", pose="b"), SilentProgress())
    (lies,) = (check for check in checks if check.name == "prints as it lies")
    assert not lies.ok
    assert "--print apart" in lies.note
    assert {c.name: c.ok for c in bar_kit.check()}["prints as it lies"]


def test_printed_in_place_again_the_plates_go(tmp_path):
    from fabfold.apart.plate_files import remove_plates

    for name in ("plate-1.3mf", "plate-2.3mf", "bar-bambu.3mf", "assembly.json", "plate-x.3mf"):
        (tmp_path / name).write_text("old", "utf-8")
    remove_plates(tmp_path, keep=1)
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        "assembly.json", "bar-bambu.3mf", "plate-1.3mf", "plate-x.3mf",
    ]  # fmt: skip
    remove_plates(tmp_path)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["bar-bambu.3mf", "plate-x.3mf"]


@pytest.mark.slow
def test_the_urdf_folds_in_mujoco_as_the_kit_does(kit_folder):
    import mujoco

    kit, folder = kit_folder
    built = kit.join()
    tree, motion, joinery = built.planned.tree, built.planned.motion, built.joinery
    model = mujoco.MjModel.from_xml_path(str(folder / "bar.urdf"))
    data = mujoco.MjData(model)
    assert model.njnt == len(tree.hinges)
    for hinge, angle in zip(tree.hinges, motion.angles_deg[-1], strict=True):
        joint = model.joint(hinge.name)
        assert joint.range[0] - 1e-6 <= np.radians(angle) <= joint.range[1] + 1e-6
        data.joint(hinge.name).qpos = np.radians(angle)
    mujoco.mj_forward(model, data)
    wanted = poses_in_mm(tree, joinery, motion.angles_deg[-1])
    origin = np.array(joinery.origin_mm)
    for hinge in tree.hinges:
        name, pose = joinery.bodies[hinge.child].name, wanted[hinge.child]
        point = origin + 20.0 * np.array(hinge.point)
        assert np.allclose(data.body(name).xmat.reshape(3, 3), pose[:3, :3], atol=1e-6)
        there = 1000.0 * data.body(name).xpos
        assert np.allclose(there, pose[:3, :3] @ point + pose[:3, 3], atol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("sides", "turns"), [((0, 1), (1, 1)), ((0, 2), (1, 3)), ((2, 1), (3, 3))])
def test_double_hinges_have_a_pin_an_axis_and_go_together(sides, turns):
    from double_models import full_solid, hand_tree, motion_of, planned
    from joinery_models import voxels_of

    tree = hand_tree([[0, 0, 0], [1, 0, 0]], [(0, 1, ("D", sides, turns))])
    motion = motion_of(tree, planned(tree))
    joinery = build_bodies(
        voxels_of(tree.source, full_solid(tree)),
        tree,
        motion,
        voxel_mm=20.0,
        clearance_mm=FIT.clearance_mm,
        face_gap_mm=FIT.face_gap_mm,
        pin=print_mode(PLA).loose_pin(),
    )
    joinery, kit = prepare_apart(tree, motion, joinery, print_mode(PLA), SilentProgress())
    assert len(joinery.pins) == 2
    assert {pin.owner for pin in joinery.pins} == {0, 2}  # the link turns on both
    seen = replay_assembly(tree, joinery, pin_bores(tree, joinery), kit.steps, FILAMENT)
    assert (seen.done, seen.faults) == (2, ())
    proof = certify(tree, motion, meshes_with_pins(joinery), 20.0, joinery.origin_mm, 0.1)
    assert proof["min_gap_mm"] >= 0.1


@pytest.mark.slow
def test_every_3mf_shows_a_picture(kit_folder):
    import io

    from PIL import Image

    _, folder = kit_folder
    for file in ("plate-1.3mf", "bar.3mf", "bar-bambu.3mf"):
        with zipfile.ZipFile(folder / file) as package:
            (name,) = (
                n for n in package.namelist() if n.endswith(".png") and "Auxiliaries" not in n
            )
            image = Image.open(io.BytesIO(package.read(name)))
        assert image.size == (256, 256)
        assert len(image.getcolors(256 * 256)) > 100


@pytest.mark.slow
def test_a_kit_that_does_not_go_together_fails_its_check_and_says_where(made):
    tree, _, joinery, kit = made
    bores = pin_bores(tree, joinery)
    first = kit.steps[0]
    seen = replay_assembly(
        tree, joinery, bores, [replace(first, end=-first.end), *kit.steps[1:]], FILAMENT
    )
    checks = {check.name: check for check in check_apart(joinery, replace(kit, replay=seen))}
    pins = checks["pins that can be pushed in"]
    assert not pins.ok
    assert (pins.figure, pins.limit) == (len(kit.steps) - 1, len(kit.steps))
    assert "in the way of the pin" in pins.note


@pytest.mark.slow
def test_what_was_seen_comes_back_with_the_kit(kit_folder):
    built = kit_folder[0].join()
    again = load_built(kit_folder[0]._store, save_built(kit_folder[0]._store, built))
    assert again.apart.replay == built.apart.replay


def test_the_largest_voxel_that_a_bed_holds(bar_kit):
    """The bar of 8 voxels in one piece, and its bodies of 2 by themselves."""
    from fabfold.kit.bed_fit import largest_voxel

    tree = bar_kit.fold().tree
    mode = bar_kit.print_mode()
    small = replace(mode, profile=mode.profile.model_copy(update={"bed_mm": (120.0, 100.0, 90.0)}))
    assert largest_voxel(tree, small) == pytest.approx(np.floor(1200 / 8.3) / 10)
    none = replace(mode, profile=mode.profile.model_copy(update={"bed_mm": None}))
    assert largest_voxel(tree, none) is None
    longest = max(np.ptp(tree.source[list(body.voxels)], axis=0).max() + 1 for body in tree.bodies)
    apart = replace(small, apart=True)
    assert largest_voxel(tree, apart) == pytest.approx(np.floor(10 * 110 / (longest + 0.3)) / 10)


@pytest.mark.slow
def test_a_kit_is_made_to_fit_a_small_bed(bar, tmp_path, capsys):
    """With --fit-bed the closed kit lies within the build volume; without it the check fails."""
    from fabfold.cli.app import main

    text = (profiles_folder() / "mjf-pa12.toml").read_text(encoding="utf-8")
    own = tmp_path / "small.toml"
    text = text.replace("bed_mm = [380.0, 284.0, 380.0]", "bed_mm = [140.0, 60.0, 60.0]")
    own.write_text(text.replace('name = "mjf-pa12"', 'name = "small"'), encoding="utf-8")
    options = ["-t", "box-2x2x2", "--effort", "quick", "--profile", str(own), "-q", "-j", "1"]
    for more, code in (([], 1), (["--fit-bed"], 0)):
        with pytest.raises(SystemExit) as stopped:
            main(["check", str(bar), "-o", str(tmp_path / "kit"), *options, *more])
        assert (stopped.value.code or 0) == code
    assert "16.8 mm voxels fit the bed" in capsys.readouterr().err
    kit = open_kit(str(tmp_path / "kit"))
    assert kit.recipe.voxel_mm == 16.8
    joinery = kit.join().joinery
    low = np.min([body.vertices.min(axis=0) for body in joinery.bodies], axis=0)
    high = np.max([body.vertices.max(axis=0) for body in joinery.bodies], axis=0)
    assert (np.sort(high - low) <= np.sort([140.0, 60.0, 60.0])).all()
