"""Pictures beside the checks: which bodies a figure is about, and in which pose it was found."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fabfold.export.camera import View
from fabfold.export.kit_picture import picture_of_kit
from fabfold.export.render import png_bytes
from fabfold.fold.motion import Motion
from fabfold.kit.stages import BuiltTree
from fabfold.printing.checks import Check
from fabfold.tree.fold_tree import FoldTree

__all__ = ["bodies_named", "figure_pictures", "place_of"]

_SIZE = (300, 225)
_PICKED, _OTHER = (214, 74, 30), (222, 221, 217)
_PATH = "smallest gap on the folding path"


def bodies_named(text: str, names: Sequence[str]) -> list[int]:
    """Indices of the bodies that a text names, such as the note of a check, sorted."""
    found = re.findall(r"\b(?:body|link)-\d+\b", text)
    return sorted({names.index(name) for name in found if name in names})


def place_of(
    check: Check, tree: FoldTree, motion: Motion
) -> tuple[list[int], NDArray[np.float64]] | None:
    """Where a figure was found.

    Parameters
    ----------
    check : Check
        Its note may name bodies, a hinge, and a move with an angle.
    tree, motion
        What folds, and its certified path.

    Returns
    -------
    (bodies, angles) or None
        Indices of the bodies, and the angles of all hinges, degrees; None where it names no body.
    """
    bodies = bodies_named(check.note, [body.name for body in tree.bodies])
    angles = np.array(motion.angles_deg[0])
    if check.name == _PATH:
        moves = motion.certificate.get("moves", [])
        if not moves:
            return None
        number = min(range(len(moves)), key=lambda row: moves[row]["min_gap_mm"]) + 1
        hinge = tree.hinges[motion.moves[number][0]]
        before, after = motion.angles_deg[number - 1], motion.angles_deg[number]
        return [hinge.parent, hinge.child], np.asarray((before + after) / 2)
    if not bodies:
        return None
    move = re.search(r"\bmove (\d+) of \d+ \((hinge-\d+)\), (-?[\d.]+)°", check.note)
    if move is not None and 0 < int(move[1]) < len(motion.moves):
        number = int(move[1])
        angles = np.array(motion.angles_deg[number - 1])
        column = motion.moves[number][0]
        turn = motion.angles_deg[number, column] - angles[column]
        angles[column] += np.sign(turn) * min(abs(float(move[3])), abs(turn))
    return bodies, angles


def figure_pictures(checks: Sequence[Check], built: BuiltTree) -> dict[str, bytes]:
    """A picture for each check that is about certain bodies: these in colour, the others pale.

    Parameters
    ----------
    checks : sequence of Check
        The checks.
    built : BuiltTree
        The bodies, and the path.

    Returns
    -------
    dict of str to bytes
        PNG by the name of the check.
    """
    tree, motion = built.planned.tree, built.planned.motion
    look = View(size=_SIZE, lights=3, ground=False, margin=0.04)
    drawn: dict[str, bytes] = {}
    for check in checks:
        found = place_of(check, tree, motion)
        if found is None:
            continue
        bodies, angles = found
        colours = np.tile(np.array(_OTHER, np.uint8), (len(tree.bodies), 1))
        colours[bodies] = _PICKED
        picture = picture_of_kit(
            built.joinery, tree, angles, look, colours=colours,
            upright=built.planned.voxels.rotation.T,
        )  # fmt: skip
        drawn[check.name] = png_bytes(picture)
    return drawn
