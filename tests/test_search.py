"""Many seeds over processes: the same answer, whoever runs it and whatever dies."""

import os
import signal
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tree_cases import solid_problem, strip

from fabfold.errors import NoTreeError
from fabfold.fold.foldability import LatticeFoldability
from fabfold.search import SeedResult, search
from fabfold.tree.effort import EFFORTS

EFFORT = replace(EFFORTS["quick"], restarts=2, polishing=20)


class Deadly(LatticeFoldability):
    """A judge that kills its process, `deaths` times in all (counted in a folder)."""

    def __init__(self, folder, deaths):
        super().__init__()
        self.folder, self.deaths = str(folder), deaths

    def path(self, system):
        dead = Path(self.folder)
        if len(list(dead.iterdir())) < self.deaths:
            (dead / str(os.getpid())).touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return super().path(system)


@pytest.fixture(scope="module")
def problem():
    return solid_problem(strip(8), "box-2x2x2")


def key(candidates):
    return [(c.seed, c.tree.to_json(1.0, (0, 0, 0)), c.path.tolist()) for c in candidates]


@pytest.fixture(scope="module")
def alone(problem):
    return search(problem, range(4), LatticeFoldability(), EFFORT, workers=1)


def test_best_first_from_every_seed(alone):
    totals = [c.energy["total"] for c in alone]
    assert totals == sorted(totals)
    assert {c.seed for c in alone} == {0, 1, 2, 3}


def test_the_number_of_workers_changes_nothing(problem, alone):
    together = search(problem, range(4), LatticeFoldability(), EFFORT, workers=2)
    assert key(together) == key(alone)


def test_known_seeds_are_not_searched_again(problem, alone):
    kept = {}
    search(problem, [0, 1], LatticeFoldability(), EFFORT, workers=1, on_result=kept.__setitem__)
    assert sorted(kept) == [0, 1]
    fresh = {}
    again = search(
        problem,
        range(4),
        LatticeFoldability(),
        EFFORT,
        workers=1,
        known=kept,
        on_result=fresh.__setitem__,
    )
    assert sorted(fresh) == [2, 3]
    assert key(again) == key(alone)


def test_a_killed_worker_costs_nothing(problem, alone, tmp_path):
    judge = Deadly(tmp_path, deaths=1)
    found = search(problem, range(4), judge, EFFORT, workers=2)
    assert len(list(tmp_path.iterdir())) == 1
    assert key(found) == key(alone)


def test_a_seed_that_always_kills_is_left_out(problem, tmp_path):
    results = {}
    judge = Deadly(tmp_path, deaths=10**6)
    found = search(problem, [0, 1], judge, EFFORT, workers=2, on_result=results.__setitem__)
    assert found == []
    assert all("took its process down" in result.why for result in results.values())


def test_progress_tells_the_best_so_far(problem):
    heard = []

    class Listen:
        def update(self, share, message=""):
            heard.append((share, message))

    search(problem, [0, 1], LatticeFoldability(), EFFORT, workers=1, progress=Listen())
    assert heard[0] == (0.0, "0 of 2 seeds")
    assert heard[-1][0] == 1.0
    assert "best folding tree" in heard[-1][1]


def test_no_tree_at_all_is_said():
    # A plus sign of five cells has colours 1 and 4; the bar has room for 3 and 2.
    plus = [(1, 1, 0), (0, 1, 0), (2, 1, 0), (1, 0, 0), (1, 2, 0)]
    with pytest.raises(NoTreeError):
        search(solid_problem(plus, "box-1x1x5"), [0], LatticeFoldability(), EFFORT, workers=1)


def test_seeds_that_fit_but_do_not_fold_give_nothing(problem):
    result = SeedResult((), fits=True, why="none folds")
    known = {0: result, 1: replace(result, fits=False)}
    assert search(problem, [0, 1], LatticeFoldability(), EFFORT, known=known) == []
    np.testing.assert_equal(known[0], result)
