"""The search for a grid placement, on solids of known shape."""

import numpy as np
import pytest
import trimesh

from fabfold.errors import NoVoxelsError, RecipeError
from fabfold.lattice.rotations import parity
from fabfold.lattice.shipped import load_template
from fabfold.lattice.template import Template
from fabfold.meshes import mesh_volume
from fabfold.progress import SilentProgress
from fabfold.solid.closed_solid import Solid
from fabfold.solid.scan import summed_volume
from fabfold.tree.bound import ClosingBound
from fabfold.voxels.features import features
from fabfold.voxels.grid_placement import (
    Capacity,
    grid_fit,
    grid_rotations,
    nearby_rotations,
    rank_translations,
)
from fabfold.voxels.offsets import CellEnergy
from fabfold.voxels.openness import Openness, grids_of_less_openness
from fabfold.voxels.refinement import Refinement
from fabfold.voxels.voxel_files import save_voxels
from fabfold.voxels.voxel_model import Voxels
from fabfold.voxels.voxelize import fill_shares, voxelize

QUICK = {"placements": 12, "shortlist": 4, "results": 3}


def solid_of(mesh: trimesh.Trimesh) -> Solid:
    return Solid("test", np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int32))


def l_shape() -> Solid:
    """Three arms of 10 x 10 x 10 cubes: 4 along x, 3 along y, 2 along z, 7 in all."""
    arms = [
        trimesh.creation.box(bounds=[[0, 0, 0], [40, 10, 10]]),
        trimesh.creation.box(bounds=[[0, 0, 0], [10, 30, 10]]),
        trimesh.creation.box(bounds=[[0, 0, 0], [10, 10, 20]]),
    ]
    return solid_of(trimesh.boolean.union(arms))


def torus() -> Solid:
    return solid_of(trimesh.creation.torus(12.0, 5.0, major_sections=48, minor_sections=24))


def check(voxels: Voxels, template: Template, max_loss: float = 0.1) -> None:
    """Everything that later stages take for granted."""
    n = len(voxels)
    assert 0 < n <= len(template)
    assert np.array_equal(voxels.cells, np.unique(voxels.cells, axis=0))
    assert voxels.cells.min(axis=0).tolist() == [0, 0, 0]
    assert voxels.subvoxels.shape == (n, 20, 20, 20)
    assert np.allclose(voxels.fill, voxels.subvoxels.mean(axis=(1, 2, 3)))
    assert 0.0 <= voxels.lost_volume <= max_loss

    odd = int(parity(voxels.cells).sum())
    ways = [template.colours, template.colours[::-1]]
    assert any(n - odd <= even and odd <= other for even, other in ways)

    found = features(voxels)
    reached = {0}
    for _ in range(n):
        for (i, j), rigid in zip(found.pairs.tolist(), found.rigid, strict=True):
            if rigid and (i in reached or j in reached):
                reached |= {i, j}
    assert len(reached) == n

    mesh = trimesh.Trimesh(voxels.vertices, voxels.faces, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    material = voxels.fill.sum() / (1 - voxels.lost_volume)
    assert material == pytest.approx(mesh_volume(voxels.vertices, voxels.faces), rel=0.02)

    for axis, offsets in enumerate(voxels.plane_offsets):
        assert len(offsets) == voxels.cells[:, axis].max() + 2
        assert np.abs(offsets).max() <= 0.2 + 1e-12
        assert np.abs(np.diff(offsets)).max() <= 0.2 + 1e-12
    assert voxels.energy["fullness"] == pytest.approx((1 - voxels.fill).sum())


def test_a_cube_fills_its_template():
    cube = solid_of(trimesh.creation.box((40, 40, 40)))
    template = load_template("box-4x4x4")
    best = voxelize(cube, template, **QUICK)[0]
    check(best, template)
    assert len(best) == 64
    assert best.fill.min() > 0.99
    assert best.pitch == pytest.approx(10.0)
    assert best.lost_volume == pytest.approx(0.0, abs=1e-9)


def test_an_l_shape_is_cut_into_its_cubes():
    template = Template("seven", l_cells())
    best = voxelize(l_shape(), template, **QUICK)[0]
    check(best, template)
    assert len(best) == 7
    assert best.fill.min() > 0.99
    assert best.pitch == pytest.approx(10.0)
    assert best.lost_volume == pytest.approx(0.0, abs=1e-9)


def l_cells() -> np.ndarray:
    return np.array([[i, 0, 0] for i in range(4)] + [[0, 1, 0], [0, 2, 0], [0, 0, 1]])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["box-3x3x3", "box-3x4x4"])
