"""Judges of folding that misbehave, and what hears of a search; workers import this by name."""

import hashlib
import os
import signal
import time
from pathlib import Path

import numpy as np

from fabfold.fold.lattice_foldability import LatticeFoldability
from fabfold.search.seeds import Done, Job, run_seed


class Results:
    """Hears of a search."""

    def __init__(self):
        self.done, self.better, self.order = {}, {}, []

    def on_event(self, event):
        self.order.append((type(event).__name__, event.seed))
        if isinstance(event, Done):
            self.done[event.seed] = event.result
        else:
            self.better.setdefault(event.seed, []).append(event.candidate)


def mark_of(system):
    parts = (np.asarray(part).tobytes() for part in system if part is not None)
    return hashlib.sha256(b"".join(parts)).hexdigest()


class Recording(LatticeFoldability):
    """Notes what it is asked."""

    def path(self, system, guide=None):
        self.__dict__.setdefault("asked", []).append(mark_of(system))
        return super().path(system, guide)


def own_question(problem, seed, others, effort):
    """What tells a seed's run from others: the first system whose path it alone wants."""

    def questions(asking):
        judge = Recording()
        run_seed(Job(problem, judge, effort), asking, lambda _candidate: None, lambda: False)
        return judge.asked

    common = {mark for other in others for mark in questions(other)}
    return next(mark for mark in questions(seed) if mark not in common)


class Poisoned(LatticeFoldability):
    """Ends the process, or raises, when it is asked for one system."""

    def __init__(self, mark, exits=True):
        super().__init__()
        self.__dict__.update(mark=mark, exits=exits)

    def path(self, system, guide=None):
        if mark_of(system) == self.mark:
            if self.exits:
                os._exit(3)
            raise ZeroDivisionError("poisoned")
        return super().path(system, guide)


class Deadly(LatticeFoldability):
    """Kills its process, `deaths` times in all (counted in a folder)."""

    def __init__(self, folder, deaths):
        super().__init__()
        self.__dict__.update(folder=str(folder), deaths=deaths)

    def path(self, system, guide=None):
        for number in range(self.deaths):
            # Two workers may ask at once; each death is for one of them.
            try:
                (Path(self.folder) / str(number)).touch(exist_ok=False)
            except FileExistsError:
                continue
            os.kill(os.getpid(), signal.SIGKILL)
        return super().path(system, guide)


class Deaf(LatticeFoldability):
    """Answers one question for a path, then never comes back."""

    def path(self, system, guide=None):
        if "answered" in self.__dict__:
            time.sleep(3600)
        self.__dict__["answered"] = True
        return super().path(system, guide)


class Announcing(LatticeFoldability):
    """Leaves its process id in a folder and waits until a file `go` is there."""

    def __init__(self, folder):
        super().__init__()
        self.__dict__.update(folder=str(folder))

    def path(self, system, guide=None):
        folder = Path(self.folder)
        (folder / str(os.getpid())).touch()
        while not (folder / "go").exists():
            time.sleep(0.05)
        return super().path(system, guide)
