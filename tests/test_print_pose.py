"""The pose in which a kit is printed in place, and what the files and checks make of it."""

from __future__ import annotations

import xml.etree.ElementTree as ET
import zipfile
from dataclasses import replace
from pathlib import Path

import lib3mf
import numpy as np
import pytest
from export_kits import row_joinery, row_motion, row_tree

from fabfold.errors import RecipeError
from fabfold.kit.checking import run_checks
from fabfold.kit.keys import check_key, join_key
from fabfold.kit.writing import write_printable
from fabfold.meshes import mesh_volume
from fabfold.printing.print_mode import print_mode
from fabfold.printing.print_pose import posed_kit, print_pose
from fabfold.printing.profiles import load_profile
from fabfold.printing.size_checks import check_sizes
from fabfold.progress import SilentProgress
from fabfold.recipe.recipe import make_recipe

POWDER, PLA = load_profile("mjf-pa12"), load_profile("fdm-pla-0.4")


@pytest.fixture(scope="module")
def row():
    """Four cells in a row that fold to a block of 1 x 2 x 2, without the bump."""
    tree = row_tree()
    return tree, row_motion(tree), row_joinery(tree, bump=False)


def points_of(joinery):
    return np.concatenate([body.vertices for body in joinery.bodies])


def test_the_model_stays_as_it_came_and_its_figures_are_measured(row):
    tree, motion, joinery = row
    pose = print_pose(tree, motion, joinery, POWDER, "a")
    assert (pose.move, pose.name, pose.stays) == (0, "the model", True)
    assert posed_kit(joinery, pose) is joinery
    assert pose.size_mm == pytest.approx(np.ptp(points_of(joinery), axis=0))
    # Three gaps of a face each: both sides of 19.7 mm squares, less the hinges' grooves, with them.
    faces = 3 * 2 * 19.7**2
    assert 0.75 * faces < pose.narrow_mm2 < 1.4 * faces
    # The row lies: its gaps stand upright, none is under a face.
    assert pose.under_mm2 < 0.02 * faces


def test_the_box_lies_on_its_lowest_side_and_is_congruent(row):
    tree, motion, joinery = row
    pose = print_pose(tree, motion, joinery, POWDER, "b")
    assert (pose.move, pose.name) == (4, "the box")
    printed = posed_kit(joinery, pose)
    size = np.ptp(points_of(printed), axis=0)
    assert pose.size_mm == pytest.approx(size, abs=1e-6)
    # One cell, and barrels of 2.5 mm that stand out of it on both sides.
    assert size[2] == size.min() == pytest.approx(25.0, abs=0.05)
    for before, after in zip(joinery.bodies, printed.bodies, strict=True):
        assert np.linalg.det(pose.poses_mm[0][:3, :3]) == pytest.approx(1.0)
        assert mesh_volume(after.vertices, after.faces) == pytest.approx(before.volume)
    # Hinged bodies keep their gap in the box: nothing touches.
    from fabfold.joinery.cells import solids_of

    solids = solids_of(printed.bodies)
    for hinge in tree.hinges:
        one, other = solids[hinge.parent], solids[hinge.child]
        assert (one ^ other).volume() < 1e-6
        assert one.min_gap(other, 1.0) > 0.2


def test_a_pose_between_opens_what_the_model_and_the_box_keep_shut(row):
    tree, motion, joinery = row
    poses = [print_pose(tree, motion, joinery, POWDER, str(move)) for move in range(5)]
    assert [pose.name for pose in poses[1:4]] == [f"it is after move {i} of 4" for i in (1, 2, 3)]
    # With the last hinge half open, fewer faces lie against each other than in the box.
    assert poses[3].narrow_mm2 < 0.85 * poses[4].narrow_mm2
    with pytest.raises(RecipeError, match="has 4 moves"):
        print_pose(tree, motion, joinery, POWDER, "5")


def test_auto_takes_the_least_narrow_surface_for_its_room(row):
    tree, motion, joinery = row
    poses = [print_pose(tree, motion, joinery, POWDER, str(move)) for move in range(5)]
    cost = [pose.narrow_mm2 * pose.box_cm3 for pose in poses]
    chosen = print_pose(tree, motion, joinery, POWDER, "auto")
    assert cost[chosen.move] <= 1.05 * min(cost)
    # Where the printer is too small for the row, it is not chosen.
    small = POWDER.model_copy(update={"bed_mm": (60.0, 60.0, 60.0)})
    fitting = print_pose(tree, motion, joinery, small, "auto")
    assert fitting.size_mm.max() <= 60.0
    assert chosen.size_mm.max() > 60.0 or chosen.move == fitting.move


