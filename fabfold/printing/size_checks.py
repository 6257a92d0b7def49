"""Check of sizes: the smallest body, the material, and the printer's build volume."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fabfold.fold.motion import Motion
from fabfold.joinery.bodies import Joinery
from fabfold.printing.checks import Check
from fabfold.printing.print_pose import PrintPose
from fabfold.printing.profiles import Profile
from fabfold.tree.fold_tree import FoldTree

__all__ = ["check_sizes"]

Floats = NDArray[np.float64]


def check_sizes(
    joinery: Joinery,
    tree: FoldTree,
    motion: Motion,
    profile: Profile,
    pose: PrintPose | None = None,
) -> list[Check]:
    """Check the smallest body and the build volume, and report the material.

    Parameters
    ----------
    joinery : Joinery
        The printed bodies.
    tree : FoldTree
        The bodies, their voxels and the box that they fold into.
    motion : Motion
        The folding path; its number of moves is reported.
    profile : Profile
        Limits of the printer and material.
    pose : PrintPose, optional
        How the kit is printed in one piece; without it the model as it came, or each body by
        itself where the profile prints them apart.

    Returns
    -------
    list of Check
        The smallest body, the material and, where the profile names a build volume, whether the
        kit fits into it.
    """
    volumes = [body.volume for body in joinery.bodies]
    least = int(np.argmin(volumes))
    extent = np.ptp(joinery.bodies[least].vertices, axis=0)
    smallest = joinery.bodies[least]
    voxels = len(tree.bodies[least].voxels)
    made_of = "a link plate" if tree.bodies[least].edge is not None else _plural(voxels, "voxel")
    # A cube of three walls: enough to clean, to find and to hold with tweezers.
    limit = (3.0 * profile.min_wall_mm) ** 3
    total = float(sum(volumes))
    box = joinery.voxel_mm * np.asarray(tree.template.shape, dtype=float)
    full = joinery.voxel_mm**3 * len(tree.template)
    checks = [
        Check(
            "smallest body",
            float(volumes[least]),
            limit,
            "mm³",
            bool(volumes[least] >= limit),
            f"{smallest.name}, {_size(extent)}, {made_of}",
        ),
        Check(
            "material",
            total / 1000.0,
            None,
            "cm³",
            True,
            f"{len(volumes)} bodies and {len(tree.hinges)} hinges; folds into {_size(box)} in "
            f"{len(motion.angles_deg) - 1} moves, {100 * total / full:.0f} % of it full",
        ),
    ]
    if profile.bed_mm is not None:
        checks.append(_check_fit(joinery, profile.in_place, np.array(profile.bed_mm), pose))
    return checks


def _check_fit(joinery: Joinery, in_place: bool, bed_mm: Floats, pose: PrintPose | None) -> Check:
    """Whether the closed kit, or each body apart, fits into a build volume (3,)."""
    low = np.min([body.vertices.min(axis=0) for body in joinery.bodies], axis=0)
    high = np.max([body.vertices.max(axis=0) for body in joinery.bodies], axis=0)
    spans: list[tuple[str, Floats]] = [("the closed kit", np.asarray(high - low, dtype=float))]
    if pose is not None:
        spans = [(f"the kit as {pose.name}", pose.size_mm)] if pose.move else spans
    elif not in_place:
        # Printed apart, the largest body decides.
        spans = [(body.name, np.ptp(body.vertices, axis=0)) for body in joinery.bodies]
    bed = np.sort(bed_mm)
    name, span = max(spans, key=lambda item: float((np.sort(item[1]) / bed).max()))
    share = float((np.sort(span) / bed).max())
    note = f"{name}, {_size(span)}, in a build volume of {_size(bed_mm)}"
    if share > 1.0:
        note += f"; --voxel-mm {np.floor(10 * joinery.voxel_mm / share) / 10:g} fits"
    return Check(
        "fits the printer",
        100.0 * share,
        100.0,
        "%",
        share <= 1.0,
        note,
    )


def _plural(count: int, word: str) -> str:
    return f"{count} {word}" + ("" if count == 1 else "s")


def _size(extent: Floats) -> str:
    """Text such as ``20 × 40 × 20 mm`` of a size along x, y and z."""
    return " × ".join(f"{value:.0f}" for value in extent) + " mm"
