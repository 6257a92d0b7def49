"""The first kit that folds, written while the model is cut and the search goes on."""

import io
import json
import os
import pickle
import subprocess
import sys
import threading
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from stage_listener import StageListener

from fabfold.errors import CheckError, GeometryError, KitError, NoFoldError
from fabfold.kit import early as early_module
from fabfold.kit import first_trees as first_trees_module
from fabfold.kit.cutting_stage import cut_model
from fabfold.kit.early import EarlyKit, write_early
from fabfold.kit.first_trees import first_trees
from fabfold.kit.kit import Kit
from fabfold.progress import SilentListener, SilentProgress
from fabfold.search.seeds import run_seed
from fabfold.tree.kinematics_check import check_tree
from fabfold.voxels.voxelize import MAX_LOSS, fill_shares


class Listener(StageListener):
    """Keeps the last message of each stage."""

    def __init__(self):
        self.told = {}

    def update(self, share, message=""):
        self.told[self.name] = message


@pytest.fixture
def begin(bar_kit, monkeypatch, tmp_path):
    """Makes the early kit of the bar, for a print mode and a listener, as if kernels were there."""
    stamp = tmp_path / "kernels.stamp"
    stamp.touch()
    monkeypatch.setattr(early_module, "kernel_stamp", lambda: stamp)
    (tmp_path / "kit").mkdir()

    def make(listener=None, mode=None, claim=lambda: None):
        return EarlyKit(
            bar_kit.recipe,
            bar_kit.template,
            mode or bar_kit.print_mode(),
            tmp_path / "kit",
            lambda: (bar_kit.solid(), bar_kit.wishes()),
            claim,
            listener or SilentListener(),
        )

    return make


@pytest.fixture
def files(tmp_path):
    """Lists the files in the kit's folder."""
    return lambda: sorted(path.name for path in (tmp_path / "kit").iterdir())


@pytest.mark.slow
def test_a_first_kit_has_bodies_and_the_proof(bar_kit, begin, files, tmp_path):
    listener, before = Listener(), []
    with begin(listener, claim=lambda: before.append(files())) as early:
        early.start()
        early.start()
        early.wait()  # Nobody has to ask for it.
    assert before == [[]], "the folder is claimed once, before anything is there"
    assert early.processor_seconds > 0.1
    kit = tmp_path / "kit"
    tree = json.loads((kit / "tree.json").read_text("utf-8"))
    motion = json.loads((kit / "motion.json").read_text("utf-8"))
    assert motion["certificate"]["min_gap_mm"] >= bar_kit.print_mode().profile.min_gap_mm
    bodies = sorted((kit / "bodies").glob("*.stl"))
    assert len(bodies) == len(tree["bodies"]) == len(tree["hinges"]) + 1
    assert all(trimesh.load(path).is_watertight for path in bodies)
    assert (kit / f"{bar_kit.recipe.name}.3mf").stat().st_size > 1000
    assert f"{len(tree['hinges'])} hinges, box closed to" in listener.told["early"]


@pytest.mark.slow
def test_the_first_trees_fold_and_come_with_few_hinges_first(bar_kit):
    template = bar_kit.template
    trees = list(first_trees(bar_kit.recipe, template, bar_kit.solid(), bar_kit.wishes()))
    counts = [len(planned.tree.hinges) for planned in trees]
    assert counts == sorted(counts)
    cells = {tuple(cell) for cell in template.cells.tolist()}
    for planned in trees:
        assert check_tree(planned.tree) == []
        assert {tuple(cell) for cell in planned.tree.target.tolist()} <= cells
        assert len(planned.motion.moves) >= 2
    again = first_trees(bar_kit.recipe, template, bar_kit.solid(), bar_kit.wishes())
    assert np.array_equal(next(again).tree.target, trees[0].tree.target)


@pytest.mark.slow
@pytest.mark.parametrize(("unlucky", "run"), [((), [0, 1]), ((0,), [0, 1, 2]), ((0, 1), [0, 1, 2])])
def test_the_best_of_two_lucky_seeds_is_taken(bar_kit, monkeypatch, unlucky, run):
    asked, sizes = [], []

    def some(job, seed, *rest):
        asked.append(seed)
        found = run_seed(job, seed, *rest)
        if seed in unlucky:
            return replace(found, candidates=())
        sizes.extend(len(candidate.tree.hinges) for candidate in found.candidates)
        return found

    monkeypatch.setattr(first_trees_module, "run_seed", some)
    monkeypatch.setattr(first_trees_module, "add_crease_hinges", lambda tree, _: tree)
    kit = bar_kit
    first = next(first_trees(kit.recipe, kit.template, kit.solid(), kit.wishes()))
    assert asked == run
    assert len(first.tree.hinges) == min(sizes)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux keeps a process to some cores")
