"""Templates that fold once more: their parts, and the shape that they end in.

A template with creases is filled flat and then folded along them (paper section 1: "a template
that can be easily folded into a box"). The creases divide it into parts, the panels of rigid
origami. Parts form a tree like the bodies of a joint tree: every crease joins one part that stays
to one that turns.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fabfold.lattice.rotations import IntArray, rotation_about
from fabfold.lattice.template import Crease, Template

__all__ = ["Parts", "check_creases", "folded_template", "line_of", "parts_of", "rim_of"]


@dataclass(frozen=True)
class Parts:
    """A template divided by its creases.

    Attributes
    ----------
    part : (m,) int32 array
        Part of each cell of the template; part 0 never turns.
    above : (p,) tuple of int
        Part that each part turns against; -1 for part 0, and always a smaller number.
    crease : (p,) tuple of int
        Crease that carries each part; -1 for part 0.
    poses : (p, 4, 4) float64 array
        Rigid transform of each part from the template to the folded shape, lattice coordinates.
    shift : (3,) int32 array
        What brings the cells of the folded shape to non-negative coordinates.
    """

    part: IntArray
    above: tuple[int, ...]
    crease: tuple[int, ...]
    poses: NDArray[np.float64]
    shift: IntArray

    def landed(self, cells: IntArray) -> IntArray:
        """Where each cell of the template ends.

        Parameters
        ----------
        cells : (m, 3) int32 array
            Cells of the template, in its order.

        Returns
        -------
        (m, 3) int32 array
            Cells of the folded shape, smallest coordinate 0 on every axis.
        """
        turned = np.einsum("mij,mj->mi", self.poses[self.part, :3, :3], cells.astype(float))
        moved = turned + self.poses[self.part, :3, 3] + self.shift
        return np.asarray(np.rint(moved), dtype=np.int32)


def line_of(crease: Crease) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The line of a crease.

    Parameters
    ----------
    crease : Crease
        A crease of any template.

    Returns
    -------
    point : (3,) float64 array
        A point of the line, lattice coordinates.
    direction : (3,) float64 array
        Unit vector from its start to its end.
    """
    start = np.array(crease.start, dtype=float)
    return start - 0.5, np.sign(np.array(crease.end, dtype=float) - start)


def rim_of(template: Template, parts: Parts, number: int) -> list[tuple[int, int]]:
    """Pairs of cells, one on each side, that share a face with an edge on a part's crease.

    Parameters
    ----------
    template : Template
        A template with creases.
    parts : Parts
        Its parts.
    number : int
        The part that turns about the crease.

    Returns
    -------
    list of (int, int)
        Cell of the part above, and cell of this part, by index.
    """
    crease = template.creases[parts.crease[number]]
    index = {tuple(cell): i for i, cell in enumerate(template.cells.tolist())}
    start, end = np.array(crease.start), np.array(crease.end)
    axis = int(np.flatnonzero(start != end)[0])
    low, high = sorted((int(start[axis]), int(end[axis])))
    found = []
    others = [other for other in range(3) if other != axis]
    for place in range(low, high):
        # The four cells around one edge of the line.
        around = []
        for a in (-1, 0):
            for b in (-1, 0):
                cell = [0, 0, 0]
                cell[axis] = place
                cell[others[0]] = int(start[others[0]]) + a
                cell[others[1]] = int(start[others[1]]) + b
                around.append(index.get(tuple(cell), -1))
        for first, second in ((0, 1), (0, 2), (3, 1), (3, 2)):
            for u, v in ((around[first], around[second]), (around[second], around[first])):
                if (
                    u >= 0
                    and v >= 0
                    and parts.part[u] == parts.above[number]
                    and parts.part[v] == number
                ):
                    found.append((u, v))
    return found


