"""The search on a real Dask scheduler with two workers: same answer, whatever dies."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
from judges import Announcing, Poisoned, Results, own_question
from tree_cases import solid_problem, strip

from fabfold.errors import RecipeError, WorkerError
from fabfold.fold.lattice_foldability import LatticeFoldability
from fabfold.search.run import executor, run_seeds, search
from fabfold.search.seeds import Job
from fabfold.tree.effort import EFFORTS

EFFORT = replace(EFFORTS["quick"], restarts=2, polish_best=20)
#: Bounds hangs only.
LONG = 180.0
HERE = Path(__file__).resolve().parent


def start(module, *arguments, without_fabfold=False):
    """A command of Dask in a process of its own, in a folder that is none of ours.

    It ends with the tests: its standard input closes when nobody is left who holds the other end.
    """
    block = "sys.modules['fabfold'] = None; " if without_fabfold else ""
    code = (
        "import os, sys, threading; "
        "end = lambda: (sys.stdin.read(), os._exit(1)); "
        "threading.Thread(target=end, daemon=True).start(); "
        f"{block}from distributed.cli.{module} import main; main()"
    )
    environment = dict(os.environ, PYTHONPATH=f"{HERE.parent}{os.pathsep}{HERE}")
    return subprocess.Popen(
        [sys.executable, "-W", "ignore", "-c", code, *map(str, arguments)],
        cwd="/",
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def end(processes):
    for process in processes:
        process.terminate()
    for process in processes:
        try:
            process.wait(5)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


class Dask:
    """A scheduler on this machine, which does not know fabfold, and its workers."""

    def __init__(self, folder):
        self.folder = folder
        self.processes = []
        about = folder / "scheduler.json"
        self.scheduler = start(
            "dask_scheduler", "--host", "127.0.0.1", "--port", 0, "--no-dashboard",
            "--scheduler-file", about, without_fabfold=True,
        )  # fmt: skip
        deadline = time.monotonic() + LONG
        while not about.exists() or not about.read_text():
            assert self.scheduler.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.05)
        self.address = json.loads(about.read_text())["address"]

    def worker(self, *, nanny=False, **options):
        """A worker of its own, or one that is started again whenever it dies."""
        process = start(
            "dask_worker", self.address, "--host", "127.0.0.1", "--nthreads", 1,
            "--no-dashboard", "--nanny" if nanny else "--no-nanny",
            "--local-directory", self.folder, "--death-timeout", 120, **options,
        )  # fmt: skip
        self.processes.append(process)
        return process

    def close(self):
        end([*self.processes, self.scheduler])


@pytest.fixture(autouse=True)
def _patient(monkeypatch):
    monkeypatch.setattr("fabfold.search.dask.FIRST", LONG)
    monkeypatch.setattr("fabfold.search.dask.PATIENCE", LONG)


@pytest.fixture(scope="module")
def dask(tmp_path_factory):
    """A scheduler with two workers that are started again when they die."""
    made = Dask(tmp_path_factory.mktemp("dask"))
    try:
        made.worker(nanny=True)
        made.worker(nanny=True)
        yield made
    finally:
        made.close()


@pytest.fixture(scope="module")
def problem():
    return solid_problem(strip(12), "box-2x2x3")


@pytest.fixture(scope="module")
def alone(problem):
    return search(problem, range(4), LatticeFoldability(), EFFORT, workers=1)


def key(candidates):
    return [(c.seed, c.tree.to_json(1.0, (0, 0, 0)), c.path.tolist()) for c in candidates]


@pytest.mark.slow
def test_the_answer_is_that_of_this_machine(problem, alone, dask):
    heard = Results()
    found = search(
        problem,
        range(4),
        LatticeFoldability(),
        EFFORT,
        scheduler=dask.address,
        on_event=heard.on_event,
    )
    assert key(found) == key(alone)
    for seed, result in heard.done.items():
        assert heard.better[seed][-1].energy["total"] == result.best


@pytest.mark.slow
def test_a_seed_that_always_kills_is_left_out_and_the_others_return(problem, alone, dask):
    heard = Results()
    judge = Poisoned(own_question(problem, 1, (0, 2, 3), EFFORT))
    found = search(
        problem, range(4), judge, EFFORT, scheduler=dask.address, on_event=heard.on_event
    )
    assert key(found) == key([c for c in alone if c.seed != 1])
    assert heard.done[1].why == "seed 1 took its worker down 3 times"


@pytest.mark.slow
def test_when_time_is_over_seeds_end_early_with_what_they_have(problem, dask):
    heard = Results()
    job = Job(problem, LatticeFoldability(), replace(EFFORT, polish_best=10**9))

    def over():
        return len(heard.better) == 2

    with executor(None, dask.address, 2, over) as pool:
        run_seeds(pool, ((seed, job) for seed in range(100)), heard.on_event, over)
    assert sorted(heard.done) == [0, 1]
    for result in heard.done.values():
        assert result.cut == 0.0
        assert result.candidates
        assert result.why == "", "it heard, and ended by itself"


@pytest.mark.slow
def test_an_interrupted_search_leaves_the_workers_free(problem, alone, dask):
    def interrupt(_event):
        raise KeyboardInterrupt

    endless = replace(EFFORT, polish_best=10**9)
    with pytest.raises(KeyboardInterrupt):
        search(
            problem,
            [0, 1],
            LatticeFoldability(),
            endless,
            scheduler=dask.address,
            on_event=interrupt,
        )
    found = search(problem, range(4), LatticeFoldability(), EFFORT, scheduler=dask.address)
    assert key(found) == key(alone)


@pytest.mark.slow
def test_a_worker_killed_half_way_costs_its_seed_alone(problem, alone, tmp_path):
    made = Dask(tmp_path)
    try:
        workers = [made.worker(), made.worker()]
        waiting = tmp_path / "waiting"
        waiting.mkdir()
        deadline = time.monotonic() + LONG
        job = Job(problem, Announcing(waiting), EFFORT)
        heard = Results()

        def two_run_then_one_dies():
            if (waiting / "go").exists():
                return False
            assert time.monotonic() < deadline
            if len(list(waiting.iterdir())) == 2:
                assert sorted(p.name for p in waiting.iterdir()) == sorted(
                    str(worker.pid) for worker in workers
                )
                os.kill(workers[0].pid, signal.SIGKILL)
                workers[0].wait()
                (waiting / "go").touch()
            return False

        with executor(None, made.address, 4, lambda: False) as pool:
            while pool.free() < 2:
                assert time.monotonic() < deadline
                time.sleep(0.05)
            run_seeds(
                pool, ((seed, job) for seed in range(4)), heard.on_event, two_run_then_one_dies
            )
        assert not any(result.failed for result in heard.done.values())
        found = [c for seed in range(4) for c in heard.done[seed].candidates]
        assert key(sorted(found, key=lambda c: c.energy["total"])) == key(alone)
    finally:
        made.close()


@pytest.mark.slow
def test_without_workers_or_with_foreign_ones_it_is_said(problem, tmp_path, monkeypatch):
    made = Dask(tmp_path)

    def run():
        search(problem, [0], LatticeFoldability(), EFFORT, scheduler=made.address)

    try:
        monkeypatch.setattr("fabfold.search.dask.FIRST", 1.0)
        with pytest.raises(RecipeError, match=r"no workers; start some with 'dask worker"):
            run()
        monkeypatch.setattr("fabfold.search.dask.FIRST", LONG)
        foreign = made.worker(without_fabfold=True)
        with pytest.raises(RecipeError, match="cannot import fabfold"):
            run()
        end([foreign])
        made.worker()
        with monkeypatch.context() as patch:
            patch.setattr("fabfold.search.dask.__version__", "99.0")
            with pytest.raises(RecipeError, match=r"has fabfold \d.*install fabfold 99\.0"):
                run()
        end([made.scheduler])
        monkeypatch.setattr("fabfold.search.dask.CONNECT", 2.0)
        with pytest.raises(RecipeError, match="no Dask scheduler answers"):
            run()
    finally:
        made.close()


@pytest.mark.slow
def test_a_scheduler_that_goes_away_is_told(problem, tmp_path, monkeypatch):
    monkeypatch.setattr("fabfold.search.dask.CONNECT", 5.0)
    made = Dask(tmp_path)
    try:
        made.worker()

        def kill(_event):
            made.scheduler.kill()

        endless = replace(EFFORT, polish_best=10**9)
        with pytest.raises(WorkerError, match="goes on from there"):
            search(
                problem, [0], LatticeFoldability(), endless, scheduler=made.address, on_event=kill
            )
    finally:
        made.close()


@pytest.mark.parametrize(
    "address", ["", "localhost", "http://localhost:8786", "tcp://localhost", "tcp://a b:1"]
)
def test_an_address_that_is_none_is_refused(problem, address):
    with pytest.raises(RecipeError, match="tcp://host:8786"):
        search(problem, [0], LatticeFoldability(), EFFORT, scheduler=address)


@pytest.mark.slow
def test_a_port_where_nobody_answers_is_refused(problem, monkeypatch):
    monkeypatch.setattr("fabfold.search.dask.CONNECT", 1.0)
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{taken.getsockname()[1]}"
        with pytest.raises(RecipeError, match="no Dask scheduler answers"):
            search(problem, [0], LatticeFoldability(), EFFORT, scheduler=address)


@pytest.mark.slow
def test_without_the_extra_it_is_said_what_to_install(problem, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(RecipeError, match=r"fabfold\[cluster\]"):
        search(problem, [0], LatticeFoldability(), EFFORT, scheduler="tcp://127.0.0.1:1")
