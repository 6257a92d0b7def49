"""Every double hinge of the catalogue between two full cubes: built, proven, with figures.

    python benchmarks/joinery_doubles.py [--clearance 0.3] [--voxel 20]

One line a pair of axes and turns, then the extremes. A path is found by trying all states; the
proof is the swept certificate on the printed bodies.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from fabfold.errors import FabfoldError
from fabfold.joinery.build import build_bodies
from fabfold.proof.certify import certify
from fabfold.tree.catalogue import double_joints, edge_sides

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from double_models import full_solid, hand_tree, motion_of, planned
from joinery_models import voxels_of

NAMES = ("+x", "-x", "+y", "-y", "+z", "-z")


def main() -> None:
    """Build and prove all 84."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--clearance", type=float, default=0.3, help="mm")
    parser.add_argument("--voxel", type=float, default=20.0, help="mm")
    options = parser.parse_args()
    voxels = None
    done, gaps, links, build_s, proof_s = 0, [], [], 0.0, 0.0
    joints = double_joints(0, neighbours_only=False)
    for joint in joints:
        tree = hand_tree([[0, 0, 0], [1, 0, 0]], [(0, 1, ("D", joint.sides, joint.turns))])
        edges = " ".join(NAMES[edge_sides(0)[side]] for side in joint.sides)
        turns = " ".join(f"{90 * turn:3d}" for turn in joint.turns)
        path = planned(tree)
        if path is None:
            print(f"{edges}  {turns}  no path")
            continue
        motion = motion_of(tree, path)
        if voxels is None:
            voxels = voxels_of(tree.source, full_solid(tree))
        try:
            start = time.process_time()
            joinery = build_bodies(
                voxels, tree, motion, voxel_mm=options.voxel, clearance_mm=options.clearance
            )
            middle = time.process_time()
            meshes = [(body.vertices, body.faces) for body in joinery.bodies]
            proof = certify(
                tree, motion, meshes, options.voxel, joinery.origin_mm, 0.95 * options.clearance
            )
        except FabfoldError as error:
            print(f"{edges}  {turns}  {type(error).__name__}: {error}", flush=True)
            continue
        build_s += middle - start
        proof_s += time.process_time() - middle
        done += 1
        gaps.append(proof["seen_gap_mm"])
        links.append(joinery.bodies[1].volume)
        volumes = " ".join(f"{body.volume:6.0f}" for body in joinery.bodies)
        print(
            f"{edges}  {turns}  {len(path)} quarter turns  gap {gaps[-1]:.4f} mm  {volumes} mm³",
            flush=True,
        )
    print(f"{done} of {len(joints)} built and proven")
    if done:
        print(f"smallest gap seen {min(gaps):.4f} mm, smallest link {min(links):.0f} mm³")
        print(f"processor time each: {build_s / done:.2f} s to build, {proof_s / done:.2f} s proof")


if __name__ == "__main__":
    main()
