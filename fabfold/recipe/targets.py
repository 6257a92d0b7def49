"""The target shape of a recipe: a box, a shipped template, a template file or a mesh."""

from __future__ import annotations

from pathlib import Path

from fabfold.errors import ModelError, RecipeError, TemplateError
from fabfold.files import sha256_of
from fabfold.lattice.shipped import load_template
from fabfold.lattice.template import Template

__all__ = ["find_input", "is_file_name", "load_target", "named_actions", "named_target"]

#: Suffixes of files that can be a target besides ``.toml``: those that can be a model.
MESHES = (".stl", ".obj", ".ply", ".off", ".glb", ".3mf", ".step", ".stp")


def is_file_name(name: str) -> bool:
    """Whether a template is the name of a file, and not of a box or a shipped template."""
    return Path(name).suffix.lower() in (".toml", *MESHES)


def load_target(name: str, file: Path | None, cells: int | None = None) -> Template:
    """Template by name, or from its file.

    Parameters
    ----------
    name : str
        As in the recipe.
    file : Path or None
        The file, where `name` is the name of one.
    cells : int, optional
        Number of cells wanted, for a mesh.

    Raises
    ------
    TemplateError, ModelError
        If there is no such template, or its file cannot be used.
    RecipeError
        If a number of cells is asked for that the template does not leave open.
    """
    if file is not None and file.suffix.lower() in MESHES:
        from fabfold.solid.load import load_solid
        from fabfold.voxels.mesh_template import template_of_solid

        return template_of_solid(load_solid(file), cells)
    if cells is not None:
        raise RecipeError(
            f"template_cells = {cells}: template {name!r} has its number of cells; it can only be "
            "chosen where the template is a mesh"
        )
    return load_template(name if file is None else str(file))


def named_target(given: str) -> tuple[dict[str, str], Path | None]:
    """Fields of the recipe for a template as it was asked for, and its file.

    Raises
    ------
    TemplateError
        If it looks like a file and there is none.
    """
    if not is_file_name(given):
        return {"template": given, "template_sha256": ""}, None
    path = Path(given)
    if not path.is_file():
        raise TemplateError(f"template {given!r}: there is no such file")
    return {"template": path.name, "template_sha256": sha256_of(path)}, path


def named_actions(given: str) -> tuple[dict[str, str], Path | None]:
    """Fields of the recipe for a file of actions, and the file; none for the empty name.

    Raises
    ------
    RecipeError
        If there is no such file.
    """
    if not given:
        return {"actions": "", "actions_sha256": ""}, None
    path = Path(given)
    if not path.is_file():
        raise RecipeError(f"--actions {given}: there is no such file")
    return {"method": "physics", "actions": path.name, "actions_sha256": sha256_of(path)}, path


def find_input(name: str, sha256: str, beside: Path, kept: str) -> Path:
    """File that a recipe names: beside it, kept in its stages, or in the working folder.

    Parameters
    ----------
    name : str
        File name, as the recipe has it.
    sha256 : str
        Its digest; empty where the recipe was written by hand and any content will do.
    beside : Path
        Folder of the recipe.
    kept : str
        Folder of the stages that kits keep it in.

    Raises
    ------
    ModelError
        If it is in none of these places.
    """
    for place in (beside, beside / "stages" / kept, Path()):
        path = place / name
        if path.is_file() and sha256 in ("", sha256_of(path)):
            return path
    raise ModelError(
        f"{name}: not found "
        + (f"with the digest {sha256[:12]}… " if sha256 else "")
        + f"beside the recipe in {beside} or in the working folder; put the file there"
    )
