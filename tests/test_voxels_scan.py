"""Scanning a mesh into subvoxels, moving the planes, and warping the mesh."""

import itertools

import manifold3d
import numpy as np
import pytest
import trimesh

from fabfold.solid.convert import to_manifold
from fabfold.solid.scan import (
    TIE,
    box_counts,
    scan_and_summed_volume,
    scan_mesh,
    summed_volume,
)
from fabfold.voxels.offsets import CellEnergy, best_axis_offsets, cell_energy, optimise_offsets
from fabfold.voxels.warp import split_at_plane, warp_mesh


def mesh_arrays(mesh: trimesh.Trimesh) -> tuple[np.ndarray, np.ndarray]:
    return np.asarray(mesh.vertices, dtype=float), np.asarray(mesh.faces, dtype=np.int32)


def centres(shape: tuple[int, int, int]) -> np.ndarray:
    return np.moveaxis(np.indices(shape), 0, -1) + 0.5 + TIE


def random_rotation(seed: int) -> np.ndarray:
    return trimesh.transformations.random_rotation_matrix(np.random.default_rng(seed).random(3))[
        :3, :3
    ]


def warp_planes(seed: int = 0, cells: int = 6) -> tuple[tuple, tuple]:
    """Planes of a grid about the origin that were moved by up to a fifth, and the regular ones."""
    rng = np.random.default_rng(seed)
    regular = tuple(np.arange(cells + 1) - cells / 2 for _ in range(3))
    moved = []
    for planes in regular:
        offsets = rng.integers(-2, 3, len(planes)) / 20
        offsets[[0, -1]] = 0
        moved.append(planes + offsets)
    return tuple(moved), regular


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_scan_of_a_turned_box_is_its_inside(seed):
    rotation = random_rotation(seed)
    half = np.array([9.0, 6.0, 4.0])
    vertices, faces = mesh_arrays(trimesh.creation.box(2 * half))
    shape = (30, 30, 30)
    grid = scan_mesh(vertices @ rotation.T + 15.0, faces, shape)
    local = np.abs((centres(shape) - 15.0) @ rotation)
    assert np.array_equal(grid, (local < half).all(axis=-1))


def test_faces_edges_and_corners_on_sample_lines_do_not_leak():
    # Every corner of the box and the diagonal of every face runs through sample lines.
    vertices, faces = mesh_arrays(trimesh.creation.box((4, 4, 4)))
    grid = scan_mesh(vertices + 4.5, faces, (10, 10, 10))
    assert grid.sum() == 64
    assert scan_mesh(vertices + 4.5 + 1e-9, faces, (10, 10, 10)).sum() == 64


def test_sphere_volume_and_sub_pixel_triangles():
    sphere = trimesh.creation.icosphere(subdivisions=6, radius=12.0)
    vertices, faces = mesh_arrays(sphere)
    grid = scan_mesh(vertices + 15.0, faces, (30, 30, 30))
    assert grid.sum() == pytest.approx(sphere.volume, rel=5e-3)


def test_overlapping_shells_are_solid_and_cavities_are_not():
    outer = trimesh.creation.box((8, 8, 8))
    inner = trimesh.creation.box((4, 4, 4))
    shell, faces = mesh_arrays(trimesh.util.concatenate([outer, inner]))
    assert scan_mesh(shell + 5.0, faces, (10, 10, 10)).sum() == 512
    inner.invert()
    cavity, faces = mesh_arrays(trimesh.util.concatenate([outer, inner]))
    assert scan_mesh(cavity + 5.0, faces, (10, 10, 10)).sum() == 512 - 64


def test_a_mesh_that_reaches_out_of_the_grid_is_cut_off():
    vertices, faces = mesh_arrays(trimesh.creation.box((20, 20, 20)))
    assert scan_mesh(vertices, faces, (5, 6, 7)).all()


