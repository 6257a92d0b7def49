import re

import pytest

from fabfold.errors import RecipeError, TemplateError
from fabfold.recipe.recipe import Recipe, make_recipe, read_recipe


def test_a_recipe_survives_its_file(tmp_path):
    recipe = make_recipe(
        model="bunny.stl", template="box-4x4x4", seed=7, rotation=(0, 90, 12.5), voxel_mm=25
    )
    path = tmp_path / "kit.toml"
    path.write_text(recipe.to_toml())
    assert read_recipe(path) == recipe
    assert recipe.name == "bunny"
    assert make_recipe(model="sample:car", template="box-3x4x4").name == "car"


def test_every_option_is_written_with_what_it_means():
    lines = make_recipe(model="a.stl", template="box-2x2x2").to_toml().splitlines()
    for name, field in Recipe.model_fields.items():
        (line,) = (line for line in lines if re.match(rf"(# )?{name}\b", line))
        assert field.description
        assert line.endswith(field.description)


@pytest.mark.parametrize(
    ("values", "word"),
    [
        ({"voxel_mm": -1}, "voxel_mm"),
        ({"voxel_mm": float("nan")}, "voxel_mm"),
        ({"effort": "extreme"}, "effort"),
        ({"seed": 1.5}, "seed"),
        ({"colour": "red"}, "colour: no such option"),
        ({"rotation": (1, 2)}, "rotation"),
        ({"drop_below": 0.9}, "drop_below"),
    ],
)
def test_a_wrong_value_is_named(values, word):
    with pytest.raises(RecipeError, match=word):
        make_recipe(model="a.stl", template="box-4x4x4", **values)


def test_an_unknown_template_is_refused_with_the_recipe():
    with pytest.raises(TemplateError, match="pyramid"):
        make_recipe(model="a.stl", template="pyramid")


@pytest.mark.parametrize(
    "text",
    [
        "",
        "not toml",
        'format = "fabfold-kit"\nversion = 2\n',
        'format = "fabfold-kit"\nversion = 1\n',
        'format = "fabfold-kit"\nversion = 1\n[recipe]\nmodel = "a"\nx = 1\n',
        'format = "fabfold-kit"\nversion = 1\n[recipe]\nmodel = 3\n',
    ],
)
def test_a_broken_recipe_file_is_named(tmp_path, text):
    path = tmp_path / "kit.toml"
    path.write_text(text)
    with pytest.raises(RecipeError, match=r"kit\.toml"):
        read_recipe(path)


def test_a_missing_recipe_file_is_named(tmp_path):
    with pytest.raises(RecipeError, match=r"gone\.toml"):
        read_recipe(tmp_path / "gone.toml")
