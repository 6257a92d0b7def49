"""Whole kits of a small model: what a user gets, twice the same, stopped and gone on."""

import json
import multiprocessing
import os
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import trimesh

from fabfold.errors import KitError, ModelError, NoSolutionError, RecipeError
from fabfold.fold.motion import Motion
from fabfold.kit.kit import Kit, open_kit
from fabfold.tree.fold_tree import FoldTree

#: A shell's background job ignores SIGINT, and so do its children; both signals stop a run alike.
HEARS_CTRL_C = signal.getsignal(signal.SIGINT) is not signal.SIG_IGN


def files_of(folder):
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def read_json(kit, name):
    return json.loads((kit.folder / name).read_text(encoding="utf-8"))


def test_a_kit_has_every_file(bar_kit):
    names = {str(path.relative_to(bar_kit.folder)) for path in bar_kit.folder.rglob("*")}
    wanted = {"kit.toml", "tree.json", "motion.json", "bar.3mf", "bar.step", "fold.glb"}
    assert wanted | {"report.json", "bodies/body-00.stl"} <= names
    assert not [name for name in names if ".part-" in name]


def test_the_bar_folds_into_the_box(bar_kit):
    tree = FoldTree.from_json(read_json(bar_kit, "tree.json"))
    motion = Motion.from_json(read_json(bar_kit, "motion.json"))
    assert len(tree.source) == 8
    assert {tuple(cell) for cell in tree.target} == {tuple(c) for c in tree.template.cells}
    np.testing.assert_array_equal(motion.angles_deg[-1], tree.fold_angles)
    assert motion.certificate["min_gap_mm"] >= bar_kit.print_mode().profile.min_gap_mm
    assert len(motion.certificate["moves"]) == len(motion.moves) - 1


def test_bodies_are_single_closed_pieces_as_many_as_in_the_tree(bar_kit):
    tree = bar_kit.join().planned.tree
    paths = sorted((bar_kit.folder / "bodies").glob("*.stl"))
    assert [path.stem for path in paths] == sorted(body.name for body in tree.bodies)
    for path in paths:
        mesh = trimesh.load_mesh(path)
        assert mesh.is_watertight
        assert mesh.body_count == 1


def test_every_check_passes_and_is_reported_with_its_figure(bar_kit):
    report = read_json(bar_kit, "report.json")
    assert report["format"] == "fabfold-report"
    assert {check.name for check in bar_kit.check()} == {c["name"] for c in report["checks"]}
    assert all(check.ok for check in bar_kit.check()), [c for c in bar_kit.check() if not c.ok]


def test_a_stage_done_is_read_not_made_again(bar_kit):
    class Refuse:
        def stage(self, name):
            raise AssertionError(f"stage {name} is made again")

    again = open_kit(str(bar_kit.folder))
    again.listener = Refuse()
    assert again.recipe == bar_kit.recipe
    made, old = again.join(), bar_kit.join()
    assert made.planned.tree.to_json(20.0, (0, 0, 0)) == old.planned.tree.to_json(20.0, (0, 0, 0))
    assert made.joinery.notes == old.joinery.notes
    for one, other in zip(made.joinery.bodies, old.joinery.bodies, strict=True):
        np.testing.assert_array_equal(one.vertices, other.vertices)
        np.testing.assert_array_equal(one.faces, other.faces)
    assert again.check() == bar_kit.check()
    assert again.solid().notes == bar_kit.solid().notes


def test_a_changed_recipe_makes_only_what_depends_on_it(bar_kit, tmp_path):
    shutil.copytree(bar_kit.folder, tmp_path / "kit")
    kit_again = open_kit(str(tmp_path / "kit"), voxel_mm=30.0)
    made = []

    class Listen:
        def stage(self, name):
            made.append(name)
            raise KeyboardInterrupt

    kit_again.listener = Listen()
    with pytest.raises(KeyboardInterrupt):
        kit_again.join()
    assert made == ["join"]


@pytest.mark.slow
def test_without_a_folder_nothing_is_written(bar, bar_options, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    kit = Kit.from_model(bar, **bar_options)
    voxels = kit.voxelize()[0]
    assert len(voxels) == 8
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(KitError, match="folder"):
        kit.export()


@pytest.mark.slow
def test_interrupt_leaves_what_is_done_and_goes_on(bar, bar_options, tmp_path):
    folder = tmp_path / "kit"
    command = [sys.executable, "-m", "fabfold", "fold", str(bar), "-o", str(folder)]
    for key, value in bar_options.items():
        command += [f"--{key}", str(value)]
    run = subprocess.Popen(command, stderr=subprocess.PIPE, encoding="utf-8")
    journal = folder / "stages" / "journal.json"
    deadline = time.monotonic() + 400
    while not (journal.is_file() and "voxelize" in journal.read_text(encoding="utf-8")):
        assert run.poll() is None and time.monotonic() < deadline, run.stderr.read()
        time.sleep(0.02)
    os.kill(run.pid, signal.SIGINT if HEARS_CTRL_C else signal.SIGTERM)
    _, err = run.communicate(timeout=60)
    assert run.returncode == 130, err
    assert "goes on from there" in err
    assert "Traceback" not in err
    assert not list(folder.rglob(".part-*"))

    again = subprocess.run(command, capture_output=True, encoding="utf-8", check=False)
    assert again.returncode == 0, again.stderr
    assert "Cutting voxels" not in again.stderr
    assert (folder / "motion.json").is_file()


@pytest.mark.slow
def test_the_voxels_may_not_outnumber_the_template(bar):
    before = set(multiprocessing.active_children())
    kit = Kit.from_model(bar, template="box-1x1x1", pitch=10.0)
    with pytest.raises(NoSolutionError, match=r"voxels|cells"):
        kit.fit()
    assert set(multiprocessing.active_children()) <= before, "workers that stood by have ended"


def test_grid_placement_by_hand(bar):
    kit = Kit.from_model(
        bar, template="box-2x2x2", rotation=(0, 0, 90), pitch=10.0, origin=(0, -35.0, 0)
    )
    voxels = kit.voxelize()[0]
    assert voxels.cells.tolist() == [[0, j, 0] for j in range(8)]
    assert voxels.pitch == 10.0


def test_a_recipe_without_its_model_says_where_to_put_it(bar_kit, tmp_path):
    recipe = tmp_path / "kit.toml"
    recipe.write_text((bar_kit.folder / "kit.toml").read_text(encoding="utf-8"))
    with pytest.raises(ModelError, match=r"bar\.stl"):
        open_kit(str(recipe), folder=tmp_path / "new")


def test_bad_options_are_refused_by_name(bar):
    with pytest.raises(RecipeError, match="colour"):
        Kit.from_model(bar, colour="red")
