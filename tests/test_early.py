"""The first kit that folds, written while the search goes on."""

import json
from dataclasses import replace

import pytest
import trimesh
from stage_listener import StageListener

from fabfold.errors import NoFoldError
from fabfold.kit.early import EarlyKit
from fabfold.progress import SilentListener


class Listener(StageListener):
    """Keeps the last message of each stage."""

    def __init__(self):
        self.told = {}

    def update(self, share, message=""):
        self.told[self.name] = message


@pytest.fixture
def found(bar_kit):
    return next(bar_kit._rounds().found())[0]


@pytest.mark.slow
def test_a_first_kit_has_bodies_and_the_proof(bar_kit, found, tmp_path):
    listener = Listener()
    with EarlyKit(tmp_path, bar_kit.recipe, bar_kit.print_mode(), listener) as early:
        early.start(found)
        early.start(found)
        early.wait()
    _, candidate = found
    tree = json.loads((tmp_path / "tree.json").read_text("utf-8"))
    motion = json.loads((tmp_path / "motion.json").read_text("utf-8"))
    assert len(tree["hinges"]) == len(candidate.tree.hinges)
    assert motion["certificate"]["min_gap_mm"] >= bar_kit.print_mode().profile.min_gap_mm
    bodies = sorted((tmp_path / "bodies").glob("*.stl"))
    assert len(bodies) == len(candidate.tree.bodies)
    assert all(trimesh.load(path).is_watertight for path in bodies)
    assert (tmp_path / f"{bar_kit.recipe.name}.3mf").stat().st_size > 1000
    assert f"{len(candidate.tree.hinges)} hinges" in listener.told["early"]


def test_a_kit_that_is_there_is_left_alone(bar_kit, found, tmp_path):
    (tmp_path / "report.json").write_text("{}", "utf-8")
    with EarlyKit(tmp_path, bar_kit.recipe, bar_kit.print_mode(), SilentListener()) as early:
        early.start(found)
    assert [path.name for path in tmp_path.iterdir()] == ["report.json"]


@pytest.mark.slow
def test_a_tree_whose_bodies_do_not_come_out_says_why_and_leaves_nothing(bar_kit, found, tmp_path):
    listener = Listener()
    mode = bar_kit.print_mode()
    huge = replace(mode, profile=mode.profile.model_copy(update={"clearance_mm": 4.9}))
    with EarlyKit(tmp_path, bar_kit.recipe, huge, listener) as early:
        early.start(found)
        early.wait()
    assert "Error" in listener.told["early"]
    assert list(tmp_path.iterdir()) == []


def test_its_process_waits_for_a_tree_and_ends_where_none_comes(bar_kit, tmp_path):
    early = EarlyKit(tmp_path, bar_kit.recipe, bar_kit.print_mode(), SilentListener())
    with pytest.raises(NoFoldError), early:
        process = early._process
        assert process.poll() is None
        raise NoFoldError("nothing folds")
    assert process.poll() is not None
    assert list(tmp_path.iterdir()) == []


def test_it_is_given_up_once_the_search_is_over(bar_kit, found, tmp_path):
    listener = Listener()
    with EarlyKit(tmp_path, bar_kit.recipe, bar_kit.print_mode(), listener) as early:
        early.start(found)
    assert listener.told["early"] == "given up: the search is over"
    assert not list(tmp_path.rglob(".part-*"))


@pytest.mark.slow
def test_it_is_finished_where_the_search_was_stopped(bar_kit, found, tmp_path):
    with (
        pytest.raises(KeyboardInterrupt),
        EarlyKit(tmp_path, bar_kit.recipe, bar_kit.print_mode(), SilentListener()) as early,
    ):
        early.start(found)
        raise KeyboardInterrupt
    assert (tmp_path / f"{bar_kit.recipe.name}.3mf").is_file()