def test_filament_prints_a_pose_without_gaps_under_faces(row):
    tree, motion, joinery = row
    flat = print_pose(tree, motion, joinery, PLA, "auto")
    box = print_pose(tree, motion, joinery, PLA, "b")
    assert flat.under_mm2 <= 20.0
    standing = replace(box)
    assert standing.narrow_mm2 > 0


@pytest.mark.parametrize("wrong", ["c", "-1", "1.5", "", "12345"])
def test_what_is_no_pose_is_refused(wrong):
    with pytest.raises(RecipeError, match="pose"):
        make_recipe(model="sample:car", template="box-3x4x4", pose=wrong)


def test_fits_the_printer_is_about_the_pose(row):
    tree, motion, joinery = row
    tight = POWDER.model_copy(update={"bed_mm": (45.0, 45.0, 45.0)})

    def fits(asked):
        pose = print_pose(tree, motion, joinery, tight, asked)
        found = check_sizes(joinery, tree, motion, tight, pose)
        return next(check for check in found if check.name == "fits the printer")

    assert not fits("a").ok
    box = fits("b")
    assert box.ok
    assert "the kit as the box" in box.note


@pytest.mark.slow
def test_checks_and_keys_follow_the_pose(bar_kit):
    built, recipe, template = bar_kit.join(), bar_kit.recipe, bar_kit.template
    box = print_mode(POWDER, "in-place", pose="b")
    lies = next(
        check
        for check in run_checks(built, box, SilentProgress())
        if check.name == "prints as it lies"
    )
    assert lies.ok
    assert "printed as the box" in lies.note
    plain = print_mode(POWDER, "in-place")
    assert join_key(recipe, template, plain, []) == join_key(recipe, template, box, [])
    assert check_key(recipe, template, plain, []) != check_key(recipe, template, box, [])


def _read(path: Path):
    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(path))
    assert reader.GetWarningCount() == 0
    return model


def test_print_files_are_posed_and_bodies_stay_in_the_model(bar_kit, tmp_path):
    built = bar_kit.join()
    mode = print_mode(POWDER, "in-place", pose="b")
    write_printable(tmp_path, bar_kit.recipe.model_copy(update={"pose": "b"}), mode, built)
    pose = print_pose(built.planned.tree, built.planned.motion, built.joinery, POWDER, "b")
    for name in ("bar.3mf", "bar-bambu.3mf"):
        box = _read(tmp_path / name).GetOutbox()
        size = np.subtract(list(box.MaxCoordinate), list(box.MinCoordinate))
        assert size == pytest.approx(pose.size_mm, abs=1e-3)
    for path in (tmp_path / "bodies").iterdir():
        assert path.read_bytes() == (bar_kit.folder / "bodies" / path.name).read_bytes()
    with zipfile.ZipFile(tmp_path / "bar.3mf") as package:
        assert b"printed as the box" in package.read("3D/3dmodel.model")


# For slicers ------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def all_slicers(bar_kit, tmp_path_factory):
    """The files for every slicer."""
    folder = tmp_path_factory.mktemp("slicers")
    recipe = bar_kit.recipe.model_copy(update={"slicer": "all"})
    write_printable(folder, recipe, bar_kit.print_mode(), bar_kit.join())
    return folder


def _application(path: Path) -> str:
    with zipfile.ZipFile(path) as package:
        model = ET.fromstring(package.read("3D/3dmodel.model"))
    (found,) = (entry.text for entry in model if entry.get("name") == "Application")
    return found or ""


def _prusa_parts(path: Path) -> tuple[str, list[tuple[str, int, int, int | None]]]:
    """Name of the one object, and its parts, as PrusaSlicer reads them from the configuration.

    Rules: the object's ``id`` is that of a mesh which is built; parts are its ranges of triangles.
    """
    with zipfile.ZipFile(path) as package:
        config = ET.fromstring(package.read("Metadata/Slic3r_PE_model.config"))
        model = ET.fromstring(package.read("3D/3dmodel.model"))
    (entry,) = config.findall("object")
    space = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
    (item,) = model.findall(f"{space}build/{space}item")
    assert item.get("objectid") == entry.get("id")
    built = next(o for o in model.iter(f"{space}object") if o.get("id") == entry.get("id"))
    count = len(built.findall(f"{space}mesh/{space}triangles/{space}triangle"))
    parts, after = [], 0
    for volume in entry.findall("volume"):
        values = {m.get("key"): m.get("value") for m in volume.findall("metadata")}
        first, last = int(volume.get("firstid")), int(volume.get("lastid"))
        assert first == after
        after = last + 1
        extruder = values.get("extruder")
        parts.append((values["name"], first, last, None if extruder is None else int(extruder)))
    assert after == count
    return entry.find("metadata").get("value"), parts


