"""Everything that is checked before a kit is written: bodies, certificate, samples and replay."""

from __future__ import annotations

import numpy as np

from fabfold.joinery.lattice_skin import blocks_of
from fabfold.joinery.loose_pins import meshes_with_pins
from fabfold.kit.retention_report import retention_checks
from fabfold.kit.stages import BuiltTree
from fabfold.printing.body_checks import check_bodies
from fabfold.printing.checks import Check
from fabfold.printing.print_mode import PrintMode
from fabfold.printing.print_pose import PrintPose, print_pose
from fabfold.printing.profiles import Profile
from fabfold.progress import Progress
from fabfold.proof.box_play import box_play
from fabfold.proof.replay import replay
from fabfold.proof.sampled import sample_path
from fabfold.tree.kinematics_check import check_tree

__all__ = ["run_checks"]

#: Largest error of a hinge's angle at a keyframe of the replay, degrees.
ANGLE_LIMIT_DEG = 1.0
#: Degrees between poses that are searched for collisions, and at which the gap is measured.
STEP_DEG = 2.0
GAP_STEP_DEG = 30.0
#: Most of the kit's volume that may be carved away so that cells pass each other, per cent.
CARVED_LIMIT = 5.0
#: Most surface over a gap that filament may fuse: so little breaks free by hand, mm².
FUSED_LIMIT_MM2 = 20.0
#: Volume that bodies may share in A or B before it is more than rounding, mm³.
_OVERLAP_MM3 = 1e-3


def run_checks(built: BuiltTree, mode: PrintMode, progress: Progress) -> list[Check]:
    """Check the tree, the certificate, the printed bodies, samples of the path and the replay.

    Parameters
    ----------
    built : BuiltTree
        The tree with its certificate, and its printed bodies.
    mode : PrintMode
        How it is printed, with the limits of printer and material.
    progress : Progress
        Hears what is being checked.

    Returns
    -------
    list of Check
        Each with its figure, limit, unit and verdict.
    """
    tree, motion, joinery = built.planned.tree, built.planned.motion, built.joinery
    profile = mode.profile
    faults = check_tree(tree)
    certificate = motion.certificate
    checks = [
        Check(
            name="tree folds the model into the template",
            figure=float(len(faults)),
            limit=0.0,
            unit="faults",
            ok=not faults,
            note="; ".join(faults) or "forward kinematics puts every voxel into its cell",
        ),
        Check(
            name="smallest gap on the folding path",
            figure=float(certificate["min_gap_mm"]),
            limit=profile.min_gap_mm,
            unit="mm",
            ok=certificate["min_gap_mm"] >= profile.min_gap_mm,
            note=str(certificate["geometry"]),
        ),
        Check(
            name="end of the path is the box",
            figure=float(certificate["end_pose_error"]),
            limit=1e-6,
            unit="voxels",
            ok=certificate["end_pose_error"] <= 1e-6,
            note="largest distance of a voxel from its cell after the last move",
        ),
    ]
    if joinery.rounded_cells:
        checks.append(_rounded(built))
    pose = None
    if built.apart is None:
        pose = print_pose(tree, motion, joinery, profile, mode.pose)
        checks.append(_lies(mode, pose))
    else:
        from fabfold.apart.apart_checks import check_apart

        checks += check_apart(joinery, built.apart)
    if built.retention is not None:
        checks += retention_checks(built, built.retention)
    checks += _play(built, mode)
    progress.update(0.1, "printability")
    checks += check_bodies(joinery, tree, motion, profile, progress, pose)
    progress.update(0.5, "every second degree of the path")
    checks += _sampled(built, profile)
    progress.update(0.8, "replay in MuJoCo")
    meshes = [(body.vertices, body.faces) for body in joinery.bodies]
    report = replay(
        tree,
        motion,
        meshes,
        voxel_mm=joinery.voxel_mm,
        origin_mm=joinery.origin_mm,
        seconds_per_quarter=2.0,
    )
    checks += [
        Check(
            name="replay: deepest penetration",
            figure=report.max_penetration_mm,
            limit=joinery.clearance_mm,
            unit="mm",
            ok=report.max_penetration_mm <= joinery.clearance_mm,
            note="bodies pushed by motors through the whole path in MuJoCo",
        ),
        Check(
            name="replay: largest angle error",
            figure=report.max_angle_error_deg,
            limit=ANGLE_LIMIT_DEG,
            unit="deg",
            ok=bool(np.isfinite(report.max_angle_error_deg))
            and report.max_angle_error_deg <= ANGLE_LIMIT_DEG,
            note="at the end of any move",
        ),
    ]
    return checks


