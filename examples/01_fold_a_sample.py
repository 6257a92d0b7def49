"""Fold a sample: from a name to files for the printer.

    python examples/01_fold_a_sample.py [FOLDER]

A kit is one model on its way to a printed object that folds. Its stages are methods, and each
runs what is missing before it: ``kit.export()`` alone would make everything.
"""

import sys

from fabfold import Kit


def main(folder: str = "car-kit") -> None:
    # The sample brings its own box, 3 x 4 x 4. "quick" searches less than usual for few hinges.
    kit = Kit.from_model("sample:car", effort="quick", seed=1, folder=folder)

    voxels = kit.voxelize()[0]
    print(
        f"The car is cut into at most {len(kit.template)} voxels; the first cut has {len(voxels)}."
    )

    built = kit.join()
    tree, motion = built.planned.tree, built.planned.motion
    print(f"{len(tree.bodies)} bodies hang on {len(tree.hinges)} hinges.")
    print(f"It folds in {len(motion.moves) - 1} moves.")
    print(f"On the way no two bodies come nearer than {motion.certificate['min_gap_mm']:.2f} mm.")

    checks = kit.check()
    failed = [check.name for check in checks if not check.ok]
    print(f"{len(checks) - len(failed)} of {len(checks)} checks pass.", *failed)

    where = kit.export()
    print(f"Open {where / 'car.3mf'} in a slicer, and {where / 'fold.glb'} in a glTF viewer.")


# The search starts processes, which read this file again: without this line they would start more.
if __name__ == "__main__":
    main(*sys.argv[1:])
