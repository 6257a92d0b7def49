"""Measure every accepted combination of the full grid of hinge parameters.

For each pin: combinations measured, halves that are not one valid solid, largest error of the gap
at 19 angles, largest overlap, and which rule refused how many. The tests run a sample of it.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "hinges"))

from hinge_grid import double_plan_of, doubles, plan_of, singles
from hinge_measure import double_bodies, exact, gap, overlap, posed, single_gaps

from hinges.exceptions import HingeError

ANGLES = np.linspace(0.0, 180.0, 19)


def single_table(every: int) -> None:
    """Print one row a pin."""
    rows: dict[str, list[tuple[float, float, bool]]] = {}
    refused: dict[str, Counter[str]] = {}
    for index, case in enumerate(singles()):
        plan = plan_of(case)
        if isinstance(plan, HingeError):
            refused.setdefault(case[2], Counter())[getattr(plan, "rule", "room")] += 1
            continue
        if index % every:
            continue
        found = single_gaps(plan, ANGLES)
        try:
            sound = bool(exact(plan.parent).is_valid and exact(plan.child).is_valid)
        except HingeError:
            sound = False
        error = float(np.abs(found[:, 0] - plan.spec.clearance.least).max())
        rows.setdefault(case[2], []).append((error, float(found[:, 1].max()), sound))
    print(f"{'pin':18}{'measured':>9}{'unsound':>9}{'gap error':>11}{'overlap':>9}  refused")
    for pin, found in rows.items():
        errors, overlaps, sound = zip(*found, strict=True)
        why = ", ".join(f"{rule} {n}" for rule, n in refused.get(pin, Counter()).most_common())
        print(
            f"{pin:18}{len(found):9d}{sound.count(False):9d}{max(errors):11.5f}"
            f"{max(overlaps):9.1e}  {why}",
            flush=True,
        )


def double_table(every: int) -> None:
    """Print one row a kind of edge pair."""
    rows: dict[str, list[tuple[float, float, bool]]] = {}
    refused: Counter[str] = Counter()
    for index, case in enumerate(doubles()):
        plan = double_plan_of(case)
        if isinstance(plan, HingeError):
            refused[getattr(plan, "rule", "room")] += 1
            continue
        if index % every:
            continue
        kind = (
            "same" if case[1] == case[2] else "parallel" if case[1][1] == case[2][1] else "across"
        )
        wanted = plan.spec.clearance.least
        parent, link, child = double_bodies(plan, boxes=False)
        error = worst = 0.0
        for turn in ANGLES / 180.0:
            first, second = (turn * full for full in plan.spec.turns)
            turned, _ = posed(plan, link, child, first, 0.0)
            _, other = posed(plan, link, child, 0.0, second)
            for one, two in ((parent, turned), (link, other)):
                error = max(error, abs(gap(one, two, wanted + 0.06) - wanted))
                worst = max(worst, overlap(one, two))
        try:
            sound = all(exact(half).is_valid for half in (plan.parent, plan.link, plan.child))
        except HingeError:
            sound = False
        rows.setdefault(kind, []).append((error, worst, sound))
    print(f"\n{'edges':18}{'measured':>9}{'unsound':>9}{'gap error':>11}{'overlap':>9}")
    for kind, found in rows.items():
        errors, overlaps, sounds = zip(*found, strict=True)
        print(
            f"{kind:18}{len(found):9d}{sounds.count(False):9d}{max(errors):11.5f}"
            f"{max(overlaps):9.1e}"
        )
    print("refused:", ", ".join(f"{rule} {n}" for rule, n in refused.most_common()) or "none")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--every", type=int, default=1, help="measure every n-th combination")
    every = parser.parse_args().every
    start = time.perf_counter()
    single_table(every)
    double_table(every)
    print(f"{time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main()