@pytest.mark.slow
def test_summed_volume_table_counts_boxes():
    vertices, faces = mesh_arrays(trimesh.creation.torus(8.0, 3.0))
    shape = (24, 24, 8)
    centred = vertices + np.array(shape) / 2
    grid = scan_mesh(centred, faces, shape)
    table = summed_volume(centred, faces, shape)
    assert table[-1, -1, -1] == grid.sum()
    inside, both = scan_and_summed_volume(centred, faces, shape)
    assert np.array_equal(inside, grid)
    assert np.array_equal(both, table)
    planes = tuple(np.array([-3, 0, 5, 7, n, n + 4], dtype=np.int64) for n in shape)
    counts = box_counts(table, planes)
    for i, j, k in np.ndindex(counts.shape):
        spans = [
            slice(max(planes[a][c], 0), max(planes[a][c + 1], 0)) for a, c in enumerate((i, j, k))
        ]
        assert counts[i, j, k] == grid[tuple(spans)].sum()


def blobs(seed: int, shape: tuple[int, int, int] = (14, 12, 10)) -> np.ndarray:
    """Summed volume table of some random boxes of material."""
    rng = np.random.default_rng(seed)
    grid = np.zeros(shape, dtype=bool)
    for _ in range(5):
        low = rng.integers(0, np.array(shape) - 2)
        high = low + rng.integers(1, 7, 3)
        grid[tuple(slice(a, b) for a, b in zip(low, high, strict=True))] = True
    table = np.zeros(np.array(shape) + 1, dtype=np.int32)
    table[1:, 1:, 1:] = grid.cumsum(0).cumsum(1).cumsum(2)
    return table


