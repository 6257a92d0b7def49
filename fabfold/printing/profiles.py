"""Printer and material profiles: small data files with the limits that checks hold bodies to."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from fabfold.errors import RecipeError
from fabfold.files import data_folder
from fabfold.toml_files import TomlError, faults_of, nearest, read_toml

__all__ = [
    "DEFAULT_PROFILE",
    "ApartFit",
    "Profile",
    "load_profile",
    "profile_names",
    "profiles_folder",
]

#: A kit is printed closed, as the model, with a gap under every face. Powder carries those faces
#: and blows out of the gaps; Multi Jet Fusion does so with the narrower gap of the two nylon
#: processes, every printing service offers it, and nylon bears folding.
DEFAULT_PROFILE = "mjf-pa12"

#: A length of a profile in mm.
Length = Annotated[float, Field(gt=0.0, le=1000.0)]

#: Grams a cubic centimetre, by the first word of a profile's material; resins are about 1.15.
_DENSITY: Final[dict[str, float]] = {"PLA": 1.24, "PETG": 1.27, "PA12": 1.01}


class ApartFit(BaseModel):
    """Gaps of a kit whose bodies are printed one by one and joined by loose pins, mm.

    Attributes
    ----------
    clearance_mm : float
        Normal clearance in the hinges.
    face_gap_mm : float
        Gap between the faces of two bodies.
    min_gap_mm : float
        Smallest gap on the folding path: what the printer may be off.
    grip_mm, slip_mm : float
        How much wider than the pin the bores are, in radius: of the body that grips it, and of the
        others.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    clearance_mm: Annotated[float, Field(gt=0.0, le=5.0)] = 0.3
    face_gap_mm: Annotated[float, Field(gt=0.0, le=5.0)] = 0.2
    min_gap_mm: Annotated[float, Field(gt=0.0, le=5.0)] = 0.1
    grip_mm: Annotated[float, Field(ge=0.0, le=1.0)] = 0.1
    slip_mm: Annotated[float, Field(gt=0.0, le=1.0)] = 0.2

    @model_validator(mode="after")
    def _in_order(self) -> ApartFit:
        if self.grip_mm > self.slip_mm:
            raise ValueError(
                f"grip_mm ({self.grip_mm:g}) must not be above slip_mm ({self.slip_mm:g})"
            )
        if self.min_gap_mm >= min(self.face_gap_mm, self.slip_mm, self.clearance_mm):
            raise ValueError(
                f"min_gap_mm ({self.min_gap_mm:g}) must be below face_gap_mm, slip_mm and "
                "clearance_mm"
            )
        return self


class Profile(BaseModel):
    """Limits of one printer and material, in mm and degrees.

    Attributes
    ----------
    name : str
        Name by which the profile is asked for.
    description : str
        What the profile is for, in one sentence.
    process : str
        Printing process, such as ``"FDM"``.
    material : str
        Printing material, such as ``"PLA"``.
    nozzle_mm : float or None
        Width of the nozzle of an extruding printer, mm.
    layer_mm : float or None
        Height of a layer, mm.
    clearance_mm : float
        Gap between bodies and in hinges that a kit is made with unless its recipe says otherwise,
        mm.
    min_gap_mm : float
        Smallest gap that stays open in the print, mm.
    min_wall_mm : float
        Thinnest wall that prints, mm.
    max_overhang_deg : float or None
        Steepest overhang that prints without support, degrees from the vertical; None where no
        support is needed.
    escape_mm : float or None
        Least diameter of a hole through which powder or resin comes out of a hollow, mm; None where
        the process leaves nothing in hollows.
    in_place : bool
        Whether the closed kit can be printed as one object: the process leaves open the gap under
        every face.
    bed_mm : (float, float, float) or None
        Build volume along x, y and z, mm.
    sources : tuple of str
        Where the figures come from.
    apart : ApartFit
        Gaps where the bodies are printed one by one.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: Annotated[str, Field(min_length=1, max_length=80)]
    description: Annotated[str, Field(max_length=400)] = ""
    process: Annotated[str, Field(min_length=1, max_length=40)]
    material: Annotated[str, Field(max_length=80)] = ""
    nozzle_mm: Length | None = None
    layer_mm: Length | None = None
    clearance_mm: Annotated[float, Field(gt=0.0, le=5.0)]
    min_gap_mm: Annotated[float, Field(gt=0.0, le=5.0)]
    min_wall_mm: Annotated[float, Field(gt=0.0, le=20.0)]
    max_overhang_deg: Annotated[float, Field(ge=0.0, le=90.0)] | None = None
    escape_mm: Length | None = None
    in_place: bool
    bed_mm: tuple[Length, Length, Length] | None = None
    sources: tuple[str, ...] = ()
    apart: ApartFit = ApartFit()

    @model_validator(mode="after")
    def _gap_below_clearance(self) -> Profile:
        if self.min_gap_mm >= self.clearance_mm:
            raise ValueError(
                f"min_gap_mm ({self.min_gap_mm:g}) must be below clearance_mm "
                f"({self.clearance_mm:g}): the printer needs some of the gap for itself"
            )
        return self

    @property
    def density_g_cm3(self) -> float:
        """Weight of the material, g/cm³."""
        words = self.material.split()
        return _DENSITY.get(words[0] if words else "", 1.15)


def profiles_folder() -> Path:
    """Folder that holds the profile files, in a checkout as in an installed wheel."""
    return data_folder("prints")


def profile_names() -> list[str]:
    """Names of the profiles that come with fabfold."""
    return sorted(path.stem for path in profiles_folder().glob("*.toml"))


def load_profile(name: str) -> Profile:
    """Profile by the name of a shipped one, or by the path of a ``.toml`` file.

    Parameters
    ----------
    name : str
        Such as ``"mjf-pa12"`` or ``"my-printer.toml"``.

    Returns
    -------
    Profile
        The limits that the file gives.

    Raises
    ------
    RecipeError
        If there is no such profile (the known names are listed), or the file is not a profile
        (every wrong field is listed).

    Examples
    --------
    >>> load_profile("mjf-pa12").process
    'MJF'
    """
    known = profile_names()
    if name in known:
        path = profiles_folder() / f"{name}.toml"
    else:
        path = Path(name)
        if path.suffix != ".toml" or not path.is_file():
            raise RecipeError(
                f"no print profile {name!r}: {nearest(name, known)}; or give the path of a .toml "
                "file with the same fields"
            )
    try:
        data, text = read_toml(path)
    except TomlError as error:
        raise RecipeError(f"print profile {path}: {error}") from None
    try:
        return Profile.model_validate(data)
    except ValidationError as error:
        fields = (*Profile.model_fields, *ApartFit.model_fields)
        raise RecipeError(f"print profile {path}: {faults_of(error, fields, text)}") from None
