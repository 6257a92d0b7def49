"""The flat pattern of a box that is open above."""

from __future__ import annotations

from build123d import Align, Box, Part, Pos, Rot

from .exceptions import HingeError
from .fold_lines import Line
from .fold_snap import Bend

__all__ = ["tray_net"]


def tray_net(
    sizes: tuple[float, float, float], bend: Bend
) -> tuple[Part, list[Line], list[tuple[Line, Line]]]:
    """Lay out a base with four walls.

    Parameters
    ----------
    sizes : (float, float, float)
        Outer width, depth and height of the folded box in mm.
    bend : Bend
        How its walls are folded up.

    Returns
    -------
    plate : Part
        The flat plate on z = 0.
    folds : list of Line
        The four folds.
    seams : list of (Line, Line)
        The edges that meet at the four corners.

    Raises
    ------
    HingeError
        If a wall is no higher than its bend, or the base no wider.
    """
    thick = bend.thickness
    mouth = 0.5 * bend.land + (thick - bend.web) * bend.lean
    # Folds lie where the outer faces of the walls come to the size asked for.
    half = [0.5 * size - bend.outside for size in sizes[:2]]
    far = sizes[2] - bend.outside
    if min(*half, far) <= mouth + thick:
        raise HingeError(
            f"a tray of {sizes[0]:g} x {sizes[1]:g} x {sizes[2]:g} mm is no larger than its "
            f"bends, {mouth:.3g} mm each side: use larger sizes, or a material that bends more "
            "sharply"
        )
    up, back = (Align.CENTER, Align.CENTER, Align.MIN), mouth + 0.3
    plate, folds, seams = Part(), [], []
    for first, second in ((0, 1), (1, 0)):
        spin = Rot(0, 0, 90 * first)
        plate += spin * Box(2 * (half[first] + far), 2 * (half[second] - back), thick, align=up)
        for side in (-1, 1):
            wall = Box(far - mouth, 2 * (half[second] + bend.outside), thick, align=up)
            plate += spin * Pos(side * (half[first] + 0.5 * (mouth + far))) * wall
            low, high = -(half[second] - back), half[second] - back
            at = side * half[first]
            folds.append(((at, low), (at, high)) if first == 0 else ((low, at), (high, at)))
    corner_x, corner_y = 0.5 * sizes[0], 0.5 * sizes[1]
    for sx, sy in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
        one: Line = (
            (sx * (half[0] + mouth), sy * corner_y),
            (sx * (half[0] + far), sy * corner_y),
        )
        other: Line = (
            (sx * corner_x, sy * (half[1] + mouth)),
            (sx * corner_x, sy * (half[1] + far)),
        )
        seams.append((one, other))
    return plate, folds, seams
