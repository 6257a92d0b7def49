"""What happens in an unfolding by forces, in order: recorded, kept in a file, and replayed."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from fabfold.errors import RecipeError

__all__ = [
    "Action",
    "Carve",
    "Match",
    "PinVoxel",
    "Push",
    "Release",
    "ShapeName",
    "Unfold",
    "Wait",
    "actions_json",
    "read_actions",
]

#: One of the two copies, by the shape that it begins in.
ShapeName = Literal["A", "B"]
Steps = Annotated[int, Field(ge=1, le=100_000, description="time steps of 0.01 s")]
Voxel = Annotated[int, Field(ge=0, description="number of a voxel, as in tree.json")]


class _Action(BaseModel):
    """One action; unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Unfold(_Action):
    """Let all voxels of each shape repel each other (force ∝ 1/r²)."""

    do: Literal["unfold"] = "unfold"
    steps: Steps


class Match(_Action):
    """Let each voxel of A and the same voxel of B attract each other."""

    do: Literal["match"] = "match"
    steps: Steps


class Wait(_Action):
    """Let only pushes and pins act."""

    do: Literal["wait"] = "wait"
    steps: Steps


class Push(_Action):
    """Push a voxel from now on, with a force in the frame of the body that is held; 0 ends it."""

    do: Literal["push"] = "push"
    shape: ShapeName
    voxel: Voxel
    force: tuple[float, float, float]


class PinVoxel(_Action):
    """Hold a voxel's body where it is from now on."""

    do: Literal["pin"] = "pin"
    shape: ShapeName
    voxel: Voxel


class Release(_Action):
    """Take all pushes and pins off a shape."""

    do: Literal["release"] = "release"
    shape: ShapeName


class Carve(_Action):
    """Take the edges and corners off a voxel, in both shapes, so that others turn past it."""

    do: Literal["carve"] = "carve"
    voxel: Voxel


Action = Unfold | Match | Wait | Push | PinVoxel | Release | Carve


class _Session(BaseModel):
    """The content of an actions file (format ``fabfold-actions``, version 1)."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    format: Literal["fabfold-actions"]
    version: Literal[1]
    actions: tuple[Annotated[Action, Field(discriminator="do")], ...] = Field(max_length=10_000)


def actions_json(actions: Sequence[Action]) -> dict[str, Any]:
    """The content of an actions file.

    Parameters
    ----------
    actions : sequence of Action
        In their order.

    Returns
    -------
    dict
        Ready for JSON.
    """
    return {
        "format": "fabfold-actions",
        "version": 1,
        "actions": [action.model_dump(mode="json") for action in actions],
    }


def read_actions(path: Path) -> tuple[Action, ...]:
    """Actions from a file.

    Parameters
    ----------
    path : Path
        A JSON file of the format ``fabfold-actions``.

    Returns
    -------
    tuple of Action
        In their order.

    Raises
    ------
    RecipeError
        If the file is none; each wrong value is named with its place.
    """
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        return _Session.model_validate(data).actions
    except ValidationError as error:
        faults = "; ".join(
            f"{'.'.join(str(part) for part in fault['loc']) or 'the file'}: {fault['msg']}"
            for fault in error.errors()[:8]
        )
        raise RecipeError(f"{path}: no list of actions: {faults}") from None
    except (ValueError, RecursionError) as error:
        raise RecipeError(f"{path}: no JSON that could be read: {error}") from None
