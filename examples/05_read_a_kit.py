"""What is in a kit, read without fabfold.

    python examples/05_read_a_kit.py [KIT]

``tree.json`` tells which voxels are one body and where the hinges are, ``motion.json`` how far each
hinge is turned after each move. The rest is forward kinematics: the pose of a body is that of its
parent, times the turn of the hinge between them. We fold the kit of example 01 in this way, and
look whether each voxel ends in its cell.
"""

import json
import sys
from pathlib import Path

import numpy as np


def rotation(point: np.ndarray, axis: np.ndarray, degrees: float) -> np.ndarray:
    """Turn about a line as a 4 x 4 matrix (Rodrigues' formula)."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    pose = np.eye(4)
    pose[:3, :3] += np.sin(np.radians(degrees)) * cross
    pose[:3, :3] += (1 - np.cos(np.radians(degrees))) * cross @ cross
    pose[:3, 3] = point - pose[:3, :3] @ point  # points of the line stay where they are
    return pose


def voxels_at(tree: dict, angles: dict[str, float]) -> np.ndarray:
    """Centre of every voxel when the hinges stand at these angles, in lattice units."""
    root = np.eye(4)  # the root body stands still, where it belongs in the template
    root[:3, :3] = np.reshape(tree["root_pose"]["rotation"], (3, 3))
    root[:3, 3] = tree["root_pose"]["translation"]
    poses = {tree["bodies"][0]["name"]: root}
    for hinge in tree["hinges"]:  # a parent always comes before its children
        turn = rotation(np.array(hinge["point"]), np.array(hinge["dir"]), angles[hinge["name"]])
        poses[hinge["child"]] = poses[hinge["parent"]] @ turn

    centres = np.array(tree["source"], dtype=float)
    for body in tree["bodies"]:
        pose, voxels = poses[body["name"]], body["voxels"]
        centres[voxels] = centres[voxels] @ pose[:3, :3].T + pose[:3, 3]
    return centres


def main(kit: str = "car-kit") -> None:
    tree = json.loads(Path(kit, "tree.json").read_text(encoding="utf-8"))
    motion = json.loads(Path(kit, "motion.json").read_text(encoding="utf-8"))

    for number, keyframe in enumerate(motion["keyframes"]):
        centres = voxels_at(tree, dict(zip(motion["hinges"], keyframe["angles_deg"], strict=True)))
        x, y, z = tree["voxel_mm"] * (np.ptp(centres, axis=0) + 1)
        print(f"after {number} moves: {x:.0f} x {y:.0f} x {z:.0f} mm")

    error = np.abs(centres - tree["target"]).max()
    print(f"The voxel that is farthest from its cell is {error:.1e} voxel sides away from it.")
    if error > 1e-9:
        sys.exit("This kit does not fold into its template.")
    print(f"All {len(centres)} voxels end in their cells of {tree['template']['name']}.")


if __name__ == "__main__":
    main(*sys.argv[1:])
