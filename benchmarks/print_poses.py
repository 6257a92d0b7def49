"""Poses in which finished kits can be printed in place.

    python benchmarks/print_poses.py KIT [KIT ...]

Prints, for every pose of the path of each kit folder, its size, the box around it, and how much of
the surface has nothing but the gap before it; then the pose that ``--pose auto`` takes.
"""

from __future__ import annotations

import sys

from fabfold.kit.kit import open_kit
from fabfold.printing.print_pose import PrintPose, print_pose


def row(pose: PrintPose) -> str:
    """One row of the table."""
    size = " × ".join(f"{side:.0f}" for side in pose.size_mm)
    narrow, under = pose.narrow_mm2 / 100, pose.under_mm2 / 100
    return f"| {pose.name} | {size} | {pose.box_cm3:.0f} | {narrow:.0f} | {under:.1f} |"


def main() -> None:
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    for folder in sys.argv[1:]:
        kit = open_kit(folder)
        built, profile = kit.join(), kit.print_mode().profile
        tree, motion, joinery = built.planned.tree, built.planned.motion, built.joinery
        print(f"\n{folder}\n")
        print("| printed as | size, mm | box, cm³ | before a gap, cm² | of it over a gap, cm² |")
        print("|---|---|--:|--:|--:|")
        for move in range(len(motion.angles_deg)):
            print(row(print_pose(tree, motion, joinery, profile, str(move))), flush=True)
        print(f"\nauto: {print_pose(tree, motion, joinery, profile, 'auto').name}", flush=True)


if __name__ == "__main__":
    main()