def _lies(mode: PrintMode, pose: PrintPose) -> Check:
    """Whether the printer can make the kit as one object in its pose."""
    able = mode.profile.in_place
    if able:
        return Check("prints as it lies", 1.0, 1.0, "", True, f"{mode.why}; {pose.figures}")
    return Check(
        name="prints as it lies",
        figure=pose.under_mm2,
        limit=FUSED_LIMIT_MM2,
        unit="mm²",
        ok=pose.under_mm2 <= FUSED_LIMIT_MM2,
        note=f"{mode.profile.name} fuses gaps under faces, and so many mm² hang over nothing but "
        f"the gap; {pose.figures}. Print it body by body with --print apart, look for another pose "
        "with --pose auto, or take a powder profile such as mjf-pa12",
    )


def _play(built: BuiltTree, mode: PrintMode) -> list[Check]:
    """How far the outer faces of the box wander by the play of all hinges; for information."""
    planned = built.planned
    voxels = blocks_of(planned.voxels) if mode.blocks else planned.voxels
    play = box_play(
        planned.tree,
        built.joinery,
        voxels.subvoxels,
        planned.motion.angles_deg[-1],
        mode.loose_pin(),
    )
    exact = f"; drawn at random, exact to {play.press_mm:g} mm" if play.press_mm else ""
    return [
        Check(
            name="play of the box pressed together",
            figure=play.held_wander_mm,
            limit=None,
            unit="mm",
            ok=True,
            note="the furthest that a corner of an outer face leaves its plane in 19 of 20 boxes; "
            f"seams open to {play.held_seam_mm:g} mm{exact}",
        ),
        Check(
            name="play of the box let go",
            figure=play.wander_mm,
            limit=None,
            unit="mm",
            ok=True,
            note=f"the same when nothing holds it shut; seams open to {play.seam_mm:g} mm",
        ),
    ]


def _rounded(built: BuiltTree) -> Check:
    """How much was carved so that cells pass each other."""
    joinery = built.joinery
    lost = joinery.rounded_skin_mm3 + joinery.rounded_inside_mm3
    share = 100.0 * lost / (lost + sum(body.volume for body in joinery.bodies))
    return Check(
        name="corners rounded off so that cells pass",
        figure=round(share, 2),
        limit=CARVED_LIMIT,
        unit="% of the volume",
        ok=share <= CARVED_LIMIT,
        note=f"{joinery.rounded_cells} cells, {joinery.rounded_skin_mm3:.0f} mm³ at the model's "
        f"surface, {joinery.rounded_inside_mm3:.0f} mm³ inside",
    )


def _sampled(built: BuiltTree, profile: Profile) -> list[Check]:
    """The second opinion on the path, by another library."""
    tree, motion, joinery = built.planned.tree, built.planned.motion, built.joinery
    meshes = meshes_with_pins(joinery, tight=False)
    seen = sample_path(
        tree.to_json(joinery.voxel_mm, joinery.origin_mm),
        motion.to_json(),
        {body.name: mesh for body, mesh in zip(joinery.bodies, meshes, strict=True)},
        step_deg=STEP_DEG,
        gap_step_deg=GAP_STEP_DEG,
    )
    clean = not seen.hits and seen.overlap_mm3 <= _OVERLAP_MM3
    return [
        Check(
            name=f"moves with a collision, a look every {STEP_DEG:g}°",
            figure=float(len(seen.hits)),
            limit=0.0,
            unit="moves",
            ok=clean,
            note=(
                "; ".join(seen.hits[:3])
                or (
                    f"{seen.poses} poses, looked at by another library than the proof's (FCL)"
                    if clean
                    else f"bodies share {seen.overlap_mm3:.3f} mm³ in shape A or in the box"
                )
            ),
        ),
        Check(
            name=f"smallest gap seen on the folding path, every {GAP_STEP_DEG:g}°",
            figure=round(seen.least_mm, 4),
            limit=profile.min_gap_mm,
            unit="mm",
            ok=seen.least_mm >= profile.min_gap_mm,
            note=seen.where,
        ),
    ]
