"""Template files: a target shape of cells as a small TOML file.

A file has a ``name``, may have a ``description``, and says which cells there are in one of three
ways: ``cells = [[i, j, k], ...]``; ``layers``, a list of layers from z = 0 upwards, each a list of
strings (rows along y, characters along x) in which ``#`` is a cell and ``.`` is none; or blocks,
``[[box]]`` tables with ``from`` and ``to`` that are added, and ``[[remove]]`` tables that are taken
away again. A block runs from corner to corner: ``from = [0, 0, 0]``, ``to = [4, 4, 2]`` has
4 x 4 x 2 cells.

A template that is folded once more when it is filled has ``[[fold]]`` tables, carried out in their
order: the line from the corner ``from`` to the corner ``to``, the ``angle`` in degrees
(right-handed about that direction), and ``moves``, the block or the list of blocks that turns,
all as the template lies before any fold.

``joints = "inside"`` keeps hinges off the faces that can be seen of the filled template.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fabfold.errors import TemplateError
from fabfold.lattice.creases import check_creases
from fabfold.lattice.rotations import FACES, IntArray
from fabfold.lattice.template import MAX_CELLS, MAX_SIDE, Crease, Template
from fabfold.toml_files import TomlError, line_of, nearest, read_toml

__all__ = ["pieces_of", "read_template"]

#: Blocks may reach so many times farther than cells before some are taken away.
_MOST_SPAN = 4
_KEYS = {"name", "description", "cells", "layers", "box", "remove", "fold", "joints"}


def read_template(path: Path) -> Template:
    """Read a template file.

    Parameters
    ----------
    path : Path
        A ``.toml`` file.

    Returns
    -------
    Template
        In one piece; its creases join its parts to a tree, and no two cells end in one place.

    Raises
    ------
    TemplateError
        If the file cannot be used. The message names the file, and the line or the field that is
        wrong.
    """
    try:
        data, text = read_toml(path)
    except TomlError as error:
        raise TemplateError(f"template file {path}: {error}") from None
    try:
        template = _template(data, path.stem, text)
        check_creases(template)
    except ValueError as error:
        raise TemplateError(f"template file {path}: {error}") from None
    return template


def _faults(data: dict[str, Any], given: Sequence[str], text: str) -> list[str]:
    """What is wrong with the keys of a template, each with its line."""
    faults = [
        f"{line_of(text, key)}{key} is no key; {nearest(key, sorted(_KEYS))}"
        for key in sorted(set(data) - _KEYS)
    ]
    name = data.get("name", "-")
    if not isinstance(name, str) or not name.strip():
        faults.append(f"{line_of(text, 'name')}name: wants a text that is not empty")
    if len(given) != 1:
        faults.append(
            "wants a name and one of cells, layers or [[box]], "
            + (f"found {' and '.join(given)}" if given else "found none")
        )
    elif "remove" in data and given != ["box"]:
        faults.append(f"{line_of(text, 'remove')}remove: goes with [[box]], not with {given[0]}")
    joints = data.get("joints", "any")
    if joints not in ("any", "inside"):
        wants = 'wants "any" or "inside"'
        faults.append(f"{line_of(text, 'joints')}joints: {wants}, found {joints!r}")
    return faults


def _template(data: dict[str, Any], stem: str, text: str) -> Template:
    given = [key for key in ("cells", "layers", "box") if key in data]
    if faults := _faults(data, given, text):
        raise ValueError("; ".join(faults))
    name, joints = data.get("name", stem), data.get("joints", "any")
    read = {"cells": _from_cells, "layers": _from_layers, "box": _from_boxes}[given[0]]
    cells = read(data)
    if len(cells) == 0:
        raise ValueError(f"{given[0]}: there is no cell")
    if len(cells) > MAX_CELLS or np.ptp(cells, axis=0).max() >= MAX_SIDE:
        raise ValueError(
            f"{given[0]}: {len(cells)} cells, {np.ptp(cells, axis=0).max() + 1} along an axis; at "
            f"most {MAX_CELLS} and {MAX_SIDE} are possible"
        )
    pieces = pieces_of(cells)
    if len(pieces) > 1:
        stray = cells[pieces[-1][0]].tolist()
        raise ValueError(
            f"{given[0]}: the cells are in {len(pieces)} pieces of "
            f"{', '.join(str(len(piece)) for piece in pieces)} cells that share no face; the "
            f"smallest has cell {stray}"
        )
    creases = tuple(_crease(entry, k) for k, entry in enumerate(_tables(data, "fold")))
    return Template(name, cells, creases, joints)


def pieces_of(cells: IntArray) -> list[list[int]]:
    """Groups of cells that hang together through faces.

    Parameters
    ----------
    cells : (m, 3) int32 array
        Lattice coordinates.

    Returns
    -------
    list of list of int
        Indices of `cells`, the largest group first.
    """
    index = {tuple(cell): i for i, cell in enumerate(cells.tolist())}
    seen: set[int] = set()
    pieces = []
    for start in range(len(cells)):
        if start in seen:
            continue
        piece = [start]
        seen.add(start)
        for at in piece:
            for face in FACES:
                other = index.get(tuple((cells[at] + face).tolist()))
                if other is not None and other not in seen:
                    seen.add(other)
                    piece.append(other)
        pieces.append(piece)
    return sorted(pieces, key=len, reverse=True)


def _from_cells(data: dict[str, Any]) -> IntArray:
    listed = data["cells"]
    if not isinstance(listed, list):
        raise ValueError("cells: wants a list of [i, j, k]")
    found = [_triple(cell, f"cells[{number}]") for number, cell in enumerate(listed)]
    seen: dict[tuple[int, int, int], int] = {}
    for number, cell in enumerate(found):
        if cell in seen:
            raise ValueError(f"cells[{number}]: {list(cell)} is there already, as {seen[cell]}")
        seen[cell] = number
    return np.array(found, dtype=np.int32).reshape(-1, 3)


def _from_layers(data: dict[str, Any]) -> IntArray:
    layers = data["layers"]
    if not isinstance(layers, list):
        raise ValueError("layers: wants a list of lists of strings")
    found: list[tuple[int, int, int]] = []
    for z, layer in enumerate(layers):
        if not isinstance(layer, list):
            raise ValueError(f"layers[{z}]: wants a list of strings, found {layer!r}")
        for y, row in enumerate(layer):
            if not isinstance(row, str) or set(row) - set("#."):
                raise ValueError(f"layers[{z}][{y}]: wants a string of # and ., found {row!r}")
            found.extend((x, y, z) for x, character in enumerate(row) if character == "#")
    return np.array(found, dtype=np.int32).reshape(-1, 3)


def _from_boxes(data: dict[str, Any]) -> IntArray:
    added = [_ends(entry, f"box[{k}]") for k, entry in enumerate(_tables(data, "box"))]
    taken = [_ends(entry, f"remove[{k}]") for k, entry in enumerate(_tables(data, "remove"))]
    if not added:
        return np.zeros((0, 3), dtype=np.int32)
    low = np.min([start for start, _ in added], axis=0)
    size = np.max([end for _, end in added], axis=0) - low
    if size.max() > _MOST_SPAN * MAX_SIDE:
        raise ValueError(
            f"box: they span {size.max()} cells along an axis; at most {MAX_SIDE} are possible"
        )
    grid = np.zeros(size, dtype=bool)
    for start, end in added:
        grid[tuple(map(slice, start - low, end - low))] = True
    for number, (start, end) in enumerate(taken):
        room = tuple(map(slice, np.maximum(start - low, 0), np.maximum(end - low, 0)))
        if not grid[room].any():
            raise ValueError(f"remove[{number}]: there is no cell in it")
        grid[room] = False
    cells: IntArray = (np.argwhere(grid) + low).astype(np.int32)
    return cells


def _crease(entry: dict[str, Any], number: int) -> Crease:
    where = f"fold[{number}]"
    unknown = sorted(set(entry) - {"from", "to", "angle", "moves"})
    if unknown:
        raise ValueError(f"{where}: unknown keys: {', '.join(unknown)}")
    start, end = _corner(entry, where, "from"), _corner(entry, where, "to")
    if sum(a != b for a, b in zip(start, end, strict=True)) != 1:
        raise ValueError(f"{where}: from and to must differ along one axis, they are the line")
    angle = entry.get("angle", 180)
    if angle not in (90, 180, -90, -180):
        raise ValueError(f"{where}.angle: wants 90, 180, -90 or -180, found {angle!r}")
    blocks = entry.get("moves")
    if isinstance(blocks, dict):
        blocks = [blocks]
    if not isinstance(blocks, list) or not blocks:
        raise ValueError(f"{where}.moves: wants a block {{from = [...], to = [...]}} or several")
    cells = [_block(block, f"{where}.moves[{k}]") for k, block in enumerate(blocks)]
    return Crease(start, end, int(angle), np.unique(np.concatenate(cells), axis=0))


def _tables(data: dict[str, Any], key: str) -> list[dict[str, Any]]:
    tables = data.get(key, [])
    if not isinstance(tables, list) or not all(isinstance(entry, dict) for entry in tables):
        raise ValueError(f"{key}: is written as [[{key}]] tables")
    return tables


def _ends(entry: Any, where: str) -> tuple[IntArray, IntArray]:
    """Lowest and highest corner of a block."""
    if not isinstance(entry, dict) or set(entry) != {"from", "to"}:
        raise ValueError(f"{where}: wants from = [x, y, z] and to = [x, y, z], found {entry!r}")
    low, high = _corner(entry, where, "from"), _corner(entry, where, "to")
    size = np.array(high) - low
    if size.min() < 1:
        raise ValueError(f"{where}: to must be greater than from on every axis: {low} to {high}")
    if size.max() > MAX_SIDE:
        raise ValueError(f"{where}: {size.max()} cells along an axis, at most {MAX_SIDE}")
    return np.array(low), np.array(high)


def _block(entry: Any, where: str) -> IntArray:
    """Cells of a block."""
    low, high = _ends(entry, where)
    return (np.argwhere(np.ones(high - low, dtype=bool)) + low).astype(np.int32)


def _corner(entry: dict[str, Any], where: str, key: str) -> tuple[int, int, int]:
    if key not in entry:
        raise ValueError(f"{where}.{key}: is missing")
    return _triple(entry[key], f"{where}.{key}")


def _triple(value: Any, where: str) -> tuple[int, int, int]:
    if (
        not isinstance(value, list)
        or len(value) != 3
        or any(not isinstance(part, int) or isinstance(part, bool) for part in value)
        or any(abs(part) > 10**6 for part in value)
    ):
        raise ValueError(f"{where}: wants three whole numbers [x, y, z], found {value!r}")
    x, y, z = value
    return (x, y, z)
