"""Boolean operations on solids: union, subtraction, and the tools that matter to a cut.

A *tool* is a solid that is subtracted from another one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import manifold3d

    Tools = list[tuple[int, manifold3d.Manifold]]

__all__ = ["bounds", "effective_tools", "evaluated", "subtract", "union"]

#: An effective tool is trimmed to what it takes and this much on every side, in mm.
_TRIM_MARGIN_MM = 0.5

Floats = NDArray[np.float64]


def evaluated(solid: manifold3d.Manifold) -> manifold3d.Manifold:
    """The same solid, computed now.

    Booleans of manifold3d are lazy: a solid that is used twice before it is computed may be
    computed twice.
    """
    solid.num_tri()
    return solid


def union(solids: list[manifold3d.Manifold]) -> manifold3d.Manifold:
    """Union of solids."""
    import manifold3d

    return evaluated(manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add))


def subtract(solid: manifold3d.Manifold, tools: list[manifold3d.Manifold]) -> manifold3d.Manifold:
    """A solid without what lies in any of some tools.

    Parameters
    ----------
    solid : manifold3d.Manifold
        The solid, mm.
    tools : list of manifold3d.Manifold
        What is taken from it, mm.

    Returns
    -------
    manifold3d.Manifold
        In mm.
    """
    if not tools:
        return evaluated(solid)
    return evaluated(evaluated(solid) - union(tools))


def effective_tools(tools: Tools, solid: manifold3d.Manifold) -> list[manifold3d.Manifold]:
    """The tools that take something off a solid, each trimmed to a box about what it takes.

    Most tools pass where a cell is empty, and most of the others only graze. Hundreds of hulls in
    a row unite much faster when only the parts that matter are left of them.

    Parameters
    ----------
    tools : list of (int, manifold3d.Manifold)
        Index of what each tool stands for, and the tool in mm.
    solid : manifold3d.Manifold
        What is to be cut, in mm.

    Returns
    -------
    list of manifold3d.Manifold
        The trimmed tools in mm, in the order of `tools`.
    """
    import manifold3d

    low, high = bounds(solid)
    found = []
    for _, tool in tools:
        start, end = bounds(tool)
        if not ((start < high).all() and (low < end).all()):
            continue
        common = evaluated(solid ^ tool)
        if common.volume() <= 1e-6:
            continue
        start, end = bounds(common)
        box = manifold3d.Manifold.cube(tuple(end - start + 2 * _TRIM_MARGIN_MM))
        found.append(evaluated(tool ^ box.translate(tuple(start - _TRIM_MARGIN_MM))))
    return found


def bounds(solid: manifold3d.Manifold) -> tuple[Floats, Floats]:
    """Lowest and highest corner of a solid's bounding box, (3,) float64 arrays in mm."""
    box = np.array(solid.bounding_box())
    return box[:3], box[3:]
