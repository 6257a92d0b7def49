"""Measure every accepted combination of the grid of hinges: writes benchmarks/hinges_grid.md.

    nice python benchmarks/hinges_grid.py

For each pin: combinations measured, halves that are not one valid solid or differ in volume from
their mesh, largest error of the gap at 19 angles, largest overlap, and which rule refused how many.
Both axes of a double hinge are measured, each alone; what two hinges have in common but for where
it lies is measured once. The tests run a sample of it.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "hinges"))

from hinge_grid import Doubles, Singles, double_plan_of, doubles, plan_of, singles
from hinge_measure import gap, mesh_of, overlap, turned

from hinges.exact_solids import build_half
from hinges.exceptions import HingeError
from hinges.plan_double import DoublePlan, Matrix, child_pose, link_pose
from hinges.shapes import Bored, HalfPlan, Moved, Shape

HERE = Path(__file__).resolve().parent
ANGLES = np.linspace(0.0, 1.0, 19)
#: A mesh's facets take this much of a half's volume at most, as a share.
FACETS = 0.01


@dataclass
class Row:
    """What was found of one kind of hinge."""

    measured: int = 0
    unsound: list[str] = field(default_factory=list)
    error: float = 0.0
    overlap: float = 0.0
    refused: Counter[str] = field(default_factory=Counter)

    def add(self, case: Singles | Doubles, sound: bool, found: tuple[float, float]) -> None:
        """Count one hinge."""
        self.measured += 1
        self.error = max(self.error, found[0])
        self.overlap = max(self.overlap, found[1])
        if not sound:
            self.unsound.append(str(case))


def laid(shape: Shape, frame: Matrix) -> Hashable:
    """A shape as it lies in a frame, to the nanometre; equal ones may lie anywhere."""
    if isinstance(shape, Moved):
        own = np.eye(4)
        own[:3, 0], own[:3, 1], own[:3, 2] = shape.x_dir, shape.y_dir, shape.z_dir
        own[:3, 3] = shape.origin
        return laid(shape.shape, frame @ own)
    if isinstance(shape, Bored):
        return laid(shape.shape, frame), tuple(laid(cut, frame) for cut in shape.cuts)
    return shape, tuple((frame[:3] + 0.0).round(6).ravel().tolist())


def half_key(plan: HalfPlan, frame: Matrix) -> Hashable:
    """All shapes of a half as they lie in a frame."""
    groups = (plan.carve, plan.web, plan.add, plan.bore)
    return tuple(tuple(laid(shape, frame) for shape in group) for group in groups)


class Soundness:
    """Whether halves are one valid solid of the volume of their mesh; each kind built once."""

    def __init__(self) -> None:
        self._known: dict[Hashable, bool] = {}

    def __call__(self, plan: HalfPlan, frame: Matrix) -> bool:
        """Whether one half is sound."""
        key = half_key(plan, frame)
        if key not in self._known:
            try:
                volume = build_half(plan, "half").volume
                self._known[key] = abs(volume / mesh_of(plan).volume() - 1.0) < FACETS
            except HingeError:
                self._known[key] = False
        return self._known[key]


def single_rows() -> Iterator[tuple[str, Row]]:
    """Measure the single hinges: a row for each pin."""
    rows: dict[str, Row] = {}
    sound, frame = Soundness(), np.eye(4)
    for case in singles():
        row = rows.setdefault(case[2], Row())
        plan = plan_of(case)
        if isinstance(plan, HingeError):
            row.refused[getattr(plan, "rule", "room")] += 1
            continue
        wanted = plan.spec.clearance.least
        parent, child = mesh_of(plan.parent), mesh_of(plan.child)
        error = worst = 0.0
        for angle in 180.0 * ANGLES:
            pose = turned(child, angle)
            error = max(error, abs(gap(parent, pose, wanted + 0.06) - wanted))
            worst = max(worst, overlap(parent, pose))
        fine = sound(plan.parent, frame) and sound(plan.child, frame)
        row.add(case, fine, (error, worst))
    yield from rows.items()


def axis_found(plan: DoublePlan, axis: int) -> tuple[float, float]:
    """Largest error of the gap and largest overlap as one axis of a double hinge turns."""
    spec, wanted = plan.spec, plan.spec.clearance.least
    parent, link, child = (mesh_of(half) for half in (plan.parent, plan.link, plan.child))
    error = worst = 0.0
    for angle in spec.turns[axis] * ANGLES:
        if axis == 0:
            one, other = parent, link.transform(link_pose(spec, angle)[:3])
        else:
            one, other = link, child.transform(child_pose(spec, 0.0, angle)[:3])
        error = max(error, abs(gap(one, other, wanted + 0.06) - wanted))
        worst = max(worst, overlap(one, other))
    return error, worst


def double_rows() -> Iterator[tuple[str, Row]]:
    """Measure the double hinges: a row for each kind of pair of edges."""
    rows: dict[str, Row] = {}
    sound = Soundness()
    known: dict[Hashable, tuple[float, float]] = {}
    for case in doubles():
        parallel = case[1][1] == case[2][1]
        kind = "same edge" if case[1] == case[2] else "parallel" if parallel else "across"
        row = rows.setdefault(kind, Row())
        plan = double_plan_of(case)
        if isinstance(plan, HingeError):
            row.refused[getattr(plan, "rule", "room")] += 1
            continue
        spec, found, fine = plan.spec, [], True
        for axis, half in ((0, plan.parent), (1, plan.child)):
            frame = np.linalg.inv(spec.frame(axis))
            key = (
                half_key(half, frame), half_key(plan.link, frame), spec.turns[axis], spec.clearance,
            )  # fmt: skip
            if key not in known:
                known[key] = axis_found(plan, axis)
            found.append(known[key])
            fine = fine and sound(half, frame)
        fine = fine and sound(plan.link, np.linalg.inv(spec.frame(0)))
        row.add(case, fine, (max(f[0] for f in found), max(f[1] for f in found)))
    yield from rows.items()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.parse_args()
    start = time.process_time()
    lines = [
        "# Every hinge of the grid",
        "",
        "Written by `python benchmarks/hinges_grid.py`: each combination of size, knuckles, pin,",
        "process and bore, and of edges and turns of double hinges. *Unsound* are those with a",
        "half that is not one valid solid, or differs in volume from its mesh. The gap is measured",
        "at 19 angles on meshes, against the clearance that was asked for.",
        "",
        "| hinge | accepted | unsound | largest error of the gap, mm | overlap, mm³ | refused |",
        "|---|--:|--:|--:|--:|---|",
    ]
    print("\n".join(lines))
    unsound = []
    for rows in (single_rows(), double_rows()):
        for name, row in rows:
            why = ", ".join(f"{rule} {n}" for rule, n in row.refused.most_common()) or "none"
            lines.append(
                f"| {name} | {row.measured} | {len(row.unsound)} | {row.error:.5f} | "
                f"{row.overlap:.1e} | {why} |"
            )
            print(lines[-1], flush=True)
            unsound += [f"- {name}: {case}" for case in row.unsound]
    lines += ["", *(unsound or ["None is unsound."])]
    lines += ["", f"It took {(time.process_time() - start) / 60:.0f} minutes of one processor."]
    print("\n".join(lines[-3:]))
    (HERE / "hinges_grid.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
