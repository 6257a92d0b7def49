"""Triangles that really cross, told from those that only lie beside each other."""

from __future__ import annotations

import numpy as np
import pytest

from fabfold.solid.crossing import really_crossing

FLAT = [(0.0, 0, 0), (4, 0, 0), (0, 4, 0)]


def _crossing(one: list, two: list, common: int = 0) -> int:
    """How many of two triangles cross, the first corners of which are common."""
    faces = np.array([[0, 1, 2], [*range(common), *range(3, 6 - common)]])
    vertices = np.array([*one, *two[common:]], dtype=float)
    turned = faces[:, [1, 2, 0]]
    found = really_crossing(vertices, faces, np.arange(2))
    assert len(really_crossing(vertices, turned[::-1], np.arange(2))) == len(found)
    return len(found)


@pytest.mark.parametrize(
    ("two", "common", "crosses"),
    [
        ([(1, 1, -1), (1, 1, 1), (1, 2, 1)], 0, True),  # through the face
        ([(1, 1, 0), (1, 1, 1), (1, 2, 1)], 0, True),  # a corner on the face
        ([(1, 1, 1e-9), (1, 1, 1), (1, 2, 1)], 0, False),  # just above it
        ([(3, 3, -1), (3, 3, 1), (4, 4, 1)], 0, False),  # past its edge
        ([(1, 1, 0), (2, 1, 0), (1, 2, 0)], 0, True),  # in its plane, inside
        ([(1, 1, 0), (9, 1, 0), (1, 9, 0)], 0, True),  # in its plane, over its edge
        ([(3, 3, 0), (4, 4, 0), (3, 5, 0)], 0, False),  # in its plane, beside it
        ([(0, 0, 0), (1, 1, -1), (1, 1, 1)], 1, True),  # a common corner, and through the face
        ([(0, 0, 0), (-1, -1, -1), (-1, -1, 1)], 1, False),
        ([(0, 0, 0), (1, 1, 0), (2, 1, 0)], 1, True),  # a common corner, one on the other
        ([(0, 0, 0), (4, 0, 0), (1, 1, 0)], 2, True),  # folded flat along a common edge
        ([(0, 0, 0), (4, 0, 0), (1, -1, 0)], 2, False),
        ([(0, 0, 0), (4, 0, 0), (1, 1, 1e-12)], 2, False),
        (FLAT, 3, True),
    ],
)
def test_what_meets_beyond_common_corners_crosses(two, common, crosses):
    assert _crossing(FLAT, two, common) == (2 if crosses else 0)


def test_triangles_beside_each_other_in_a_slanted_plane_do_not_cross():
    """Of a body of a kit: MeshLab took these three for crossing, or not, from run to run."""
    vertices = np.array(
        [
            (116.0, 40.0, 46.0),
            (114.4972915649414, 38.48520278930664, 44.48520278930664),
            (117.54803466796875, 39.51227569580078, 45.51227569580078),
            (117.69029998779297, 39.04329299926758, 45.04329299926758),
            (116.15502166748047, 37.383949279785156, 43.383949279785156),
            (117.79519653320312, 38.82150650024414, 44.82150650024414),
            (117.8050537109375, 38.805057525634766, 44.805057525634766),
        ]
    )
    faces = np.array([[0, 1, 2], [3, 4, 5], [5, 4, 6]])
    assert len(really_crossing(vertices, faces, np.arange(3))) == 0
    # Moved along the plane by its own width the first lies on the others.
    moved = vertices.copy()
    moved[:3] += (0.5, -1.0, -1.0)
    assert len(really_crossing(moved, faces, np.arange(3))) == 3


def test_it_agrees_with_what_floats_say_of_triangles_in_general_position():
    rng = np.random.default_rng(5)
    crossing = 0
    for _ in range(300):
        one, two = rng.normal(size=(3, 3)), rng.normal(size=(3, 3))
        found = _crossing(one.tolist(), two.tolist())
        hit = False
        for tri, other in ((one, two), (two, one)):
            for k in range(3):
                start, way = other[k], other[(k + 1) % 3] - other[k]
                matrix = np.stack([tri[1] - tri[0], tri[2] - tri[0], -way], axis=1)
                u, v, t = np.linalg.solve(matrix, start - tri[0])
                hit |= u >= 0 and v >= 0 and u + v <= 1 and 0 <= t <= 1
        assert found == (2 if hit else 0)
        crossing += hit
    assert 40 < crossing < 260
