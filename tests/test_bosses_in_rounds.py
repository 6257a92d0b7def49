"""A model whose limbs have no edge for a hinge: bosses come in the round after no tree fitted."""

from dataclasses import replace

import numpy as np
import pytest
from voxel_cases import material_voxels

from fabfold.errors import NoTreeError
from fabfold.kit import first_trees as first_trees_module
from fabfold.kit.first_trees import first_trees
from fabfold.kit.kit import Kit
from fabfold.progress import SilentListener
from fabfold.search.pareto import solutions
from fabfold.search.rounds import Rounds
from fabfold.store import StageStore
from fabfold.tree.kinematics_check import check_tree
from fabfold.voxels.features import features
from fabfold.voxels.thickening import Cut, scarce_hinges
from fabfold.voxels.voxel_model import BOSSES_NOTE
from fabfold.wishes.wish_list import Wishes


def lolly():
    """A block of 2 x 2 x 2 full voxels on a bar of five, which run through their middle."""
    block = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    bar = [(x, 0, 0) for x in range(2, 7)]
    cells = sorted(block + bar)
    material = np.ones((len(cells), 20, 20, 20), dtype=bool)
    thin = np.zeros((20, 20, 20), dtype=bool)
    thin[:, 7:13, 7:13] = True
    material[[cell[0] > 1 for cell in cells]] = thin
    return material_voxels(cells, material)


def kit_of_any(**options):
    return Kit.from_model("sample:car", template="box-2x2x4", workers=1, effort="quick", **options)


def rounds_with(recipe, template, voxels, store, shift=0):
    return Rounds(
        recipe,
        template,
        [voxels],
        key="",
        store=store,
        workers=1,
        open_progress=SilentListener().stage,
        shift=shift,
    )


def rounds_of(voxels, store=None, **options):
    kit = kit_of_any(**options)
    return rounds_with(kit.recipe, kit.template, voxels, store or StageStore(None))


def key(found):
    return [(c.seed, c.tree.to_json(1.0, (0, 0, 0)), c.path.tolist()) for _, c in found]


@pytest.mark.slow
def test_bosses_come_where_no_tree_fits_and_not_before(tmp_path):
    voxels = lolly()
    assert not scarce_hinges(voxels)
    assert not voxels.notes
    rounds = rounds_of(voxels, StageStore(tmp_path))
    with pytest.raises(NoTreeError):
        rounds._round(0)
    found = next(rounds.found())
    made, best = found[0]
    assert made.bosses
    assert made.notes == (BOSSES_NOTE,)
    assert made.cells is voxels.cells
    edges = features(voxels).hinge.any(axis=1)
    pairs = features(voxels).pairs
    bare = {tuple(pair) for pair in pairs[~edges].tolist()}
    bent = {tuple(sorted((h.parent, h.child))) for h in best.tree.edges if h.hinges}
    assert bare & bent, "the bar is bent where it has no material at an edge"
    # Asked again, and resumed, it searches nothing else.
    assert key(next(rounds.found())) == key(found)
    assert key(next(rounds_of(voxels, StageStore(tmp_path)).found())) == key(found)
    assert key(rounds_of(voxels, StageStore(tmp_path)).ranked(0.0)) == key(found)


@pytest.mark.slow
def test_the_pareto_list_has_bosses_where_no_tree_fits():
    kit = kit_of_any()

    def begin(recipe, shift):
        return rounds_with(recipe, kit.template, lolly(), StageStore(None), shift=shift)

    found = solutions(kit.recipe, begin, SilentListener().stage)
    assert found
    assert all(solution.voxels.bosses for solution in found)


@pytest.mark.slow
def test_the_first_kit_has_bosses_where_no_tree_fits(monkeypatch):
    kit, voxels = kit_of_any(), lolly()
    monkeypatch.setattr(first_trees_module, "cut_model", lambda *_, **__: Cut(None, [voxels]))
    planned = next(first_trees(kit.recipe, kit.template, None, Wishes()))
    assert planned.voxels.bosses
    assert check_tree(planned.tree) == []


def test_no_bosses_where_nothing_is_to_be_added():
    assert rounds_of(lolly()).problems.bossed
    assert not rounds_of(lolly(), thicken="off").problems.bossed
    assert not rounds_of(replace(lolly(), bosses=True)).problems.bossed
