"""Units, place, direction and handedness of a model do not matter to its voxels."""

from __future__ import annotations

from itertools import permutations, product

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from fabfold.lattice.shipped import load_template
from fabfold.samples.builtin import load_sample
from fabfold.solid.closed_solid import Solid
from fabfold.solid.load import solid_from_mesh
from fabfold.solid.raw import RawMesh
from fabfold.voxels.voxel_model import Voxels
from fabfold.voxels.voxelize import voxelize

#: The same examples in every run, and no folder for those that failed.
QUICK = settings(deadline=None, max_examples=4, derandomize=True, database=None)
#: A search of a second.
SHORT = {"placements": 8, "shortlist": 4, "results": 2}
BOX = load_template("box-3x3x3")
#: A share of a voxel's subvoxels: those whose centre lies on the surface may fall either way.
ROUNDING = 0.002


@pytest.fixture(scope="module")
def duck() -> Solid:
    return load_sample("duck")


@pytest.fixture(scope="module")
def cut(duck: Solid) -> list[Voxels]:
    return voxelize(moved(duck, duck.vertices), BOX, **SHORT)


def moved(solid: Solid, points: np.ndarray) -> Solid:
    """The solid as it is read when its points lie elsewhere."""
    return solid_from_mesh("moved", RawMesh(points, np.asarray(solid.faces, dtype=np.int64)))


def assert_same(found: list[Voxels], wanted: list[Voxels], rounding: float = ROUNDING) -> None:
    assert len(found) == len(wanted)
    for one, other in zip(found, wanted, strict=True):
        assert np.array_equal(one.cells, other.cells)
        assert np.abs(one.fill - other.fill).max() <= rounding
        assert one.lost_volume == pytest.approx(other.lost_volume, abs=rounding)


@pytest.mark.slow
@pytest.mark.parametrize("scale", [1e-9, 25.4, 1e9])
def test_units_do_not_matter(scale: float, duck: Solid, cut: list[Voxels]) -> None:
    found = voxelize(moved(duck, duck.vertices * scale), BOX, **SHORT)
    assert_same(found, cut)
    assert found[0].pitch == pytest.approx(scale * cut[0].pitch, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("away", [1e3, 1e6])
def test_the_place_does_not_matter(away: float, duck: Solid, cut: list[Voxels]) -> None:
    """`away` is how many times its size the model lies off the origin."""
    size = float(np.ptp(duck.vertices, axis=0).max())
    found = voxelize(
        moved(duck, duck.vertices + away * size * np.array([1, -0.7, 0.3])), BOX, **SHORT
    )
    assert_same(found, cut)


def bracket() -> Solid:
    """Flat faces, many of which lie on planes of the grid."""
    foot = trimesh.creation.box((30, 10, 12))
    arm = trimesh.creation.box((10, 40, 12)).apply_translation((-10, 15, 0))
    whole = trimesh.boolean.union([foot, arm])
    return solid_from_mesh("bracket", RawMesh(whole.vertices, whole.faces))


def assert_same_but_for_symmetry(found: list[Voxels], wanted: list[Voxels]) -> None:
    """Each equals its counterpart in one of the 48 ways in which a lattice lies on itself."""
    assert len(found) == len(wanted)
    for one, other in zip(found, wanted, strict=True):
        ways = []
        for order in permutations(range(3)):
            for signs in product((1, -1), repeat=3):
                cells = one.cells[:, order] * np.array(signs)
                cells -= cells.min(axis=0)
                place = np.lexsort(cells.T[::-1])
                if np.array_equal(cells[place], other.cells):
                    ways.append(np.abs(one.fill[place] - other.fill).max())
        assert ways, "other cells"
        assert min(ways) <= ROUNDING
        assert one.lost_volume == pytest.approx(other.lost_volume, abs=ROUNDING)
        assert one.pitch == pytest.approx(other.pitch, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("digits", [np.float64, np.float32])
@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("model", ["duck", "bracket"])
def test_a_search_finds_the_same_voxels_however_the_model_lies(
    model: str, mirrored: bool, digits: type, duck: Solid
) -> None:
    """Turned by any angle, mirrored, and written with coordinates of four bytes."""
    solid = duck if model == "duck" else bracket()
    turn = trimesh.transformations.rotation_matrix(0.7, (0.3, -1, 0.5))[:3, :3]
    faces = np.asarray(solid.faces, dtype=np.int64)
    if mirrored:
        turn[0], faces = -turn[0], faces[:, ::-1]
    points = (np.asarray(solid.vertices) @ turn.T).astype(digits).astype(np.float64)
    found = voxelize(solid_from_mesh("turned", RawMesh(points, faces)), BOX, **SHORT)
    assert_same_but_for_symmetry(found, voxelize(solid, BOX, **SHORT))


@pytest.mark.slow
@QUICK
@given(axis=st.tuples(*[st.floats(-1, 1)] * 3), angle=st.floats(-180, 180))
def test_a_grid_turns_with_its_model(
    duck: Solid, axis: tuple[float, float, float], angle: float
) -> None:
    if np.linalg.norm(axis) < 0.1:
        return
    turn = trimesh.transformations.rotation_matrix(np.radians(angle), axis)[:3, :3]
    size = float(np.ptp(duck.vertices, axis=0).max())
    centre = np.asarray(duck.vertices).mean(axis=0)
    grid = {"origin": tuple(centre), "pitch": size / 4.1, "max_loss": 0.3}
    wanted = voxelize(duck, BOX, rotation=np.eye(3), **grid)
    found = voxelize(moved(duck, duck.vertices @ turn.T), BOX, rotation=turn.T, **grid)
    assert_same(found, wanted)


@pytest.mark.slow
@pytest.mark.parametrize("axis", range(3))
def test_a_mirrored_model_has_mirrored_voxels(axis: int, duck: Solid) -> None:
    size = float(np.ptp(duck.vertices, axis=0).max())
    centre = np.asarray(duck.vertices).mean(axis=0)
    grid = {"rotation": np.eye(3), "pitch": size / 4.1, "max_loss": 0.3}
    (wanted,) = voxelize(duck, BOX, origin=tuple(centre), **grid)
    sign = np.ones(3)
    sign[axis] = -1
    mesh = RawMesh(duck.vertices * sign, np.asarray(duck.faces, dtype=np.int64)[:, ::-1])
    (found,) = voxelize(solid_from_mesh("mirrored", mesh), BOX, origin=tuple(centre * sign), **grid)
    cells = wanted.cells.copy()
    cells[:, axis] = cells[:, axis].max() - cells[:, axis]
    order = np.lexsort(cells.T[::-1])
    assert np.array_equal(found.cells, cells[order])
    assert np.abs(found.fill - wanted.fill[order]).max() <= ROUNDING
