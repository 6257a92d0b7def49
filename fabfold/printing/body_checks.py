"""All checks of the printed bodies against the limits of a printer and material.

What each figure can and cannot say is in ``docs/check.md``.
"""

from __future__ import annotations

from fabfold.errors import GeometryError
from fabfold.fold.motion import Motion
from fabfold.joinery.bodies import Joinery
from fabfold.joinery.cells import solids_of
from fabfold.printing.checks import Check
from fabfold.printing.escape_checks import check_escape
from fabfold.printing.gap_checks import check_gaps
from fabfold.printing.overhang_checks import check_overhang
from fabfold.printing.print_pose import PrintPose, posed_kit
from fabfold.printing.profiles import Profile
from fabfold.printing.size_checks import check_sizes
from fabfold.printing.topology_checks import check_topology
from fabfold.printing.wall_checks import check_walls
from fabfold.progress import Progress, SilentProgress
from fabfold.tree.fold_tree import FoldTree

__all__ = ["check_bodies"]


def check_bodies(
    joinery: Joinery,
    tree: FoldTree,
    motion: Motion,
    profile: Profile,
    progress: Progress | None = None,
    pose: PrintPose | None = None,
) -> list[Check]:
    """Check all bodies of a kit for printing.

    Parameters
    ----------
    joinery : Joinery
        The printed bodies in shape A.
    tree : FoldTree
        The bodies and hinges; it names the hinged pairs.
    motion : Motion
        The folding path; its number of moves is reported.
    profile : Profile
        Limits of the printer and material.
    progress : Progress, optional
        Is told how far the checks are.
    pose : PrintPose, optional
        How the kit is printed in one piece, see :func:`fabfold.printing.size_checks.check_sizes`.

    Returns
    -------
    list of Check
        Each with its figure, limit and verdict, in the order of the report.
    """
    progress = progress or SilentProgress()
    progress.update(0.0, "reading the bodies")
    checks = check_topology(joinery.bodies, progress)
    try:
        solids = solids_of(joinery.bodies)
    except GeometryError as error:
        # Nothing below can be measured on a mesh that is no solid.
        return [*checks, Check("bodies are solids", 1.0, 0.0, "bodies", False, str(error))]
    progress.update(0.4, "gaps between bodies")
    hinged = {(hinge.parent, hinge.child): hinge.name for hinge in tree.hinges}
    reach = 2.0 * joinery.clearance_mm
    checks += check_gaps(joinery.bodies, solids, profile, reach, hinged)
    progress.update(0.6, "walls")
    checks += check_walls(joinery, solids, profile)
    progress.update(0.8, "ways out")
    placed = None if pose is None else posed_kit(joinery, pose).bodies
    checks += check_escape(joinery.bodies, profile, placed)
    progress.update(0.9, "sizes and overhangs")
    checks += check_sizes(joinery, tree, motion, profile, pose)
    checks.append(check_overhang(joinery, profile))
    progress.update(1.0, f"{len(checks)} checks")
    return checks