def parts_of(template: Template) -> Parts:
    """Divide a template by its creases.

    Parameters
    ----------
    template : Template
        A template with or without creases.

    Returns
    -------
    Parts
        One part more than there are creases.

    Raises
    ------
    ValueError
        If the creases do not join the parts to a tree; the message names the fold.
    """
    cells = [tuple(cell) for cell in template.cells.tolist()]
    member = np.zeros((len(cells), len(template.creases)), dtype=bool)
    index = {cell: i for i, cell in enumerate(cells)}
    for number, crease in enumerate(template.creases):
        turned = [index[tuple(cell)] for cell in crease.moves.tolist() if tuple(cell) in index]
        member[turned, number] = True
        if not turned or len(turned) == len(cells):
            raise ValueError(f"fold[{number}].moves: must have some of the cells, and not all")
    keys: dict[tuple[bool, ...], int] = {}
    order = sorted(set(map(tuple, member.tolist())), key=lambda key: (sum(key), key))
    for key in order:
        keys[key] = len(keys)
    if not order or any(order[0]):
        raise ValueError("fold: every cell is moved by some fold; one part must stay")
    if len(order) != len(template.creases) + 1:
        raise ValueError(
            f"fold: {len(template.creases)} folds divide the template into {len(order)} parts; "
            f"there must be {len(template.creases) + 1}, each hanging on one line"
        )
    above, carried = [-1], [-1]
    poses = [np.eye(4)]
    for key in order[1:]:
        for number, moved in enumerate(key):
            parent = keys.get((*key[:number], False, *key[number + 1 :])) if moved else None
            if parent is not None and number not in carried:
                break
        else:
            raise ValueError("fold: a part turns by folds that no chain of parts leads to")
        above.append(parent or 0)
        carried.append(number)
        crease = template.creases[number]
        poses.append(poses[parent or 0] @ rotation_about(*line_of(crease), crease.angle_deg))
    part = np.array([keys[tuple(row)] for row in member.tolist()], dtype=np.int32)
    loose = Parts(part, tuple(above), tuple(carried), np.array(poses), np.zeros(3, dtype=np.int32))
    low = loose.landed(template.cells).min(axis=0)
    return Parts(part, loose.above, loose.crease, loose.poses, (-low).astype(np.int32))


def check_creases(template: Template) -> None:
    """Refuse creases that cannot be folded.

    Parameters
    ----------
    template : Template
        A template with or without creases.

    Raises
    ------
    ValueError
        If a crease has no room for a hinge, or two cells end in one place. The message names the
        fold.
    """
    if not template.creases:
        return
    parts = parts_of(template)
    for number in range(1, len(parts.above)):
        crease = parts.crease[number]
        if not rim_of(template, parts, number):
            raise ValueError(
                f"fold[{crease}]: no cell that turns shares a face with one that stays, with an "
                f"edge on the line from {list(template.creases[crease].start)} to "
                f"{list(template.creases[crease].end)}: nothing could hold a hinge there"
            )
    landed = parts.landed(template.cells)
    places: dict[tuple[int, ...], int] = {}
    for i, cell in enumerate(landed.tolist()):
        other = places.setdefault(tuple(cell), i)
        if other != i:
            number = max(parts.part[i], parts.part[other])
            raise ValueError(
                f"fold[{parts.crease[number]}]: cells {template.cells[other].tolist()} and "
                f"{template.cells[i].tolist()} end in one place"
            )


def folded_template(template: Template) -> Template:
    """The shape that a template with creases ends in.

    Parameters
    ----------
    template : Template
        A template with or without creases.

    Returns
    -------
    Template
        Without creases; `template` itself where it has none.
    """
    if not template.creases:
        return template
    folded = Template(f"{template.name}-folded", parts_of(template).landed(template.cells))
    if len(folded) == np.prod(folded.shape):
        name = "box-" + "x".join(str(side) for side in folded.shape)
        return Template(name, folded.cells, joints=template.joints)
    return Template(folded.name, folded.cells, joints=template.joints)