def test_sphere_and_torus_fit_and_hang_together(name):
    template = load_template(name)
    sphere = solid_of(trimesh.creation.icosphere(subdivisions=3, radius=10.0))
    for solid in (sphere, torus()):
        results = voxelize(solid, template, **QUICK)
        for voxels in results:
            check(voxels, template)
        scores = [voxels.energy["score"] for voxels in results]
        assert scores == sorted(scores, reverse=True)
        assert len(results[0]) >= 0.75 * len(template)


@pytest.mark.slow
def test_results_are_different_and_of_several_sizes():
    template = load_template("box-3x3x3")
    results = voxelize(torus(), template, placements=30, shortlist=12, results=4)
    assert len(results) == 4
    keys = {tuple(np.sort(voxels.fill).tolist()) for voxels in results}
    assert len(keys) == 4
    for voxels in results:
        check(voxels, template)
    # One for each share of the 14 + 13 cells, which are 1, 0.95, 0.9 and 0.85.
    sizes = sorted(len(voxels) for voxels in results)
    most = [int(share * 14) + int(share * 13) for share in fill_shares(27)[::-1]]
    assert most == [22, 23, 25, 27]
    assert all(size <= limit for size, limit in zip(sizes, most, strict=True))


def test_larger_templates_are_left_emptier():
    assert fill_shares(8) == (1.0,)
    assert fill_shares(64) == pytest.approx((1.0, 14 / 15, 13 / 15, 0.8))
    least = [fill_shares(cells)[-1] for cells in (64, 125, 216, 512)]
    assert least == pytest.approx([0.8, 0.75, 0.7, 0.6])


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bytes(tmp_path):
    template = load_template("box-3x3x3")
    for name in ("a", "b"):
        for index, voxels in enumerate(voxelize(torus(), template, seed=5, **QUICK)):
            save_voxels(tmp_path / f"{name}{index}.npz", voxels)
    for index in range(2):
        one, other = (tmp_path / f"{name}{index}.npz" for name in ("a", "b"))
        assert one.read_bytes() == other.read_bytes()


@pytest.mark.slow
def test_size_and_place_of_the_model_do_not_matter():
    template = load_template("box-3x3x3")
    parts = [trimesh.creation.icosphere(subdivisions=3, radius=r) for r in (10.0, 7.0, 5.0)]
    parts[1].apply_translation([11.3, 4.1, 0.7])
    parts[2].apply_translation([-3.1, 2.3, 12.9])
    model = solid_of(trimesh.boolean.union(parts))
    plain = voxelize(model, template, **QUICK)[0]
    for scale, shift in ((1e9, 3e9), (1e-9, 0.0)):
        other = Solid("other", model.vertices * scale + shift, model.faces)
        voxels = voxelize(other, template, **QUICK)[0]
        # Rounding may tip a sample over, so it need not be the very same placement.
        assert abs(len(voxels) - len(plain)) <= 2
        assert voxels.energy["score"] == pytest.approx(plain.energy["score"], rel=0.05)


def test_a_grid_by_hand_is_used_as_it_is():
    template = load_template("box-4x4x4")
    turn = trimesh.transformations.rotation_matrix(0.3, [1, 2, 3])[:3, :3]
    origin = np.array([1.0, 2.0, 0.5])
    voxels = voxelize(
        torus(), template, rotation=turn, origin=origin, pitch=6.5, max_offset=0, max_loss=0.2
    )[0]
    check(voxels, template, 0.2)
    assert voxels.pitch == 6.5
    assert np.array_equal(voxels.rotation, turn)
    steps = (voxels.origin - origin) / 6.5
    assert np.allclose(steps, np.rint(steps), atol=1e-9)
    assert all((offsets == 0).all() for offsets in voxels.plane_offsets)
    lattice = (torus().vertices @ turn.T - voxels.origin) / voxels.pitch
    assert np.allclose(voxels.vertices, lattice, atol=1e-9)


def test_planes_of_a_grid_by_hand_still_move():
    template = load_template("box-4x4x4")
    options = {"rotation": np.eye(3), "origin": (0.0, 0.0, 0.0), "pitch": 6.5, "max_loss": 0.2}
    still = voxelize(torus(), template, max_offset=0, **options)[0]
    moved = voxelize(torus(), template, **options)[0]
    check(moved, template, 0.2)
    assert any((offsets != 0).any() for offsets in moved.plane_offsets)
    cost = [
        v.energy["fullness"] + CellEnergy().loss_cost * v.energy["lost"] for v in (still, moved)
    ]
    assert cost[1] < cost[0]


def test_pitch_alone_or_origin_alone_can_be_given():
    template = load_template("box-4x4x4")
    for voxels in voxelize(torus(), template, pitch=7.0, **QUICK):
        check(voxels, template)
        assert voxels.pitch == 7.0
    found = voxelize(torus(), template, origin=(1.0, 0.0, 0.0), **QUICK)[0]
    check(found, template)
    assert np.array_equal(found.rotation, np.eye(3))
    steps = (found.origin - np.array([1.0, 0.0, 0.0])) / found.pitch
    assert np.allclose(steps, np.rint(steps), atol=1e-9)


