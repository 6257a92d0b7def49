"""Many seeds over processes: the same answer, whoever runs it and whatever dies."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from judges import Deadly, Deaf, Poisoned, Results, own_question
from tree_cases import solid_problem, strip

from fabfold.errors import NoTreeError, RecipeError, WorkerError
from fabfold.fold.lattice_foldability import LatticeFoldability
from fabfold.search import processes
from fabfold.search.processes import ProcessExecutor
from fabfold.search.run import executor, run_seeds, search
from fabfold.search.seeds import Job, SeedResult
from fabfold.tree.effort import EFFORTS
from fabfold.tree.kinematics_check import check_tree

EFFORT = replace(EFFORTS["quick"], restarts=2, polish_best=20)


@pytest.fixture(scope="module")
def problem():
    return solid_problem(strip(12), "box-2x2x3")


def key(candidates):
    return [(c.seed, c.tree.to_json(1.0, (0, 0, 0)), c.path.tolist()) for c in candidates]


@pytest.fixture(scope="module")
def alone(problem):
    return search(problem, range(4), LatticeFoldability(), EFFORT, workers=1)


@pytest.mark.slow
def test_best_first_from_every_seed(alone):
    totals = [c.energy["total"] for c in alone]
    assert totals == sorted(totals)
    assert {c.seed for c in alone} == {0, 1, 2, 3}


@pytest.mark.slow
def test_the_number_of_workers_changes_nothing(problem, alone):
    together = search(problem, range(4), LatticeFoldability(), EFFORT, workers=2)
    assert key(together) == key(alone)


@pytest.mark.slow
@pytest.mark.parametrize("seconds", [60.0, 0.0])
def test_workers_that_stood_by_take_the_seeds_or_new_ones_do(problem, alone, seconds):
    pool = ProcessExecutor(1)
    pool.stand_by("S", seconds)
    (waiting,) = multiprocessing.active_children()
    first = waiting.pid
    if seconds == 0.0:
        waiting.join(60)
        assert not waiting.is_alive(), "nobody sent a seed in time"
    ran, heard = set(), Results()

    def on_event(event):
        ran.update(process.pid for process in multiprocessing.active_children())
        heard.on_event(event)

    job = Job(problem, LatticeFoldability(), EFFORT)
    with closing(pool):
        run_seeds(pool, ((seed, job) for seed in range(4)), on_event, lambda: False)
    assert (ran == {first}) == (seconds > 0.0)
    found = [c for seed in range(4) for c in heard.done[seed].candidates]
    assert key(sorted(found, key=lambda c: c.energy["total"])) == key(alone)


@pytest.mark.slow
def test_known_seeds_are_not_searched_again(problem, alone):
    kept = Results()
    search(problem, [0, 1], LatticeFoldability(), EFFORT, workers=1, on_event=kept.on_event)
    assert sorted(kept.done) == [0, 1]
    fresh = Results()
    again = search(
        problem,
        range(4),
        LatticeFoldability(),
        EFFORT,
        workers=1,
        known=kept.done,
        on_event=fresh.on_event,
    )
    assert sorted(fresh.done) == [2, 3]
    assert key(again) == key(alone)


@pytest.mark.slow
def test_a_killed_worker_costs_nothing(problem, alone, tmp_path):
    judge = Deadly(tmp_path, deaths=1)
    found = search(problem, range(4), judge, EFFORT, workers=2)
    assert len(list(tmp_path.iterdir())) == 1
    assert key(found) == key(alone)


def _step_back(connection, before):
    processes._begin()
    connection.send(os.getpriority(os.PRIO_PROCESS, 0) - before)


@pytest.mark.skipif(not hasattr(os, "nice"), reason="there are no priorities here")
def test_workers_step_back_for_what_a_person_waits_for():
    ours, theirs = multiprocessing.Pipe()
    before = os.getpriority(os.PRIO_PROCESS, 0)
    process = processes._started(_step_back, theirs, before)
    assert ours.poll(60)
    assert ours.recv() == min(processes._NICE, 19 - before)
    process.join()


def test_workers_that_still_load_kernels_are_ended_and_not_waited_for(monkeypatch):
    ended = []
    monkeypatch.setattr(processes, "_end", ended.append)
    pool = ProcessExecutor(2)
    pool.stand_by("S")
    pool.close()
    (forking,) = [process for process in ended if process is not None]
    forking.join(60)
    assert forking.exitcode == -signal.SIGTERM


@pytest.mark.slow
def test_a_killed_worker_that_stood_by_costs_nothing(problem, alone, tmp_path):
    heard = Results()
    job = Job(problem, Deadly(tmp_path, deaths=1), EFFORT)
    pool = ProcessExecutor(2)
    pool.stand_by("S")
    assert len(multiprocessing.active_children()) == 1, "they are forked from one"
    with closing(pool):
        run_seeds(pool, ((seed, job) for seed in range(4)), heard.on_event, lambda: False)
    assert len(list(tmp_path.iterdir())) == 1
    found = [c for seed in range(4) for c in heard.done[seed].candidates]
    assert key(sorted(found, key=lambda c: c.energy["total"])) == key(alone)
    assert multiprocessing.active_children() == []


@pytest.mark.slow
def test_a_seed_that_always_kills_is_left_out_and_the_others_return(problem, alone):
    heard = Results()
    judge = Poisoned(own_question(problem, 2, (0, 1, 3), EFFORT))
    found = search(problem, range(4), judge, EFFORT, workers=2, on_event=heard.on_event)
    assert key(found) == key([c for c in alone if c.seed != 2])
    assert heard.done[2].failed
    assert heard.done[2].why == "seed 2 took its worker down 3 times"
    assert not any(heard.done[seed].failed for seed in (0, 1, 3))


@pytest.mark.slow
def test_a_seed_that_raises_is_left_out_and_the_others_return(problem, alone):
    for workers in (1, 2):
        heard = Results()
        judge = Poisoned(own_question(problem, 1, (0, 2), EFFORT), exits=False)
        found = search(problem, range(3), judge, EFFORT, workers=workers, on_event=heard.on_event)
        assert key(found) == key([c for c in alone if c.seed in (0, 2)])
        assert heard.done[1].failed
        assert "ZeroDivisionError" in heard.done[1].why


@pytest.mark.slow
def test_where_every_seed_fails_it_is_said_and_not_taken_for_no_fold(problem):
    judge = Poisoned(own_question(problem, 7, (), EFFORT), exits=False)
    with pytest.raises(WorkerError, match="every seed failed"):
        search(problem, [7], judge, EFFORT, workers=1)


@pytest.mark.slow
def test_better_trees_are_told_of_before_the_seed_ends(problem):
    for workers in (1, 2):
        heard = Results()
        search(
            problem, [0, 1], LatticeFoldability(), EFFORT, workers=workers, on_event=heard.on_event
        )
        for seed, result in heard.done.items():
            told = heard.better[seed]
            assert told[-1].energy["total"] == result.best
            assert [c.energy["total"] for c in told] == sorted(
                (c.energy["total"] for c in told), reverse=True
            )
            assert heard.order.index(("Better", seed)) < heard.order.index(("Done", seed))


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_when_time_is_over_seeds_end_early_with_what_they_have(problem, workers):
    heard = Results()
    endless = replace(EFFORT, polish_best=10**9)
    job = Job(problem, LatticeFoldability(), endless)

    def over():
        return len(heard.better) == workers

    with executor(workers, None, workers, over) as pool:
        run_seeds(pool, ((seed, job) for seed in range(100)), heard.on_event, over)
    assert sorted(heard.done) == list(range(workers))
    for result in heard.done.values():
        assert result.cut == 0.0
        assert result.candidates
        assert result.why == "", "it heard, and ended by itself"
        assert check_tree(result.candidates[0].tree) == []


@pytest.mark.slow
def test_a_worker_that_does_not_hear_is_ended_and_its_last_word_counts(problem, monkeypatch):
    monkeypatch.setattr("fabfold.search.run.GRACE", 0.2)
    heard = Results()
    job = Job(problem, Deaf(), EFFORT)

    def over():
        return bool(heard.better)

    with executor(2, None, 1, over) as pool:
        run_seeds(pool, [(0, job)], heard.on_event, over)
    assert heard.done[0].candidates == (heard.better[0][-1],)
    assert heard.done[0].cut == 0.0
    assert not multiprocessing.active_children()


@pytest.mark.slow
def test_workers_end_when_their_parent_is_killed():
    code = (
        "import multiprocessing\n"
        "from test_search import *\n"
        "def on_event(event):\n"
        "    print(*[p.pid for p in multiprocessing.active_children()], flush=True)\n"
        "if __name__ == '__main__':\n"
        "    problem = solid_problem(strip(8), 'box-2x2x2')\n"
        "    job = Job(problem, LatticeFoldability(), replace(EFFORT, polish_best=10**9))\n"
        "    with executor(2, None, 2, lambda: False) as pool:\n"
        "        run_seeds(pool, [(0, job), (1, job)], on_event, lambda: False)\n"
    )
    run = subprocess.Popen(
        [sys.executable, "-c", code],
        cwd=Path(__file__).parent,
        stdout=subprocess.PIPE,
        encoding="utf-8",
    )
    workers = [int(pid) for pid in run.stdout.readline().split()]
    assert len(workers) == 2
    assert all(lives(pid) for pid in workers)
    run.kill()
    run.communicate()
    deadline = time.monotonic() + 120
    while any(lives(pid) for pid in workers) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not any(lives(pid) for pid in workers)


def lives(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_there_must_be_a_worker(problem):
    with pytest.raises(RecipeError, match="--workers 0"):
        search(problem, [0], LatticeFoldability(), EFFORT, workers=0)


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


def test_a_stop_is_heard_once_a_process_has_started():
    from fabfold.search.processes import _stops_held

    heard = []
    before = signal.signal(signal.SIGTERM, lambda *_: heard.append("stop"))
    try:
        mine = signal.getsignal(signal.SIGTERM)
        with _stops_held():
            signal.raise_signal(signal.SIGTERM)
            assert heard == []
        assert heard == ["stop"]
        assert signal.getsignal(signal.SIGTERM) is mine
    finally:
        signal.signal(signal.SIGTERM, before)
