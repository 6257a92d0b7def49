"""The page beside a coupon: its drawing and its bytes."""

import numpy as np
import pytest
from manifold3d import Manifold

from hinges import write_coupon
from hinges.guide import write_guide
from hinges.hidden_lines import visible_edges
from hinges.shape_meshes import mesh_part


def box(*size):
    return Manifold.cube(size, True)


def extent(lines):
    points = np.concatenate(lines)
    return points.max(axis=0) - points.min(axis=0)


def length(lines):
    return sum(np.linalg.norm(line[1] - line[0]) for line in lines)


def test_a_box_shows_three_of_its_faces():
    lines = visible_edges([mesh_part(box(10.0, 20.0, 30.0))], (100.0, 100.0, 100.0))
    assert len(lines) == 9  # of twelve edges, the three at the far corner are hidden
    # seen along (1, 1, 1) a length along x or y keeps sqrt(1/2) across, and one along z sqrt(2/3)
    assert extent(lines)[0] == pytest.approx(30.0 / 2**0.5)
    assert extent(lines)[1] == pytest.approx(30.0 * (2 / 3) ** 0.5 + 30.0 / 6**0.5)


def test_a_round_body_shows_its_rim_and_its_outline():
    made = mesh_part(Manifold.cylinder(8.0, 5.0, 5.0, 64))
    above = visible_edges([made], (0.0, 0.0, 100.0), up=(0.0, 1.0, 0.0))
    np.testing.assert_allclose(np.linalg.norm(np.concatenate(above), axis=1), 5.0, atol=1e-6)
    assert length(above) == pytest.approx(2.0 * np.pi * 5.0, rel=1e-3)
    aside = visible_edges([made], (0.0, -100.0, 100.0))
    rim = length(above) / 2**0.5  # both ellipses are shorter than their circles, one is half hidden
    assert len(aside) == 64 + 32 + 2
    assert rim < length(aside) < 2.0 * np.pi * 5.0 * 1.5 + 2.0 * 8.0


def test_what_stands_in_front_hides_what_lies_behind():
    behind = mesh_part(box(4.0, 4.0, 4.0))
    front = mesh_part(box(40.0, 4.0, 40.0).translate((0.0, -20.0, 0.0)))
    lines = visible_edges([behind, front], (0.0, -100.0, 0.0))
    assert len(lines) == 4
    np.testing.assert_allclose(extent(lines), (40.0, 40.0))


def test_a_line_ends_where_something_stands_before_it():
    long = mesh_part(box(40.0, 2.0, 2.0))
    post = mesh_part(box(4.0, 2.0, 20.0).translate((0.0, -10.0, 0.0)))
    lines = visible_edges([long, post], (0.0, -100.0, 0.0))
    # The post has four lines; two of the bar's are cut into two of 18 mm each, two are its ends.
    assert len(lines) == 4 + 4 + 2
    assert length(lines) == pytest.approx(2 * (4.0 + 20.0) + 4 * 18.0 + 2 * 2.0)


def test_one_page_of_the_same_bytes_every_time(tmp_path):
    pages = [tmp_path / "one.pdf", tmp_path / "two.pdf"]
    for page in pages:
        write_guide(page, (0.2, 0.3), [mesh_part(box(60.0, 30.0, 4.0))], "fdm-pla-0.4")
    assert pages[0].read_bytes() == pages[1].read_bytes()
    assert pages[0].read_bytes().startswith(b"%PDF")
    assert pages[0].read_bytes().count(b"/Type /Page\n") == 1


@pytest.mark.slow
def test_the_page_of_a_whole_coupon_is_one(tmp_path):
    _, page = write_coupon(tmp_path / "whole.stl", title="Hinge coupon, fdm-pla-0.4")
    assert page.read_bytes().count(b"/Type /Page\n") == 1


@pytest.mark.slow
def test_it_lies_beside_the_coupon(tmp_path):
    written = write_coupon(tmp_path / "mine.stl", (0.2, 0.35), title="Coupon for fdm-pla-0.4")
    assert written == [tmp_path / "mine.stl", tmp_path / "mine-guide.pdf"]
    assert sorted(tmp_path.iterdir()) == sorted(written)  # no half-written file is left
    assert written[1].read_bytes().startswith(b"%PDF")