@pytest.mark.parametrize("ending", ["-prusa.3mf", "-prusa3.3mf"])
def test_prusaslicer_sees_one_object_of_named_coloured_parts(all_slicers, bar_kit, ending):
    from fabfold.export.colours import body_colours

    path = all_slicers / f"bar{ending}"
    names = [body.name for body in bar_kit.join().joinery.bodies]
    _, parts = _prusa_parts(path)
    assert [(part[0], part[3]) for part in parts] == [(n, i) for i, n in enumerate(names, 1)]
    with zipfile.ZipFile(path) as package:
        lines = package.read("Metadata/Slic3r_PE.config").decode().splitlines()
    settings = dict(line.removeprefix("; ").split(" = ") for line in lines)
    colours = ["#{:02X}{:02X}{:02X}".format(*c) for c in body_colours(bar_kit.join().planned.tree)]
    assert settings["extruder_colour"].split(";") == colours
    assert settings["nozzle_diameter"].split(",") == ["0.4"] * len(names)


@pytest.mark.slow
def test_prusaslicer_3_reads_its_settings_by_the_application(all_slicers):
    application = _application(all_slicers / "bar-prusa3.3mf")
    name, _, version = application.partition("-")
    assert name == "PrusaSlicer"
    assert (2, 6, 0) <= tuple(int(part) for part in version.split(".")) <= (2, 99, 1)
    assert _application(all_slicers / "bar-prusa.3mf").startswith("fabfold ")


def test_the_plain_file_has_names_and_no_printer_of_its_own(all_slicers):
    _, parts = _prusa_parts(all_slicers / "bar.3mf")
    assert all(part[3] is None for part in parts)
    with zipfile.ZipFile(all_slicers / "bar.3mf") as package:
        assert "Metadata/Slic3r_PE.config" not in package.namelist()


def test_bambu_and_orca_see_one_object_of_named_coloured_parts(all_slicers, bar_kit):
    import json

    path = all_slicers / "bar-bambu.3mf"
    assert _application(path).startswith("BambuStudio-")
    with zipfile.ZipFile(path) as package:
        config = ET.fromstring(package.read("Metadata/model_settings.config"))
        project = json.loads(package.read("Metadata/project_settings.config"))
    (entry,) = config.findall("object")
    parts = entry.findall("part")
    names = [part.find("metadata[@key='name']").get("value") for part in parts]
    assert names == [body.name for body in bar_kit.join().joinery.bodies]
    filaments = [int(part.find("metadata[@key='extruder']").get("value")) for part in parts]
    assert filaments == list(range(1, len(names) + 1))
    assert len(project["filament_colour"]) == len(names)
    model = _read(path)
    components = model.GetComponentsObjects()
    assert components.MoveNext()
    whole = components.GetCurrentComponentsObject()
    assert whole.GetModelResourceID() == int(entry.get("id"))
    inside = {whole.GetComponent(i).GetObjectResource() for i in range(whole.GetComponentCount())}
    assert {r.GetModelResourceID() for r in inside} == {int(part.get("id")) for part in parts}
    assert model.GetBuildItems().Count() == 1


@pytest.mark.parametrize(
    ("slicer", "endings"),
    [
        ("any", {"-bambu"}),
        ("prusa", {"-prusa"}),
        ("prusa3", {"-prusa3"}),
        ("orca", {"-bambu"}),
        ("bambu", {"-bambu"}),
    ],
)
def test_files_of_other_slicers_go(bar_kit, tmp_path, slicer, endings):
    for ending in ("-prusa", "-prusa3", "-bambu"):
        (tmp_path / f"bar{ending}.3mf").write_bytes(b"of an older export")
    recipe = bar_kit.recipe.model_copy(update={"slicer": slicer})
    write_printable(tmp_path, recipe, bar_kit.print_mode(), bar_kit.join())
    assert {p.name for p in tmp_path.glob("*.3mf")} == {
        "bar.3mf", *(f"bar{ending}.3mf" for ending in endings)
    }  # fmt: skip