def test_manifold_keeps_to_one_core_and_the_process_to_all():
    code = (
        "import os; before = os.sched_getaffinity(0)\n"
        "from fabfold.kit.early import _keep_manifold_to_one_core as keep\n"
        "keep()\n"
        "from manifold3d import Manifold\n"
        "ball = Manifold.sphere(1.0, 400)\n"
        "(ball - ball.translate((0.5, 0.0, 0.0))).num_tri()\n"
        "assert os.sched_getaffinity(0) == before\n"
        "print(len(os.listdir('/proc/self/task')))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == ["1"], "no threads beside the first one"


@pytest.mark.slow
def test_a_cut_in_haste_is_full_and_roomy(tmp_path):
    path = tmp_path / "ball.stl"
    trimesh.creation.icosphere(subdivisions=3, radius=20.0).export(path)
    kit = Kit.from_model(path, template="box-3x3x3", workers=1)
    cut = cut_model(kit.recipe, kit.solid(), kit.template, (), SilentProgress(), hasty=True)
    full, roomy = sorted((len(voxels) for voxels in cut.options), reverse=True)
    assert roomy < full <= 27
    assert roomy / 27 == pytest.approx(fill_shares(27)[-1], abs=0.08)
    assert all(voxels.lost_volume <= MAX_LOSS for voxels in cut.options)


@pytest.mark.parametrize("name", ["report.json", "tree.json"])
def test_a_kit_that_is_there_is_left_alone(begin, files, tmp_path, name):
    (tmp_path / "kit" / name).write_text("{}", "utf-8")
    with begin() as early:
        early.start()
        early.search()
        assert early._process is None
    assert files() == [name]
    assert early.processor_seconds == 0.0


def test_nothing_is_made_where_it_is_not_wanted(begin, files):
    with begin() as early:
        early.start(wanted=False)
        early.search()
        assert early._process is None
    assert files() == []


def test_it_waits_for_the_kernels(begin, monkeypatch, tmp_path):
    stamp = tmp_path / "later.stamp"
    monkeypatch.setattr(early_module, "kernel_stamp", lambda: stamp)
    with begin() as early:
        early.start()
        assert early._process is None
        stamp.touch()
        early.search()
        assert early._process is not None


@pytest.mark.slow
def test_a_tree_whose_bodies_do_not_come_out_says_why_and_leaves_nothing(bar_kit, begin, files):
    listener = Listener()
    mode = bar_kit.print_mode()
    huge = replace(mode, profile=mode.profile.model_copy(update={"clearance_mm": 4.9}))
    with begin(listener, huge) as early:
        early.start()
        early.wait()
    assert listener.told["early"].startswith("not this time: ")
    assert "Error" not in listener.told["early"]
    assert files() == []


def test_the_last_error_is_raised_where_no_tree_can_be_built(bar_kit, tmp_path, monkeypatch):
    errors = iter([GeometryError("too thick"), CheckError("too near")])

    def refuse(*_, **__):
        raise next(errors)

    monkeypatch.setattr(early_module, "build", refuse)
    planned = object()
    monkeypatch.setattr(early_module, "first_trees", lambda *_: iter([planned, planned]))
    work = pickle.dumps((bar_kit.recipe, bar_kit.template, bar_kit.print_mode(), tmp_path, 0, 0))
    with pytest.raises(CheckError, match="too near"):
        write_early(io.BytesIO(work))
    monkeypatch.setattr(early_module, "first_trees", lambda *_: iter([]))
    with pytest.raises(NoFoldError):
        write_early(io.BytesIO(work))


def test_it_ends_where_the_model_cannot_be_cut(begin, files):
    listener = Listener()
    with pytest.raises(NoFoldError), begin(listener) as early:
        early.start()
        process = early._process
        assert process.poll() is None
        raise NoFoldError("nothing folds")
    assert process.poll() is not None
    assert listener.told["early"] == "given up"
    assert files() == []


def test_it_is_given_up_once_the_search_is_over(begin, tmp_path):
    listener = Listener()
    with begin(listener) as early:
        early.start()
        early.search()
    assert listener.told["early"] == "given up: the search is over"
    assert not list(tmp_path.rglob(".part-*"))


@pytest.mark.slow
def test_it_is_finished_where_the_search_was_stopped(bar_kit, begin, files):
    with pytest.raises(KeyboardInterrupt), begin() as early:
        early.start()
        early.search()
        raise KeyboardInterrupt
    assert f"{bar_kit.recipe.name}.3mf" in files()


@pytest.mark.slow
def test_what_is_being_written_is_written_whole(bar_kit, begin, files):
    claimed = threading.Event()
    with pytest.raises(KeyboardInterrupt), begin(claim=claimed.set) as early:
        early.start()
        assert claimed.wait(timeout=120)
        raise KeyboardInterrupt  # The model is still being cut.
    assert f"{bar_kit.recipe.name}.3mf" in files()


@pytest.mark.slow
def test_nothing_is_written_to_a_folder_of_another_run(begin, files):
    def refuse():
        raise KitError("another run is at work in this folder")

    listener = Listener()
    with begin(listener, claim=refuse) as early:
        early.start()
        early.wait()
    assert listener.told["early"] == "not this time: another run is at work in this folder"
    assert files() == []


@pytest.mark.slow
def test_the_first_kit_is_there_before_the_model_is_cut_well(
    bar, bar_options, bar_kit, monkeypatch, tmp_path
):
    """It does not wait for that, and the folder has the recipe, so that the run can go on."""
    stamp, folder, there = tmp_path / "kernels.stamp", tmp_path / "kit", []
    stamp.touch()
    monkeypatch.setattr(early_module, "kernel_stamp", lambda: stamp)
    written = threading.Event()

    class Look:
        @contextmanager
        def stage(self, name):
            if name == "voxelize":
                assert written.wait(timeout=120)
            yield SilentProgress()
            if name == "early":
                there.extend(sorted(path.name for path in folder.iterdir()))
                written.set()

    kit = Kit.from_model(bar, folder=folder, workers=1, **bar_options)
    kit.listener = Look()
    kit.export()
    assert {"kit.toml", "tree.json", "motion.json", "bodies", "bar.3mf"} <= set(there)
    assert "report.json" not in there
    assert (folder / "report.json").is_file()
    assert kit.processor_seconds["early"] > 0.1
    assert all(check.ok for check in kit.check())
    for name in ("tree.json", "motion.json", "bar.3mf"):
        assert (folder / name).read_bytes() == (bar_kit.folder / name).read_bytes()