def test_small_islands_are_lost_not_kept():
    # Two balls on a wire far too thin to hold them together.
    parts = [
        trimesh.creation.icosphere(subdivisions=3, radius=10.0),
        trimesh.creation.icosphere(subdivisions=2, radius=3.0),
        trimesh.creation.cylinder(radius=0.2, segment=[[0, 0, 0], [20, 0, 0]], sections=12),
    ]
    parts[1].apply_translation([20, 0, 0])
    template = load_template("box-3x3x3")
    best = voxelize(solid_of(trimesh.boolean.union(parts)), template, **QUICK)[0]
    check(best, template)
    assert best.lost_volume > 0.015  # the small ball is 2.6 % of the volume


@pytest.mark.slow
def test_thin_things_end_with_a_clear_error():
    template = load_template("box-4x4x4")
    plate = solid_of(trimesh.creation.box((100, 100, 0.01)))
    with pytest.raises(NoVoxelsError, match="too thin"):
        voxelize(plate, template)
    needle = solid_of(trimesh.creation.box((1e6, 1, 1)))
    with pytest.raises(NoVoxelsError, match="too thin"):
        voxelize(needle, template)


@pytest.mark.slow
def test_a_pitch_that_cannot_fit_says_how_many_cells_there_are():
    template = load_template("box-2x2x2")
    cube = solid_of(trimesh.creation.box((40, 40, 40)))
    with pytest.raises(NoVoxelsError, match=r"box-2x2x2.*4 \+ 4.*cells, \d+ of them too many"):
        voxelize(cube, template, pitch=10.0, **QUICK)
    with pytest.raises(NoVoxelsError, match="raise pitch"):
        voxelize(cube, template, pitch=0.5, **QUICK)
    with pytest.raises(NoVoxelsError, match="lower pitch"):
        voxelize(cube, template, pitch=1000.0, **QUICK)


@pytest.mark.parametrize(
    "option",
    [
        {"rotation": np.diag([1.0, 1.0, -1.0])},
        {"rotation": np.full((3, 3), 0.5)},
        {"rotation": np.eye(2)},
        {"origin": (0.0, np.nan, 0.0)},
        {"pitch": 0.0},
        {"pitch": float("inf")},
        {"drop_below": 0.7},
        {"max_offset": 5},
        {"max_loss": -0.1},
        {"placements": 0},
    ],
)
def test_options_that_cannot_be_used_are_refused(option):
    with pytest.raises(RecipeError):
        voxelize(torus(), load_template("box-3x3x3"), **option)


def test_rotations_are_proper_seeded_and_turn_about_each_axis():
    vertices = torus().vertices
    rotations = grid_rotations(30, 1, vertices)
    assert np.allclose(rotations @ rotations.transpose(0, 2, 1), np.eye(3))
    assert np.allclose(np.linalg.det(rotations), 1.0)
    assert np.array_equal(rotations[0], np.eye(3))
    for axis in range(3):
        assert np.isclose(rotations[:, axis, axis], 1.0).sum() >= 4
    assert np.array_equal(rotations, grid_rotations(30, 1, vertices))
    assert not np.allclose(rotations[2:], grid_rotations(30, 2, vertices)[2:])


def test_nearby_rotations_are_small_turns():
    given = grid_rotations(5, 1, torus().vertices)
    turned = nearby_rotations(given, 12, 1, 4.0)
    assert np.allclose(turned @ turned.transpose(0, 2, 1), np.eye(3))
    for index, rotation in enumerate(turned):
        cosine = (np.trace(rotation @ given[index % 5].T) - 1) / 2
        assert 0 < np.degrees(np.arccos(np.clip(cosine, -1, 1))) < 25
    assert np.array_equal(turned, nearby_rotations(given, 12, 1, 4.0))


def test_judge_drops_crumbs_islands_and_surplus_colour():
    fills = np.zeros((6, 1, 1))
    fills[:, 0, 0] = [1.0, 0.9, 0.02, 0.0, 0.5, 0.05]
    fit = grid_fit(fills, CellEnergy(), Capacity(4, (2, 2)))
    assert (fit.kept, fit.slivers, fit.excess) == (2, 0, 0)
    assert fit.fill == pytest.approx(1.9)
    assert fit.lost == pytest.approx(0.57)
    assert fit.fills.tolist() == [0.9, 1.0]
    # Three cells, two of one colour, one place for it: the small end cell goes.
    row = np.array([0.8, 0.9, 0.12]).reshape(3, 1, 1)
    fit = grid_fit(row, CellEnergy(), Capacity(2, (1, 1)))
    assert (fit.kept, fit.excess) == (2, 0)
    # Nothing small enough to go: too many.
    row = np.array([0.8, 0.9, 0.3]).reshape(3, 1, 1)
    assert grid_fit(row, CellEnergy(), Capacity(2, (1, 1))).excess == 1


