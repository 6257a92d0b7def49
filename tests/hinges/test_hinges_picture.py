"""The pictures' renderer."""

import numpy as np
import pytest
from build123d import Box, Pos

from hinges import HingeError
from hinges.picture import PALETTE, Body, Camera, bodies_of, render, save, sheet


def test_axes_are_right_handed():
    for camera in (Camera(), Camera(10, 80), Camera(30, -20, up=(0, 1, 0)), Camera(up=(1, 0, 0))):
        axes = camera.axes()
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(axes) == pytest.approx(1.0)


def test_nearer_bodies_hide_farther_ones():
    near, far = Pos(0, 0, 10) * Box(4, 4, 1), Box(20, 20, 1)
    pixels = np.array(render(bodies_of([far, near]), (100, 100), Camera(-90, 90)))
    middle, edge = pixels[50, 50].astype(int), pixels[50, 12].astype(int)
    assert middle[0] > middle[2]  # the second colour is orange, the first blue
    assert edge[2] > edge[0]
    assert (pixels[0, 0] == 255).all()
    assert PALETTE[0] != PALETTE[1]


def test_the_same_picture_every_time(tmp_path):
    body = Body(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]]), (1, 0, 0))
    one, other = (render([body], (60, 40), Camera(-90, 60)) for _ in range(2))
    assert one.tobytes() == other.tobytes()
    page = sheet([one, other], ["a", "b"], columns=2)
    assert page.size == (120, 66)
    save(page, tmp_path / "page.png")
    assert (tmp_path / "page.png").stat().st_size > 100
    with pytest.raises(HingeError, match="nothing to draw"):
        render([])
