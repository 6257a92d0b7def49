"""Boxes that would suit a model better than its own."""

import numpy as np
import pytest
import trimesh

from fabfold.kit.template_advice import advised_box
from fabfold.lattice.shipped import load_template
from fabfold.recipe.recipe import make_recipe
from fabfold.solid.closed_solid import Solid


@pytest.fixture(scope="module")
def brick():
    mesh = trimesh.creation.box((30, 30, 40))
    return Solid("brick", np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int32))


def advice(solid, name, at_most, **recipe):
    made = make_recipe(model="brick.stl", template=name, **recipe)
    return advised_box(solid, made, load_template(name), at_most)


@pytest.mark.slow
def test_a_brick_is_told_the_box_that_it_is(brick):
    found = advice(brick, "box-2x4x4", 0.6)
    assert found.template == "box-3x3x4"
    assert found.at_most == pytest.approx(1.0, abs=1e-6)
    assert str(found) == "box-3x3x4 could close to 100 %"


def test_nothing_is_looked_for_where_it_closes_well_or_the_grid_is_given(brick):
    assert advice(brick, "box-2x4x4", 0.86) is None
    assert advice(brick, "box-2x4x4", 0.6, pitch=10.0) is None
    assert advice(brick, "l-64", 0.6) is None