def energy_by_counting(table: np.ndarray, planes: tuple, energy: CellEnergy) -> float:
    """Sum over the cells, straight from the definition."""
    total = 0.0
    counts = box_counts(table, planes)
    for i, j, k in np.ndindex(counts.shape):
        size = 1.0
        for axis, cell in enumerate((i, j, k)):
            size *= planes[axis][cell + 1] - planes[axis][cell]
        total += cell_energy(counts[i, j, k] / size, *energy.arguments())
    return total


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("axis", range(3))
def test_dynamic_programming_finds_the_best_offsets(seed, axis):
    table = blobs(seed)
    regular = tuple(np.arange(-4, n + 8, 4, dtype=np.int64) for n in (14, 12, 10))
    others = np.random.default_rng(seed + 50)
    offsets = [np.zeros(len(planes), dtype=np.int64) for planes in regular]
    for other in set(range(3)) - {axis}:
        offsets[other][1:-1] = others.integers(-1, 1, len(regular[other]) - 2)
    energy = CellEnergy(drop_below=0.08, sliver_below=0.2)
    limit = 1
    _, value = best_axis_offsets(table, regular, tuple(offsets), axis, limit, energy)

    best = np.inf
    count = len(regular[axis])
    for inner in itertools.product(range(-limit, limit + 1), repeat=count - 2):
        trial = np.array([0, *inner, 0])
        if np.abs(np.diff(trial)).max() > limit:
            continue
        moved = [regular[a] + (trial if a == axis else offsets[a]) for a in range(3)]
        cost = energy_by_counting(table, tuple(moved), energy)
        best = min(best, cost + energy.move_cost * float((trial**2).sum()))
    assert value == pytest.approx(best, abs=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_block_descent_never_raises_the_energy_and_keeps_the_limits(seed):
    table = blobs(seed, (60, 50, 40))
    regular = tuple(np.arange(-20, n + 40, 20, dtype=np.int64) for n in (60, 50, 40))
    energy = CellEnergy()
    result = optimise_offsets(table, regular, 4, energy)
    assert (np.diff(result.energies) <= 0).all()
    moves = sum(float((o**2).sum()) for o in result.offsets)
    assert result.energies[0] == pytest.approx(energy_by_counting(table, regular, energy))
    assert result.energies[-1] == pytest.approx(
        energy_by_counting(table, result.planes, energy) + energy.move_cost * moves
    )
    for planes, offsets, base in zip(result.planes, result.offsets, regular, strict=True):
        assert np.array_equal(planes, base + offsets)
        assert np.abs(offsets).max() <= 4
        assert np.abs(np.diff(offsets)).max() <= 4
        assert offsets[0] == offsets[-1] == 0


def test_offsets_absorb_a_thin_overhang():
    # A bar of 3 cells that sticks out by 3 subvoxels: a sliver layer, until its plane moves.
    grid = np.zeros((63, 20, 20), dtype=bool)
    grid[:] = True
    table = np.zeros((64, 21, 21), dtype=np.int32)
    table[1:, 1:, 1:] = grid.cumsum(0).cumsum(1).cumsum(2)
    regular = tuple(np.arange(-20, n + 40, 20, dtype=np.int64) for n in (63, 20, 20))
    still = box_counts(table, regular)
    result = optimise_offsets(table, regular, 4, CellEnergy())
    moved = box_counts(table, result.planes)
    assert (still > 0).sum() == 4
    assert (moved > 0).sum() == 3
    assert optimise_offsets(table, regular, 0, CellEnergy()).planes[0].tolist() == (
        regular[0].tolist()
    )


def closed_and_oriented(vertices: np.ndarray, faces: np.ndarray) -> bool:
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    return bool(mesh.is_watertight and mesh.is_winding_consistent)


def test_split_keeps_the_surface_and_separates_the_sides():
    vertices, faces = mesh_arrays(trimesh.creation.icosphere(subdivisions=3, radius=2.0))
    split, pieces = split_at_plane(vertices, faces, 2, 0.3)
    assert len(pieces) > len(faces)
    assert closed_and_oriented(split, pieces)
    side = np.sign(split[:, 2] - 0.3)[pieces]
    assert not ((side.min(axis=1) < 0) & (side.max(axis=1) > 0)).any()
    assert (split[len(vertices) :, 2] == 0.3).all()
    before = trimesh.Trimesh(vertices, faces, process=False)
    after = trimesh.Trimesh(split, pieces, process=False)
    assert after.volume == pytest.approx(before.volume, rel=1e-12)
    assert after.area == pytest.approx(before.area, rel=1e-12)


def test_split_through_vertices_adds_no_needless_triangle():
    vertices, faces = mesh_arrays(trimesh.creation.box((2, 2, 2)))
    same, pieces = split_at_plane(vertices, faces, 0, 1.0)
    assert len(pieces) == len(faces)
    assert len(same) == len(vertices)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("shape", ["torus", "sphere", "box"])
def test_warp_scales_the_piece_in_every_cell_exactly(seed, shape):
    mesh = {
        "torus": lambda: trimesh.creation.torus(1.6, 0.7),
        "sphere": lambda: trimesh.creation.icosphere(subdivisions=2, radius=2.2),
        "box": lambda: trimesh.creation.box((3.1, 4.2, 1.7)),
    }[shape]()
    vertices, faces = mesh_arrays(mesh)
    vertices = vertices @ random_rotation(seed).T
    moved, regular = warp_planes(seed)
    warped, pieces = warp_mesh(vertices, faces, moved, regular)
    assert closed_and_oriented(warped, pieces)

    before = to_manifold(vertices, faces)
    after = to_manifold(warped, pieces)
    assert after.status() == manifold3d.Error.NoError
    checked = 0
    for cell in itertools.product(range(1, 5), repeat=3):
        volumes = []
        for solid, planes in ((before, moved), (after, regular)):
            low = np.array([planes[a][cell[a]] for a in range(3)])
            size = np.array([planes[a][cell[a] + 1] for a in range(3)]) - low
            box = manifold3d.Manifold.cube(size.tolist()).translate(low.tolist())
            volumes.append((solid ^ box).volume() / np.prod(size))
        assert volumes[1] == pytest.approx(volumes[0], abs=1e-7)
        checked += volumes[0] > 0
    assert checked >= 8


def test_warp_puts_new_vertices_exactly_on_the_lattice():
    vertices, faces = mesh_arrays(trimesh.creation.icosphere(subdivisions=3, radius=2.3))
    moved, regular = warp_planes(1)
    warped, _ = warp_mesh(vertices, faces, moved, regular)
    new = warped[len(vertices) :]
    on_plane = np.zeros(len(new), dtype=bool)
    for axis in range(3):
        on_plane |= np.isin(new[:, axis], regular[axis])
    assert on_plane.all()


def test_warp_by_nothing_changes_nothing():
    vertices, faces = mesh_arrays(trimesh.creation.torus(1.6, 0.7))
    _, regular = warp_planes()
    warped, pieces = warp_mesh(vertices, faces, regular, regular)
    assert np.allclose(warped, vertices, atol=1e-12)
    assert np.array_equal(pieces, faces)
