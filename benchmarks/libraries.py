"""Where code of our own stands beside a library: seconds of both, and where they differ.

    python benchmarks/libraries.py

Random numbers in a compiled kernel: splitmix64 (`fabfold.tree.rng`) beside NumPy's Generator, which
numba supports. OFF files: our reader beside trimesh's, on a fine sphere, and on wrong files. Prints
two tables.
"""

from __future__ import annotations

import io
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numba import njit
from trimesh.exchange.off import load_off

from fabfold.errors import ModelError
from fabfold.solid.read_text import read_off
from fabfold.tree.rng import generator, random_below, random_float

RUNS = 7
NUMBERS = 1_000_000
CORNERS = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
FACES = "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n"
#: Files that are wrong, and what is wrong.
WRONG = {
    "ends inside the faces": f"OFF\n4 9 0\n{CORNERS}{FACES}",
    "a face of two corners": f"OFF\n4 1 0\n{CORNERS}2 0 1\n",
    "a face shorter than it says": f"OFF\n4 1 0\n{CORNERS}4 0 1 2\n",
    "two vertices on a line": f"OFF\n4 4 6\n0 0 0 1 0 0\n0 1 0 0 0 1\n{FACES}",
    "an index that is not there": f"OFF\n4 1 0\n{CORNERS}3 0 1 7\n",
}


@njit
def own_floats(state, count):
    total = 0.0
    for _ in range(count):
        total += random_float(state)
    return total


@njit
def own_integers(state, count):
    total = 0
    for _ in range(count):
        total += random_below(state, 1000)
    return total


@njit
def library_floats(random, count):
    total = 0.0
    for _ in range(count):
        total += random.random()
    return total


@njit
def library_integers(random, count):
    total = 0
    for _ in range(count):
        total += random.integers(0, 1000)
    return total


def seconds(call: Callable[[], Any]) -> float:
    """Median processor seconds of a call that has run once before."""
    call()
    taken = []
    for _ in range(RUNS):
        start = time.process_time()
        call()
        taken.append(time.process_time() - start)
    return statistics.median(taken)


def answer(read: Callable[[Path], Any], path: Path) -> str:
    """What a reader says of a file: the faces that it takes, or its error."""
    try:
        return f"takes it, {len(read(path))} faces"
    except ModelError as error:
        return f"refuses it: {str(error).split(';')[0].removeprefix(path.name).strip()[:60]}"
    except Exception as error:
        return f"{type(error).__name__}: {str(error).splitlines()[0][:60]}"


def by_trimesh(path: Path) -> Any:
    with path.open("rb") as stream:
        return load_off(stream)["faces"]


def main() -> None:
    state, random = generator(1), np.random.default_rng(1)
    print("| random numbers in a kernel | ours, ns | Generator, ns |\n|---|--:|--:|")
    for name, own, library in (
        ("float", own_floats, library_floats),
        ("integer below 1000", own_integers, library_integers),
    ):
        mine = seconds(lambda own=own: own(state, NUMBERS))
        theirs = seconds(lambda library=library: library(random, NUMBERS))
        print(f"| {name} | {mine / NUMBERS * 1e9:.1f} | {theirs / NUMBERS * 1e9:.1f} |")
    print("\n| OFF file | ours | trimesh |\n|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.off"
        sphere = trimesh.creation.icosphere(6)
        text = io.StringIO()
        text.write(f"OFF\n{len(sphere.vertices)} {len(sphere.faces)} 0\n")
        np.savetxt(text, sphere.vertices, "%.9g")
        np.savetxt(text, np.column_stack([np.full(len(sphere.faces), 3), sphere.faces]), "%d")
        path.write_text(text.getvalue(), encoding="utf-8")
        mine, theirs = seconds(lambda: read_off(path)), seconds(lambda: by_trimesh(path))
        print(f"| a sphere of {len(sphere.faces)} faces | {mine:.2f} s | {theirs:.2f} s |")
        for name, content in WRONG.items():
            path.write_text(content, encoding="utf-8")
            mine_says = answer(lambda file: read_off(file).faces, path)
            print(f"| {name} | {mine_says} | {answer(by_trimesh, path)} |")


if __name__ == "__main__":
    main()
