"""Results of the stages as files of the stage store; reading gives back what was written."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fabfold.files import write_json, write_npz
from fabfold.fold.motion import Motion
from fabfold.joinery.bodies import BodyMesh, Joinery, PlacedPin
from fabfold.kit.stages import BuiltTree, PlannedTree
from fabfold.printing.checks import Check
from fabfold.recipe.recipe import Recipe
from fabfold.solid.closed_solid import Paint, Solid
from fabfold.store import StageStore
from fabfold.tree.fold_tree import FoldTree
from fabfold.voxels.thickening import Cut
from fabfold.voxels.voxel_files import load_voxels, save_voxels

__all__ = [
    "keep_inputs",
    "load_built",
    "load_checks",
    "load_cut",
    "load_planned",
    "load_solid",
    "save_built",
    "save_checks",
    "save_cut",
    "save_planned",
    "save_solid",
]


#: The model, the thicker one where it was thickened, and what is told of it.
_SOLID, _THICK, _CUT = "solid.npz", "cut-solid.npz", "cut.json"


def keep_inputs(store: StageStore, recipe: Recipe, files: Mapping[str, Path | None]) -> None:
    """Copy the files that a recipe names.

    Parameters
    ----------
    store : StageStore
        Gets the copies.
    recipe : Recipe
        Has the digests of the files.
    files : mapping of str to Path or None
        Model, template and actions, in this order.
    """
    digests = (recipe.sha256, recipe.template_sha256, recipe.actions_sha256)
    for (name, file), digest in zip(files.items(), digests, strict=True):
        if file is not None:
            store.keep(file, digest, name)


def save_solid(store: StageStore, solid: Solid) -> list[str]:
    """Write a solid."""
    return _save_mesh(store, _SOLID, solid)


def load_solid(store: StageStore, files: list[str]) -> Solid:
    """Read what :func:`save_solid` wrote."""
    return _load_mesh(store, files[0])


def _save_mesh(store: StageStore, file: str, solid: Solid) -> list[str]:
    write_npz(
        store.path(file),
        {
            "vertices": solid.vertices,
            "faces": solid.faces,
            "about": np.array([solid.name, solid.sha256, *solid.notes]),
            **(
                {}
                if solid.paint is None
                else {"paint": solid.paint.corners, "colours": solid.paint.colours}
            ),
        },
    )
    return [file]


def _load_mesh(store: StageStore, file: str) -> Solid:
    with np.load(store.path(file), allow_pickle=False) as data:
        name, digest, *notes = (str(text) for text in data["about"])
        paint = Paint(data["paint"], data["colours"]) if "paint" in data.files else None
        return Solid(name, data["vertices"], data["faces"], tuple(notes), digest, paint)


def save_cut(store: StageStore, cut: Cut) -> list[str]:
    """Write voxelizations, best first, and what they are cut from unless that is the model."""
    names = [f"voxels-{index:02d}.npz" for index in range(len(cut.options))]
    for name, voxels in zip(names, cut.options, strict=True):
        save_voxels(store.path(name), voxels)
    write_json(store.path(_CUT), {"wanted": cut.wanted, "least": cut.least})
    return [_CUT, *names, *(_save_mesh(store, _THICK, cut.solid) if cut.wanted else [])]


def load_cut(store: StageStore, files: list[str]) -> Cut:
    """Read what :func:`save_cut` wrote."""
    data = json.loads(store.path(_CUT).read_text(encoding="utf-8"))
    return Cut(
        _load_mesh(store, _THICK if _THICK in files else _SOLID),
        [load_voxels(store.path(name)) for name in sorted(files) if name not in (_CUT, _THICK)],
        float(data["wanted"]),
        float(data["least"]),
    )


def save_planned(store: StageStore, planned: PlannedTree) -> list[str]:
    """Write the best tree, its voxels and its path on the lattice."""
    content = {
        "format": "fabfold-fold",
        "version": 1,
        "tree": planned.tree.to_json(1.0, (0.0, 0.0, 0.0)),
        "motion": planned.motion.to_json(),
    }
    write_json(store.path("fold.json"), content)
    save_voxels(store.path("fold-voxels.npz"), planned.voxels)
    return ["fold.json", "fold-voxels.npz"]


def load_planned(store: StageStore, files: list[str]) -> PlannedTree:
    """Read what :func:`save_planned` wrote."""
    data = json.loads(store.path("fold.json").read_text(encoding="utf-8"))
    return PlannedTree(
        load_voxels(store.path("fold-voxels.npz")),
        FoldTree.from_json(data["tree"]),
        Motion.from_json(data["motion"]),
    )


def save_built(store: StageStore, built: BuiltTree) -> list[str]:
    """Write the tree that was built, its motion and its bodies."""
    tree, joinery = built.planned.tree, built.joinery
    content = {
        "format": "fabfold-made",
        "version": 1,
        "tree": tree.to_json(joinery.voxel_mm, joinery.origin_mm),
        "motion": built.planned.motion.to_json(),
        "refused": list(built.refused),
        "apart": None if built.apart is None else built.apart.to_json(),
        "retention": None if built.retention is None else built.retention.to_json(),
        "pins": [dataclasses.asdict(pin) for pin in joinery.pins],
    }
    write_json(store.path("made.json"), content)
    save_voxels(store.path("made-voxels.npz"), built.planned.voxels)
    about: dict[str, Any] = {
        field.name: getattr(joinery, field.name)
        for field in dataclasses.fields(joinery)
        if field.name not in ("bodies", "pins")
    }
    arrays = {"about": np.array([json.dumps(about)])}
    for index, body in enumerate(joinery.bodies):
        arrays[f"name_{index}"] = np.array([body.name])
        arrays[f"vertices_{index}"] = body.vertices
        arrays[f"faces_{index}"] = body.faces
    write_npz(store.path("made-bodies.npz"), arrays)
    return ["made.json", "made-voxels.npz", "made-bodies.npz"]


def load_built(store: StageStore, files: list[str]) -> BuiltTree:
    """Read what :func:`save_built` wrote."""
    from fabfold.apart.apart_kit import ApartKit
    from fabfold.joinery.box_hold import Retention

    data = json.loads(store.path("made.json").read_text(encoding="utf-8"))
    planned = PlannedTree(
        load_voxels(store.path("made-voxels.npz")),
        FoldTree.from_json(data["tree"]),
        Motion.from_json(data["motion"]),
    )
    with np.load(store.path("made-bodies.npz"), allow_pickle=False) as arrays:
        about = json.loads(str(arrays["about"][0]))
        about["origin_mm"] = tuple(about["origin_mm"])
        about["notes"] = tuple(about["notes"])
        count = sum(key.startswith("name_") for key in arrays.files)
        bodies = tuple(
            BodyMesh(str(arrays[f"name_{i}"][0]), arrays[f"vertices_{i}"], arrays[f"faces_{i}"])
            for i in range(count)
        )
    pins = tuple(
        PlacedPin(**{key: _as_tuple(value) for key, value in pin.items()}) for pin in data["pins"]
    )
    apart = None if data["apart"] is None else ApartKit.from_json(data["apart"])
    joinery = Joinery(bodies=bodies, pins=pins, **about)
    kept = data["retention"]
    retention = None if kept is None else Retention.from_json(kept)
    return BuiltTree(planned, joinery, tuple(data["refused"]), apart, retention)


def _as_tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def save_checks(store: StageStore, checks: list[Check]) -> list[str]:
    """Write checks."""
    content = {
        "format": "fabfold-checks",
        "version": 1,
        "checks": [dataclasses.asdict(check) for check in checks],
    }
    write_json(store.path("checks.json"), content)
    return ["checks.json"]


def load_checks(store: StageStore, files: list[str]) -> list[Check]:
    """Read what :func:`save_checks` wrote."""
    data = json.loads(store.path(files[0]).read_text(encoding="utf-8"))
    return [Check(**entry) for entry in data["checks"]]
