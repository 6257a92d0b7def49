from __future__ import annotations

import numpy as np

from fabfold.tree.interlock import interlock, part
from fabfold.tree.system import HingeSystem


def chain(bodies):
    """A row of single cells, a hinge between each two."""
    hinges = bodies - 1
    return HingeSystem(
        cells=np.array([(i, 0, 0) for i in range(bodies)], dtype=np.int32),
        body=np.arange(bodies, dtype=np.int32),
        parent=np.arange(hinges, dtype=np.int32),
        point2=np.array([(2 * i + 1, 1, 0) for i in range(hinges)], dtype=np.int32),
        axis=np.full(hinges, 2, dtype=np.int8),
        turns=np.full(hinges, 2, dtype=np.int8),
    )


def test_a_part_keeps_its_bodies_and_hinges():
    some = part(chain(6), np.array([2, 3]))
    assert some.cells.tolist() == [[2, 0, 0], [3, 0, 0], [4, 0, 0]]
    assert some.body.tolist() == [0, 1, 2]
    assert some.parent.tolist() == [0, 1]
    assert some.point2[:, 0].tolist() == [5, 7]


def test_a_branch_keeps_parents_before_children():
    system = chain(5)._replace(parent=np.array([0, 0, 1, 1], dtype=np.int32))
    some = part(system, np.array([2, 3]))
    assert some.parent.tolist() == [0, 0]
    assert len(some.cells) == 3


def test_the_locked_part_is_found():
    def locked(system):
        xs = {int(x) for x in system.cells[:, 0]}
        return {3, 4, 5} <= xs

    for seed in range(5):
        found = interlock(chain(10), locked, np.random.default_rng(seed))
        assert found.tolist() == [3, 4]


def test_the_whole_may_be_needed():
    found = interlock(chain(5), lambda s: len(s.cells) == 5, np.random.default_rng(0))
    assert found.tolist() == [0, 1, 2, 3]
