from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tree_cases import solid_problem, strip

from fabfold.fold.lattice_foldability import LatticeFoldability
from fabfold.tree.effort import Effort
from fabfold.tree.fold_tree import Body, Edge, FoldTree
from fabfold.tree.kinematics_check import check_tree
from fabfold.tree.solve import solve

QUICK = Effort(polish_best=50, restarts=10)


@pytest.fixture(scope="module")
def tree():
    problem = solid_problem(strip(8), "box-2x2x2")
    return solve(problem, 0, LatticeFoldability(), QUICK)[0].tree


def with_hinge(tree, index, **changes):
    hinges = list(tree.hinges)
    hinges[index] = replace(hinges[index], **changes)
    return replace(tree, hinges=tuple(hinges))


def test_a_sound_tree_passes(tree):
    assert check_tree(tree) == []
    again = FoldTree.from_json(tree.to_json(20.0, (0.0, 0.0, 0.0)))
    assert check_tree(again) == []


def test_shared_cells(tree):
    target = tree.target.copy()
    target[0] = target[1]
    assert any("share target cell" in text for text in check_tree(replace(tree, target=target)))
    source = tree.source.copy()
    source[0] = source[1]
    assert any("share source cell" in text for text in check_tree(replace(tree, source=source)))


def test_target_outside_the_template(tree):
    assert any(
        "outside template" in text for text in check_tree(replace(tree, target=tree.target + 1))
    )


def test_wrong_target_and_orientation(tree):
    swapped = tree.target[::-1].copy()
    assert any("folds to" in text for text in check_tree(replace(tree, target=swapped)))
    turned = np.roll(tree.orientation, 1, axis=1)
    found = check_tree(replace(tree, orientation=turned))
    assert any("another orientation" in text for text in found)


def test_wrong_root_pose(tree):
    moved = replace(tree, root_translation=tree.root_translation + np.array([0, 0, 1]))
    assert any("folds to" in text for text in check_tree(moved))


def test_edges_that_do_not_span(tree):
    assert any("spanning" in text for text in check_tree(replace(tree, edges=tree.edges[:-1])))
    last = tree.edges[-1]
    far = next(v for v in range(8) if np.abs(tree.source[v] - tree.source[last.parent]).sum() > 1)
    wrong = (*tree.edges[:-1], replace(last, child=far))
    assert any("share no face" in text for text in check_tree(replace(tree, edges=wrong)))
    unknown = (*tree.edges[:-1], replace(last, child=99))
    assert any("no such voxel" in text for text in check_tree(replace(tree, edges=unknown)))


def test_edge_types(tree):
    rigid = next(i for i, e in enumerate(tree.edges) if e.kind == "R")
    edges = list(tree.edges)
    edges[rigid] = Edge(edges[rigid].parent, edges[rigid].child, "X")
    assert any("unknown type" in text for text in check_tree(replace(tree, edges=tuple(edges))))
    edges[rigid] = Edge(edges[rigid].parent, edges[rigid].child, "S")
    assert any("0 hinges" in text for text in check_tree(replace(tree, edges=tuple(edges))))


def test_hinge_off_the_shared_face(tree):
    hinge = tree.hinges[0]
    x, y, z = hinge.point
    along = np.array(hinge.direction)
    moved = with_hinge(tree, 0, point=tuple((np.array([x, y, z]) + along).tolist()))
    assert any("no edge of the face" in text for text in check_tree(moved))
    middle = with_hinge(tree, 0, point=tuple(float(round(value)) for value in (x, y, z)))
    assert any("no edge of the face" in text for text in check_tree(middle))


def test_hinge_fields(tree):
    assert any("quarter turn" in t for t in check_tree(with_hinge(tree, 0, angle_deg=45.0)))
    assert any("folds to" in t for t in check_tree(with_hinge(tree, 0, angle_deg=90.0)))
    back = tuple(-x for x in tree.hinges[0].direction)
    assert any("direction" in t for t in check_tree(with_hinge(tree, 0, direction=back)))
    assert any("must carry" in t for t in check_tree(with_hinge(tree, 0, child=2)))
    assert any("must carry" in t for t in check_tree(with_hinge(tree, 0, parent=3)))
    name = tree.hinges[1].name
    assert any("not unique" in t for t in check_tree(with_hinge(tree, 0, name=name)))
    found = check_tree(replace(tree, hinges=tree.hinges[:-1]))
    assert any("every hinge exactly once" in t for t in found)
    more = (*tree.bodies, Body("body-99", ()))
    assert any("what R edges join" in t for t in check_tree(replace(tree, bodies=more)))


def test_bodies(tree):
    bodies = list(tree.bodies)
    a, b = bodies[0], bodies[1]
    bodies[0] = Body(a.name, a.voxels[1:])
    bodies[1] = Body(b.name, (*b.voxels, a.voxels[0]))
    assert any("R edges join" in t for t in check_tree(replace(tree, bodies=tuple(bodies))))
    bodies[1] = b
    assert any("exactly once" in t for t in check_tree(replace(tree, bodies=tuple(bodies))))


def test_two_hinges_on_one_lattice_edge(tree):
    # 2 x 2 cells around one edge: both hinges stand on it in A, and the rest is consistent.
    source = np.array([[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0]], dtype=np.int32)
    hinge = tree.hinges[0]
    hinges = tuple(
        replace(hinge, name=f"hinge-0{i}", parent=i, child=i + 1, point=(0.5, 0.5, 0.0),
                direction=(0, 0, 1), angle_deg=angle)
        for i, angle in enumerate((180.0, 180.0))
    )  # fmt: skip
    edges = (Edge(0, 1, "S", (0,)), Edge(1, 3, "S", (1,)), Edge(0, 2, "R"))
    bodies = (Body("body-00", (0, 2)), Body("body-01", (1,)), Body("body-02", (3,)))
    fake = replace(
        tree, source=source, target=source, fill=np.ones(4), edges=edges, bodies=bodies,
        orientation=np.tile(np.eye(3, dtype=np.int32), (4, 1, 1)), hinges=hinges,
        root_rotation=np.eye(3, dtype=np.int32), root_translation=np.zeros(3, dtype=np.int32),
    )  # fmt: skip
    found = check_tree(fake)
    assert any("one lattice edge segment in A" in text for text in found)
    assert any("one lattice edge segment in B" in text for text in found)


def test_shapes_of_arrays(tree):
    assert check_tree(replace(tree, target=tree.target[:-1]))
    assert check_tree(replace(tree, orientation=tree.orientation.reshape(-1, 9)))
