"""The recipe of a kit: every choice that its bytes depend on (``kit.toml``)."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal, get_args

import tomlkit
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    ValidationInfo,
    field_validator,
)

from fabfold.errors import FabfoldError, RecipeError
from fabfold.lattice.shipped import load_template
from fabfold.recipe.targets import is_file_name
from fabfold.toml_files import TomlError, faults_of, read_toml
from fabfold.tree.catalogue import JointChoice, JointSet
from fabfold.version import __version__

__all__ = ["Recipe", "make_recipe", "read_recipe"]

Vector = tuple[float, float, float]

#: Words for numbers.
_PREFER = {"hinges": 0.0, "balanced": 0.5, "surface": 1.0}
#: Fields that are true or false.
_SWITCHES = ("joints_inside", "share", "retention_in_a", "fill")
_VOID = {"inside": 1.0, "even": 0.0, "surface": -1.0}


class Recipe(BaseModel):
    """Everything that decides a kit, after defaults.

    The same recipe gives the same kit, byte for byte, whatever the number of workers.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    model: Annotated[str, Field(min_length=1, description="file name, or sample:NAME")]
    sha256: Annotated[str, Field(description="digest of the model's file")] = ""
    object: Annotated[
        str, Field(max_length=1000, description="name or number of the one object of a 3MF file")
    ] = ""
    template: Annotated[str, Field(description="box-AxBxC, a template's name or file")]
    template_sha256: Annotated[str, Field(description="digest of the template's file")] = ""
    template_cells: Annotated[
        int | None, Field(ge=2, le=4096, description="cells of a template that is a mesh")
    ] = None
    voxel_mm: Annotated[float, Field(gt=0, le=1000, description="side of a voxel, mm")] = 20.0
    profile: Annotated[str, Field(description="printer and material, or a .toml file")] = "mjf-pa12"
    clearance_mm: Annotated[
        float | None,
        Field(gt=0, le=5, description="clearance in hinges; default: the profile's"),
    ] = None
    print: Annotated[
        Literal["auto", "in-place", "apart"],
        Field(description="in-place as one object, apart body by body; auto: as the profile can"),
    ] = "auto"
    pin: Annotated[
        Literal["1.75", "2.85", "rod-2", "m2"],
        Field(description="loose pin of bodies printed apart: filament 1.75 or 2.85, rod-2, m2"),
    ] = "1.75"
    retention: Annotated[
        Literal["none", "magnet", "friction", "magnet+friction"],
        Field(description="what holds the box shut: none, magnet, friction or magnet+friction"),
    ] = "none"
    retention_in_a: Annotated[
        bool, Field(description="magnets hold the model too, before it is folded")
    ] = False
    magnet: Annotated[
        Literal["3x1", "4x2", "5x2"], Field(description="disc magnets, diameter x thickness in mm")
    ] = "3x1"
    magnet_fit: Annotated[
        Literal["glued", "enclosed"],
        Field(description="magnets: glued in, or enclosed while the print pauses"),
    ] = "glued"
    skin: Annotated[
        Literal["model", "lattice"],
        Field(description="the model's surface, or lattice: blocks of cells with chamfered edges"),
    ] = "model"
    fill: Annotated[bool, Field(description="plates close open faces of the box from inside")] = (
        False
    )
    pose: Annotated[
        str,
        Field(
            pattern=r"^(a|b|auto|[0-9]{1,4})$",
            description="printed in place as the model (a), the box (b), after move N, or auto",
        ),
    ] = "a"
    slicer: Annotated[
        Literal["any", "prusa", "prusa3", "orca", "bambu", "all"],
        Field(description="whose 3MF to write beside NAME.3mf; any: Bambu Studio and OrcaSlicer"),
    ] = "any"
    seed: Annotated[int, Field(ge=0, lt=2**31, description="seed of every random choice")] = 1
    effort: Annotated[
        Literal["quick", "normal", "thorough"], Field(description="how long the search goes on")
    ] = "normal"
    rounds: Annotated[
        int, Field(ge=1, le=1000, description="rounds of seeds before the search gives up")
    ] = 8
    thicken: Annotated[
        Literal["auto", "off"] | float,
        Field(description="thin parts: auto thickens where nothing else works, off, or least mm"),
    ] = "auto"
    closed: Annotated[
        float | None,
        Field(gt=0, le=1, description="search until the box is closed to this share, or give up"),
    ] = None
    drop_below: Annotated[
        float, Field(ge=0, le=0.5, description="cells with a smaller share of material are dropped")
    ] = 0.04
    rotation: Annotated[
        Vector | None, Field(description="grid placement by hand: x, y, z rotation in degrees")
    ] = None
    origin: Annotated[
        Vector | None, Field(description="grid placement by hand: lattice origin in model units")
    ] = None
    pitch: Annotated[
        float | None,
        Field(gt=0, description="grid placement by hand: voxel side in model units"),
    ] = None
    surface_weight: Annotated[float, Field(ge=0, le=100, description="weight of Eq. 8")] = 0.3
    single_weight: Annotated[float, Field(ge=0, le=100, description="weight of a single hinge")] = (
        0.1
    )

    prefer: Annotated[
        float,
        Field(ge=0, le=1, description="0 fewest hinges, 0.5 balanced, 1 best surface"),
    ] = 0.5
    void: Annotated[
        float,
        Field(ge=-1, le=1, description="empty space: 1 inside the box, -1 at its surface, 0 even"),
    ] = 0.0
    keep: Annotated[
        tuple[str, ...], Field(description="what shall be seen where on the box, WHAT:SIDE")
    ] = ()
    keep_weight: Annotated[
        float, Field(ge=0, le=100, description="energy of a kept face that is elsewhere")
    ] = 0.3
    protect: Annotated[
        tuple[str, ...], Field(description="regions of the model that no cut may cross")
    ] = ()
    joints: Annotated[
        JointChoice,
        Field(
            description="hinges: S single, S+D double ones too, auto double ones where they pay, "
            "S90 and all: quarter turns too"
        ),
    ] = "auto"
    double_weight: Annotated[float, Field(ge=0, le=100, description="weight of a double hinge")] = (
        0.12
    )
    joints_inside: Annotated[
        bool, Field(description="no hinge on the visible faces of the box")
    ] = False
    share: Annotated[
        bool, Field(description="two voxels may share a cell where their material allows it")
    ] = False
    method: Annotated[
        Literal["planner", "physics"],
        Field(description="who finds the folding path: the planner, or forces in a simulation"),
    ] = "planner"
    actions: Annotated[
        str, Field(description="file of pins, pushes and carving that help the forces")
    ] = ""
    actions_sha256: Annotated[str, Field(description="digest of that file")] = ""
    pick: Annotated[
        int, Field(ge=0, le=1000, description="solution of the Pareto list; 0 is the best tree")
    ] = 0

    @property
    def first_joints(self) -> JointSet:
        """Joints that trees are searched with."""
        return "S" if self.joints == "auto" else self.joints

    @property
    def every_joint(self) -> JointSet:
        """Joints that the best trees may be changed with: all that a kit can have."""
        return "S+D" if self.joints == "auto" else self.joints

    @field_validator("*", mode="before")
    @classmethod
    def _no_truth_for_a_number(cls, value: Any, info: ValidationInfo) -> Any:
        if isinstance(value, bool) and info.field_name not in _SWITCHES:
            raise ValueError("must be a number or a text, not true or false")
        return value

    @field_validator("rotation", "origin", mode="before")
    @classmethod
    def _three_numbers(cls, value: Any) -> Any:
        if not isinstance(value, str):
            return value
        try:
            x, y, z = (float(part) for part in value.split(","))
        except ValueError:
            raise ValueError("wants three numbers such as 0,90,0") from None
        return (x, y, z)

    @field_validator("pitch")
    @classmethod
    def _within_reckoning(cls, value: float | None) -> float | None:
        if value is not None and not 1e-60 <= value <= 1e60:
            raise ValueError("beyond reckoning; give 1e-60 to 1e60")
        return value

    @field_validator("joints", mode="before")
    @classmethod
    def _joints_in_any_case(cls, value: Any) -> Any:
        known = {name.lower(): name for name in get_args(JointChoice)}
        return known.get(value.lower(), value) if isinstance(value, str) else value

    @field_validator("prefer", mode="before")
    @classmethod
    def _named_preference(cls, value: Any) -> Any:
        return _PREFER.get(value, value) if isinstance(value, str) else value

    @field_validator("void", mode="before")
    @classmethod
    def _named_void(cls, value: Any) -> Any:
        return _VOID.get(value, value) if isinstance(value, str) else value

    @field_validator("keep", "protect")
    @classmethod
    def _readable_regions(cls, value: tuple[str, ...], info: ValidationInfo) -> tuple[str, ...]:
        from fabfold.solid.regions import parse_keep, parse_region

        texts = tuple(text for text in value if text != "none")
        faults = []
        for text in texts:
            try:
                if info.field_name == "keep":
                    parse_keep(text, "--keep")
                else:
                    parse_region(text, "--protect")
            except FabfoldError as error:
                faults.append(str(error))
        if faults:
            raise ValueError("; ".join(faults))
        return texts

    @field_validator("template")
    @classmethod
    def _known_template(cls, value: str) -> str:
        # A file is read by the kit, which knows where it is kept.
        if not is_file_name(value):
            try:
                load_template(value)
            except FabfoldError as error:
                raise ValueError(str(error).removeprefix(f"no template {value!r}: ")) from None
        return value

    @field_validator("thicken", mode="before")
    @classmethod
    def _at_most_a_voxel(cls, value: Any, info: ValidationInfo) -> Any:
        if value in ("auto", "off"):
            return value
        most = info.data.get("voxel_mm", 1000.0)
        number = float("nan")
        if isinstance(value, int | float) and not isinstance(value, bool):
            number = float(value)
        if not 0 < number <= most:
            raise ValueError(
                f"must be auto, off, or a thickness in mm, at most the {most:g} mm of a voxel"
            )
        return number

    @property
    def thickness(self) -> float | None:
        """Least thickness of all parts in voxel sides; None where no number is asked for."""
        return None if isinstance(self.thicken, str) else self.thicken / self.voxel_mm

    @property
    def name(self) -> str:
        """Stem of the model's name: what the kit's files are called, without line ends and such."""
        if self.model.startswith("sample:"):
            return self.model.removeprefix("sample:")
        return "".join(c if c.isprintable() else "_" for c in Path(self.model).stem)

    def to_toml(self) -> str:
        """The content of ``kit.toml``, each value with what it means."""
        document = tomlkit.document()
        document.add("format", tomlkit.item("fabfold-kit"))
        document.add("version", tomlkit.item(1))
        document.add("fabfold", tomlkit.item(__version__))
        table = tomlkit.table()
        for name, field in type(self).model_fields.items():
            value = getattr(self, name)
            if value is None:
                table.add(tomlkit.comment(f"{name}: {field.description}"))
                continue
            item = tomlkit.item(list(value) if isinstance(value, tuple) else value)
            if field.description:
                item.comment(field.description)
            table.add(name, item)
        document.add("recipe", table)
        return tomlkit.dumps(document)


def make_recipe(**values: Any) -> Recipe:
    """Recipe from keyword values; those that are None take their default.

    Raises
    ------
    RecipeError
        Naming each value that is wrong and why.
    """
    try:
        return Recipe(**{key: value for key, value in values.items() if value is not None})
    except ValidationError as error:
        raise RecipeError(faults_of(error, Recipe.model_fields)) from None


def read_recipe(path: Path) -> Recipe:
    """Recipe from a ``kit.toml``.

    Raises
    ------
    RecipeError
        If the file is not a recipe, or a value is wrong.
    """
    try:
        data, text = read_toml(path)
    except TomlError as error:
        raise RecipeError(f"{path}: {error}; it is no recipe") from None
    if data.get("format") != "fabfold-kit" or data.get("version") != 1:
        raise RecipeError(
            f'{path}: wants format = "fabfold-kit" and version = 1, '
            f"found {data.get('format')!r} and {data.get('version')!r}"
        )
    table = data.get("recipe")
    if not isinstance(table, dict):
        raise RecipeError(f"{path}: has no [recipe] table")
    try:
        return Recipe(**table)
    except ValidationError as error:
        raise RecipeError(f"{path}: {faults_of(error, Recipe.model_fields, text)}") from None
