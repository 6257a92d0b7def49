"""A template from a mesh: the cells that fill the mesh best."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import TemplateError
from fabfold.lattice.rotations import IntArray
from fabfold.lattice.template import MAX_CELLS, MAX_SIDE, Template
from fabfold.lattice.template_files import pieces_of
from fabfold.solid.closed_solid import Solid
from fabfold.solid.scan import box_counts, summed_volume
from fabfold.voxels.voxel_model import SUBDIVISION

__all__ = ["template_of_solid"]

#: Cells of a template where no number is asked for: the best match from half to twice as many.
USUAL_CELLS = 64
#: Share of the number of cells asked for by which the best match may miss it.
_WINDOW = 0.1
#: Smallest share of mesh and cells together that they have in common.
MIN_MATCH = 0.5
#: Price of cells that one checkerboard colour has more than the other, against the match: models
#: have about as many cells of either colour, and hinges keep the colour of a cell.
_IMBALANCE = 0.25
#: Price of missing the number of cells by a factor of two, against the match.
_COUNT = 0.02


def template_of_solid(solid: Solid, cells: int | None = None) -> Template:
    """Cells that fill a mesh as well as cells of one size can, along the mesh's own axes.

    Parameters
    ----------
    solid : Solid
        The mesh.
    cells : int, optional
        Number of cells wanted; what comes out is the best match within a tenth of it, or the
        nearest number that the mesh allows. By default the best match from 32 to 128 cells.

    Returns
    -------
    Template
        In one piece, with the name of the solid. The match is the volume that mesh and cells have
        in common over the volume of both together.

    Raises
    ------
    TemplateError
        If cells of this size do not show the mesh.
    """
    wanted = USUAL_CELLS if cells is None else cells
    if not 2 <= wanted <= MAX_CELLS:
        raise TemplateError(f"a template must have 2 to {MAX_CELLS} cells, not {wanted}")
    window = (wanted / 2, wanted * 2) if cells is None else _window(wanted)
    best: tuple[tuple[float, float], IntArray, float] | None = None
    for pitch in _pitches(solid, window):
        for found in _cuts(solid, pitch):
            count = len(found[1])
            outside = max(window[0] - count, count - window[1], 0.0)
            value = found[0] - _COUNT * abs(np.log2(count / wanted)) - _IMBALANCE * found[2]
            # Rounded, so that equal matches are equal: the first, larger cells, stays.
            order = (-outside, round(float(value), 6))
            if best is None or order > best[0]:
                best = (order, found[1], found[0])
    if best is None or best[2] < MIN_MATCH:
        share = 0.0 if best is None else best[2]
        raise TemplateError(
            f"{solid.name}: about {wanted} cells do not show this shape, the best match is "
            f"{share:.0%} (at least {MIN_MATCH:.0%} is wanted); ask for more cells, or take a "
            "more compact target"
        )
    return Template(solid.name, best[1])


def _window(wanted: int) -> tuple[float, float]:
    slack = max(1.0, _WINDOW * wanted)
    return wanted - slack, wanted + slack


def _pitches(solid: Solid, window: tuple[float, float]) -> list[float]:
    """Sides of a cell worth trying, descending: even steps, and those that divide a side evenly."""
    extent = np.ptp(solid.bounds, axis=0)
    # Cells are kept from half full on, so their number times their volume is about the model's.
    high = float(np.cbrt(1.4 * solid.volume / window[0]))
    low = float(np.cbrt(0.7 * solid.volume / window[1]))
    low = max(low, float(extent.max()) / MAX_SIDE)
    if low > high:
        return []
    even = np.geomspace(low, high, 25)
    fitted = (extent[:, None] / np.arange(1, MAX_SIDE + 1)).ravel()
    fitted = fitted[(fitted >= low) & (fitted <= high)]
    steps = np.unique(np.round(np.concatenate([even, fitted]) / high, 12)) * high
    return [float(value) for value in steps[::-1]]


def _cuts(solid: Solid, pitch: float) -> list[tuple[float, IntArray, float]]:
    """Match, cells and imbalance of the colours at every translation tried."""
    side = pitch / SUBDIVISION
    low = solid.vertices.min(axis=0)
    extent = np.ptp(solid.vertices, axis=0) / side
    # A hair less, so that a side that is a whole number of cells is not one subvoxel longer.
    x, y, z = np.maximum(np.ceil(extent - 1e-6), 1).astype(int).tolist()
    table = summed_volume((solid.vertices - low) / side, solid.faces, (x, y, z))
    volume = int(table[-1, -1, -1])
    if volume == 0:
        return []
    starts = []
    for size in (x, y, z):
        cells = -(-size // SUBDIVISION)
        middle = (cells * SUBDIVISION - size) // 2
        starts.append(sorted({0, middle, SUBDIVISION // 2}))
    found = []
    for a in starts[0]:
        for b in starts[1]:
            for c in starts[2]:
                planes = tuple(
                    np.arange(-first, size + SUBDIVISION, SUBDIVISION, dtype=np.int64)
                    for first, size in ((a, x), (b, y), (c, z))
                )
                cut = _match(box_counts(table, (planes[0], planes[1], planes[2])), volume)
                if cut is not None:
                    found.append(cut)
    return found


def _match(counts: NDArray[np.int32], volume: int) -> tuple[float, IntArray, float] | None:
    full = SUBDIVISION**3
    cells = np.argwhere(2 * counts >= full).astype(np.int32)
    if not 0 < len(cells) <= MAX_CELLS:
        return None
    cells = cells[pieces_of(cells)[0]]
    common = int(counts[tuple(cells.T)].sum())
    odd = int((cells.sum(axis=1) % 2).sum())
    match = common / (volume + len(cells) * full - common)
    return match, cells, abs(len(cells) - 2 * odd) / len(cells)