def test_ranked_translations_agree_with_judge():
    vertices = np.asarray(torus().vertices)
    low = vertices.min(axis=0)
    table = summed_volume(vertices - low, torus().faces, (34, 34, 10))
    capacity = Capacity(64, (32, 32))
    rows = rank_translations(table, 8.0, 2, CellEnergy(), capacity)
    assert rows.shape == (8, 4)
    grid = np.zeros((48, 48, 24))
    full = np.diff(np.diff(np.diff(table, axis=0), axis=1), axis=2)
    for row, shift in enumerate(np.ndindex(2, 2, 2)):
        grid[:] = 0
        x, y, z = (4 * step for step in shift)
        grid[x : x + 34, y : y + 34, z : z + 10] = full
        fills = grid.reshape(6, 8, 6, 8, 3, 8).mean(axis=(1, 3, 5))
        fit = grid_fit(fills, CellEnergy(), capacity)
        assert rows[row, 1] == fit.kept
        assert rows[row, 2] == fit.excess
        assert rows[row, 3] == pytest.approx(fit.lost / (fit.lost + fit.fill))


@pytest.fixture(scope="module")
def judged():
    """A torus cut by its openness, and every grid that was judged, with its openness."""
    template = load_template("box-3x3x2")
    seen = {}

    def open_faces(cells, depth):
        least = ClosingBound(template, "S").open_faces(cells, depth)
        seen[cells.tobytes(), depth.tobytes()] = least
        return least

    found = voxelize(torus(), template, placements=6, shortlist=3, results=2, open_faces=open_faces)
    return template, found, seen


@pytest.mark.slow
def test_voxels_of_the_least_openness_are_taken(judged):
    template, found, seen = judged
    assert len(found) == 2 < len(seen)
    bound = ClosingBound(template, "S")
    openness = []
    for voxels in found:
        least = bound.open_faces(voxels.cells, features(voxels).depth)
        lost = voxels.lost_volume * voxels.energy["fill"] / (1 - voxels.lost_volume)
        openness.append(least + len(voxels) - voxels.energy["fill"] + 4 * lost)
    # They were judged by half as many samples along a cell, so a few hundredths of a face are off.
    assert openness[0] < openness[1] + 0.5
    fullest = voxelize(torus(), template, placements=6, shortlist=3, results=2)
    for voxels in fullest:
        least = bound.open_faces(voxels.cells, features(voxels).depth)
        assert openness[0] < least + len(voxels) - voxels.energy["fill"] + 0.5


def test_what_is_judged_before_a_cut_is_what_the_cut_has():
    template = load_template("box-3x3x2")
    solid = torus()
    rotations = grid_rotations(2, 1, solid.vertices)
    energy = CellEnergy()
    search = Refinement(solid, np.eye(3), template, rotations, energy, 4)
    pitch, _ = search.pilot(0.1, 2)
    (item, *_) = search.rank(np.array([pitch]), 0, 1, SilentProgress())
    grids = [
        grid for grid in search.refine(item, (20, 22), False, depth=True) if not grid.fit.excess
    ]
    assert grids
    for grid in grids:
        voxels, kept, _ = search.cut(grid)
        assert kept == len(grid.fit.cells) == len(grid.depth)
        assert np.array_equal(voxels.cells, grid.fit.cells - grid.fit.cells.min(axis=0))
        exact = features(voxels).depth
        assert np.abs(grid.depth - exact).mean() < 0.02
        assert np.abs(grid.depth - exact).max() < 0.25
    assert all(grid.depth is None for grid in search.refine(item, (20,), False))


@pytest.mark.slow
def test_turning_grids_a_little_never_ends_worse():
    template = load_template("box-3x3x2")
    solid = torus()
    rotations = grid_rotations(4, 1, solid.vertices)
    searches = []
    for _ in range(2):
        search = Refinement(solid, np.eye(3), template, rotations, CellEnergy(), 4)
        pitch, _ = search.pilot(0.1, 4)
        ranked = search.rank(np.array([pitch]), 0, 1, SilentProgress())
        grids = [
            grid
            for item in ranked
            for grid in search.refine(item, (20,), False, depth=True)
            if not grid.fit.excess
        ]
        # As few open faces as possible, whatever else.
        openness = Openness(ClosingBound(template, "S").open_faces)
        better = grids_of_less_openness(search, grids, openness, 5)
        assert better == sorted(better, key=openness)
        assert min(map(openness, better)) < min(map(openness, grids))
        assert all(grid.fit.excess == 0 and grid.rotation >= 4 for grid in better)
        assert set(search.family) <= set(range(4))
        searches.append([(grid.rotation, openness(grid)) for grid in better])
    assert searches[0] == searches[1]
