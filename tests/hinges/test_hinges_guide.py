"""The page beside a coupon: its drawing and its bytes."""

import numpy as np
import pytest
from build123d import Box, Cylinder, Part, Pos

from hinges import write_coupon
from hinges.guide import projected_edges, write_guide


def extent(lines):
    points = np.concatenate(lines)
    return points.max(axis=0) - points.min(axis=0)


def test_a_box_shows_three_of_its_faces():
    lines = projected_edges(Box(10.0, 20.0, 30.0), (100.0, 100.0, 100.0))
    assert len(lines) == 9  # of twelve edges, the three at the far corner are hidden
    # seen along (1, 1, 1) a length along x or y keeps sqrt(1/2) across, and one along z sqrt(2/3)
    assert extent(lines)[0] == pytest.approx(30.0 / 2**0.5)
    assert extent(lines)[1] == pytest.approx(30.0 * (2 / 3) ** 0.5 + 30.0 / 6**0.5)


def test_a_curve_is_followed():
    lines = projected_edges(Cylinder(5.0, 8.0), (0.0, 0.0, 100.0), up=(0.0, 1.0, 0.0))
    points = np.concatenate(lines)
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 5.0, atol=1e-6)
    around = np.sort(np.unwrap(np.sort(np.arctan2(points[:, 1], points[:, 0]))))
    assert np.diff(around).max() * 5.0 < 0.6


def test_what_stands_in_front_hides_what_lies_behind():
    behind = Box(4.0, 4.0, 4.0)
    front = Pos(0.0, -20.0, 0.0) * Box(40.0, 4.0, 40.0)
    lines = projected_edges(Part([behind.solid(), front.solid()]), (0.0, -100.0, 0.0))
    assert len(lines) == 4
    np.testing.assert_allclose(extent(lines), (40.0, 40.0))


def test_one_page_of_the_same_bytes_every_time(tmp_path):
    pages = [tmp_path / "one.pdf", tmp_path / "two.pdf"]
    for page in pages:
        write_guide(page, (0.2, 0.3), Box(60.0, 30.0, 4.0), "Coupon for fdm-pla-0.4")
    assert pages[0].read_bytes() == pages[1].read_bytes()
    assert pages[0].read_bytes().startswith(b"%PDF")
    assert pages[0].read_bytes().count(b"/Type /Page\n") == 1


@pytest.mark.slow
def test_it_lies_beside_the_coupon(tmp_path):
    written = write_coupon(tmp_path / "mine.stl", (0.2, 0.35), title="Coupon for fdm-pla-0.4")
    assert written == [tmp_path / "mine.stl", tmp_path / "mine-guide.pdf"]
    assert sorted(tmp_path.iterdir()) == sorted(written)  # no half-written file is left
    assert written[1].read_bytes().startswith(b"%PDF")
