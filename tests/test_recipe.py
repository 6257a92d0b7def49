import re

import pytest

from fabfold.errors import RecipeError
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
        ({"colour": "red"}, "colour is no option"),
        ({"rotation": (1, 2)}, "rotation"),
        ({"drop_below": 0.9}, "drop_below"),
    ],
)
def test_a_wrong_value_is_named(values, word):
    with pytest.raises(RecipeError, match=word):
        make_recipe(model="a.stl", template="box-4x4x4", **values)


def test_an_unknown_template_is_refused_with_the_recipe():
    with pytest.raises(RecipeError, match="template = 'pyramid': use box-AxBxC"):
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


RECIPE = 'format = "fabfold-kit"\nversion = 1\n[recipe]\nmodel = "m.stl"\ntemplate = "box-1x1x2"\n'


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le"])
def test_recipes_are_read_however_an_editor_saved_them(tmp_path, encoding):
    mark = "\ufeff" if encoding == "utf-16-le" else ""
    path = tmp_path / "kit.toml"
    path.write_bytes((mark + RECIPE.replace("\n", "\r\n")).encode(encoding))
    assert read_recipe(path).model == "m.stl"


def test_every_fault_of_a_recipe_is_told_with_its_line(tmp_path):
    path = tmp_path / "kit.toml"
    more = 'voxel_mm = true\nseed = "x"\nvoxl_mm = 3\n"efort" = "quick"\nkeep = ["foo", "bar"]\n'
    path.write_text(RECIPE + more + "pitch = 1e-300\n")
    with pytest.raises(RecipeError) as caught:
        read_recipe(path)
    told = str(caught.value)
    for words in (
        "line 6: voxel_mm = True: must be a number or a text",
        "line 7: seed = 'x'",
        "line 8: voxl_mm is no option; did you mean voxel_mm?",
        "line 9: efort is no option; did you mean effort?",
        "line 10: keep = ['foo', 'bar']",
        "found 'foo'; --keep: wants what to keep and where, such as front:+x, found 'bar'",
        "line 11: pitch = 1e-300: beyond reckoning",
    ):
        assert words in told, told


@pytest.mark.parametrize("given", ["s", "S", "s+d", "S+D", "ALL", "s90", "Auto"])
def test_joints_are_read_in_any_case(given):
    recipe = make_recipe(model="a.stl", template="box-1x1x2", joints=given)
    assert recipe.joints in ("auto", "S", "S90", "S+D", "all")
    with pytest.raises(RecipeError, match="'auto', 'S', 'S90', 'S\\+D' or 'all'"):
        make_recipe(model="a.stl", template="box-1x1x2", joints="hinge")
