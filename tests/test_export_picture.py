"""Pictures: what is where, in which colour, and the same bytes every time."""

from __future__ import annotations

import hashlib
import io
import subprocess
import sys
from pathlib import Path

import manifold3d as m3
import numpy as np
import pytest
from export_kits import row_joinery, row_motion, row_tree
from PIL import Image

from fabfold.errors import RecipeError
from fabfold.export.camera import View
from fabfold.export.colours import body_colours
from fabfold.export.kit_picture import halfway, picture_of_kit, strip, write_strip
from fabfold.export.render import _whole_pixels, png_bytes, render
from fabfold.fold.motion import Motion

SMALL = View(size=(120, 90), samples=1, lights=6)


def _mesh(solid: m3.Manifold) -> tuple[np.ndarray, np.ndarray]:
    mesh = solid.to_mesh64()
    return np.array(mesh.vert_properties[:, :3]), np.array(mesh.tri_verts, dtype=np.int32)


def _inked(image: np.ndarray) -> np.ndarray:
    """Pixels with a colour of their own: the page and its shadow are grey."""
    return np.ptp(image.astype(int), axis=2) > 25


def _red(view: View, solid: m3.Manifold, **options) -> np.ndarray:
    return _inked(render([_mesh(solid)], np.array([[220, 40, 40]], np.uint8), view=view, **options))


def test_a_ball_is_a_disc_that_fills_the_frame():
    view = View(size=(200, 200), samples=2, lights=6, margin=0.1, ground=False)
    inked = _red(view, m3.Manifold.sphere(5, 128))
    rows, columns = np.nonzero(inked)
    assert columns.min() == pytest.approx(20, abs=2) and columns.max() == pytest.approx(179, abs=2)
    assert rows.min() == pytest.approx(20, abs=2) and rows.max() == pytest.approx(179, abs=2)
    assert inked.sum() == pytest.approx(np.pi * 80**2, rel=0.02)


def test_a_wide_block_fills_the_width():
    view = View(size=(300, 100), samples=1, lights=4, margin=0.05, ground=False, elevation_deg=0)
    inked = _red(view, m3.Manifold.cube((100, 2, 10), True).rotate((0, 0, 30)))
    rows, columns = np.nonzero(inked)
    assert columns.min() == pytest.approx(15, abs=2)
    assert columns.max() == pytest.approx(284, abs=2)
    assert rows.min() > 0 and rows.max() < 99


def test_a_part_of_a_picture_is_what_the_whole_shows_there():
    view = View(size=(200, 160), samples=2, lights=6, ground=False)
    ball, block = m3.Manifold.sphere(5, 64), m3.Manifold.cube((4, 4, 14), True)
    meshes, colours = [_mesh(ball.translate((6, 0, 0))), _mesh(block)], np.eye(3, dtype=np.uint8)
    whole = render(meshes, 200 * colours[:2], view=view).astype(int)
    part = render(meshes, 200 * colours[:2], view=view, only=(70, 30, 150, 110)).astype(int)
    here = np.zeros(whole.shape[:2], dtype=bool)
    here[30:110, 70:150] = True
    assert (part[~here] == 255).all()
    # Lookups of shadows scatter in another order, and lines at the rim miss their other side.
    assert np.abs(part - whole)[31:109, 71:149].mean() < 1.0
    inked = _inked(whole) & here
    assert inked.sum() > 3000
    assert (_inked(part) == inked)[31:109, 71:149].mean() > 0.995


