"""Where a kit begins: its recipe, the files that the recipe names, and the folder it may have."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fabfold.errors import KitError, ModelError, RecipeError
from fabfold.files import sha256_of
from fabfold.recipe.recipe import Recipe, make_recipe, read_recipe
from fabfold.recipe.targets import (
    find_input,
    is_file_name,
    load_target,
    named_actions,
    named_target,
)

__all__ = ["ProjectSetup", "require_free_folder", "set_up_project", "with_size"]

#: Target of a model that says nothing of its own.
_USUAL = "box-4x4x4"


@dataclass(frozen=True)
class ProjectSetup:
    """What a kit starts from.

    Attributes
    ----------
    recipe : Recipe
        Every choice, after defaults.
    model : Path or None
        The model's file; None for a sample.
    template : Path or None
        The template's file; None for a box or a shipped template.
    folder : Path or None
        Kit folder; None where there is none yet.
    actions : Path or None
        File of what a person did in an unfolding by forces; None where nobody did anything.
    """

    recipe: Recipe
    model: Path | None
    template: Path | None
    folder: Path | None
    actions: Path | None = None


def set_up_project(source: str, folder: Path | None, options: Mapping[str, Any]) -> ProjectSetup:
    """Recipe and files of a model file, ``sample:NAME``, a ``kit.toml`` or a kit folder.

    Parameters
    ----------
    source : str
        Path of a model, a recipe or a kit folder; or ``sample:NAME``.
    folder : Path or None
        Kit folder; for a kit folder or its ``kit.toml`` the default is that folder.
    options : mapping
        Fields of the recipe; those that are None keep the recipe's or the default value.

    Raises
    ------
    KitError
        If `source` is a folder without a kit.
    ModelError
        If there is no such file or sample.
    RecipeError
        If the recipe or an option is wrong.
    """
    given = {key: value for key, value in options.items() if value is not None}
    template: Path | None = None
    actions: Path | None = None
    if "template" in given:
        fields, template = named_target(str(given["template"]))
        given.update(fields)
    if "actions" in given:
        fields, actions = named_actions(str(given["actions"]))
        given.update(fields)
    path = Path(source)
    if path.is_dir():
        if not (path / "kit.toml").is_file():
            raise KitError(f"{path}: a folder without kit.toml is no kit; give a model file")
        path = path / "kit.toml"
    if path.suffix == ".toml":
        start = _from_recipe(path, path.parent if folder is None else folder, given, template)
        return start if actions is None else replace(start, actions=actions)
    if source.startswith("sample:"):
        from fabfold.samples.builtin import sample

        given.setdefault("template", sample(source.removeprefix("sample:")).template)
        return ProjectSetup(make_recipe(model=source, **given), None, template, folder, actions)
    if not path.is_file():
        raise ModelError(f"{source}: no such file (built-in samples are written sample:NAME)")
    given.setdefault("template", _USUAL)
    recipe = make_recipe(model=path.name, sha256=sha256_of(path), **given)
    return ProjectSetup(recipe, path, template, folder, actions)


def _from_recipe(
    path: Path, folder: Path, given: dict[str, Any], template: Path | None
) -> ProjectSetup:
    """A written recipe with some of its fields changed."""
    recipe = read_recipe(path)
    if template is None and "template" not in given and is_file_name(recipe.template):
        template = find_input(recipe.template, recipe.template_sha256, path.parent, "template")
        given.update(named_target(str(template))[0])
    elif "template" in given and "template_cells" not in given:
        given["template_cells"] = None
    recipe = make_recipe(**{**recipe.model_dump(), **given})
    model: Path | None = None
    if not recipe.model.startswith("sample:"):
        model = find_input(recipe.model, recipe.sha256, path.parent, "model")
    actions: Path | None = None
    if recipe.actions and "actions" not in given:
        actions = find_input(recipe.actions, recipe.actions_sha256, path.parent, "actions")
    return ProjectSetup(recipe, model, template, folder, actions)


def with_size(start: ProjectSetup, box_mm: float | None, scale: float | None) -> ProjectSetup:
    """The same with the size of a voxel that makes the box as large as asked for.

    Parameters
    ----------
    start : ProjectSetup
        What a kit starts from.
    box_mm : float or None
        Longest side of the finished box, mm.
    scale : float or None
        Size against the usual one, whose voxels are 20 mm.

    Raises
    ------
    RecipeError
        If both are given, or one is no size.
    """
    if box_mm is None and scale is None:
        return start
    if box_mm is not None and scale is not None:
        raise RecipeError("--box-mm and --scale both set the size: give one of them")
    value = box_mm if box_mm is not None else scale
    if value is None or not 0.0 < value < 1e5:
        option = "--scale" if box_mm is None else "--box-mm"
        raise RecipeError(f"{option} {value}: must be a number above 0")
    recipe = start.recipe
    usual = float(type(recipe).model_fields["voxel_mm"].default)
    voxel = usual * value
    if box_mm is not None:
        template = load_target(recipe.template, start.template, recipe.template_cells)
        voxel = box_mm / max(template.shape)
    content = {**recipe.model_dump(), "voxel_mm": round(voxel, 4)}
    return replace(start, recipe=make_recipe(**content))


def require_free_folder(folder: Path) -> None:
    """Refuse a folder that holds something that is no kit.

    Raises
    ------
    KitError
        If it does, or is a file.
    """
    if folder.exists() and not folder.is_dir():
        raise KitError(f"{folder}: is a file; give another folder for the kit")
    if folder.is_dir():
        names = {entry.name for entry in folder.iterdir()}
        if names and not names & {"kit.toml", "stages"}:
            raise KitError(
                f"{folder}: holds files that are no kit; give another or an empty folder"
            )