@pytest.mark.parametrize("samples", [2, 3])
def test_light_found_once_a_pixel_is_that_of_its_samples(monkeypatch, samples):
    meshes = [_mesh(m3.Manifold.sphere(5, 64)), _mesh(m3.Manifold.cube((9, 3, 3), True))]
    colours = np.array([[220, 40, 40], [40, 90, 220]], np.uint8)
    view = View(size=(160, 120), samples=samples, lights=8)
    wholes = []

    def whole_pixels(*arguments):
        wholes.append(_whole_pixels(*arguments))
        return wholes[-1]

    monkeypatch.setattr("fabfold.export.render._whole_pixels", whole_pixels)
    once = render(meshes, colours, view=view).astype(int)
    model = _inked(once)
    assert 0.6 < wholes[0].sum() / model.sum() < 1.0, "all but outlines and creases"
    none = lambda triangle, *_: np.zeros([side // samples for side in triangle.shape], bool)  # noqa: E731
    monkeypatch.setattr("fabfold.export.render._whole_pixels", none)
    each = render(meshes, colours, view=view).astype(int)
    apart = np.abs(once - each).max(axis=2)
    # Lookups in shadow maps are scattered at random, so the two differ a little everywhere.
    assert apart.mean() < 0.5
    assert (apart > 20).sum() < 0.01 * model.sum(), "where the rim of a shadow crosses a pixel"


def test_the_nearer_mesh_hides_the_farther():
    cube = m3.Manifold.cube((2, 2, 2), True)
    view = View(size=(80, 80), samples=1, lights=4, azimuth_deg=0, elevation_deg=5, ground=False)
    poses = np.tile(np.eye(4), (2, 1, 1))
    poses[1, 0, 3] = 3.0  # towards the camera
    colours = np.array([[220, 30, 30], [30, 30, 220]], np.uint8)
    middle = render([_mesh(cube), _mesh(cube)], colours, poses, view)[40, 40].astype(int)
    assert middle[2] > middle[0] + 50
    poses[1, 0, 3] = -3.0
    middle = render([_mesh(cube), _mesh(cube)], colours, poses, view)[40, 40].astype(int)
    assert middle[0] > middle[2] + 50


def test_the_ground_is_darker_beside_the_model_and_white_at_the_rim():
    view = View(size=(160, 120), samples=1, lights=16, margin=0.25)
    image = render(
        [_mesh(m3.Manifold.cube((2, 2, 2)))], np.array([[200, 60, 60]], np.uint8), view=view
    )
    page = ~_inked(image)
    assert image[page].min() < 200
    assert (image[[0, -1]] == 255).all() and (image[:, [0, -1]] == 255).all()
    bare = render(
        [_mesh(m3.Manifold.cube((2, 2, 2)))],
        np.array([[200, 60, 60]], np.uint8),
        view=View(size=(160, 120), samples=1, lights=16, margin=0.25, ground=False, edges=0),
    )
    assert (bare[0] == 255).all()


def test_a_hollow_is_darker_than_an_open_face():
    plate = m3.Manifold.cube((10, 10, 4), True)
    pit = plate - m3.Manifold.cube((3, 3, 3.8), True).translate((0, 0, 1))
    view = View(size=(90, 90), samples=1, lights=24, elevation_deg=88, ground=False, edges=0)
    colours = np.array([[180, 180, 180]], np.uint8)
    image = render([_mesh(pit)], colours, view=view)
    assert int(image[45, 45, 0]) < int(image[45, 15, 0]) - 15


def test_every_body_of_a_kit_shows_in_its_colour():
    tree = row_tree()
    joinery = row_joinery(tree)
    colours = body_colours(tree)
    image = picture_of_kit(joinery, tree, None, View(size=(200, 120), samples=1, lights=8))
    seen = image[_inked(image)].astype(float)
    seen /= seen.sum(axis=1, keepdims=True)
    for colour in colours.astype(float):
        close = np.linalg.norm(seen - colour / colour.sum(), axis=1) < 0.06
        assert close.sum() > 100


def test_a_folded_kit_is_smaller_than_the_model():
    tree = row_tree()
    joinery, motion = row_joinery(tree), row_motion(tree)
    far = {"distance": 600.0}
    spread = _inked(picture_of_kit(joinery, tree, None, SMALL, **far))
    folded = _inked(picture_of_kit(joinery, tree, motion.angles_deg[-1], SMALL, **far))
    assert np.ptp(np.nonzero(folded)[1]) < 0.7 * np.ptp(np.nonzero(spread)[1])


def test_strip_has_three_parts_of_one_height(tmp_path):
    tree = row_tree()
    joinery, motion = row_joinery(tree), row_motion(tree)
    image = strip(joinery, tree, motion, SMALL)
    assert image.shape[0] == 90
    columns = _inked(image).any(axis=0)
    assert (np.diff(columns.astype(int)) == 1).sum() == 3
    write_strip(tmp_path / "fold.png", joinery, tree, motion, SMALL, upright=np.eye(3))
    assert (tmp_path / "fold.png").read_bytes() == png_bytes(image)


def test_upright_turns_the_picture():
    tree = row_tree()
    joinery = row_joinery(tree)
    up = np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]])
    flat = np.nonzero(_inked(picture_of_kit(joinery, tree, None, SMALL)))
    stood = np.nonzero(_inked(picture_of_kit(joinery, tree, None, SMALL, upright=up)))
    assert np.ptp(flat[1]) > np.ptp(flat[0])
    assert np.ptp(stood[0]) > np.ptp(stood[1])


def test_halfway_is_between_keyframes():
    motion = Motion(("a", "b"), np.array([[0.0, 0], [180, 0], [180, -90]]), ((), (0,), (1,)))
    assert halfway(motion).tolist() == [135.0, 0.0]
    still = Motion(("a",), np.zeros((1, 1)), ((),))
    assert halfway(still).tolist() == [0.0]


def test_png_reads_back():
    image = np.random.default_rng(0).integers(0, 256, (13, 17, 3), dtype=np.uint8)
    assert np.array_equal(np.asarray(Image.open(io.BytesIO(png_bytes(image)))), image)


def test_bad_views_are_refused():
    with pytest.raises(RecipeError, match="sizes"):
        View(size=(4, 4))
    with pytest.raises(RecipeError, match="margin"):
        View(margin=0.5)
    with pytest.raises(RecipeError, match="triangle"):
        render([], np.zeros((0, 3), np.uint8))


_DRAW = """
import sys
sys.path.insert(0, sys.argv[1])
import hashlib
from test_export_picture import ball_and_block, png_bytes
print(hashlib.sha256(png_bytes(ball_and_block())).hexdigest())
"""


def ball_and_block() -> np.ndarray:
    solid = m3.Manifold.sphere(3, 32) + m3.Manifold.cube((4, 2, 2))
    return render([_mesh(solid)], np.array([[143, 169, 196]], np.uint8), view=SMALL)


@pytest.mark.slow
def test_another_process_draws_the_same_bytes():
    found = subprocess.run(
        [sys.executable, "-c", _DRAW, str(Path(__file__).parent)],
        check=True,
        capture_output=True,
        encoding="utf-8",
    ).stdout.strip()
    assert found == hashlib.sha256(png_bytes(ball_and_block())).hexdigest()
