"""Whether the files of a kit are still those that were written and proven."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from fabfold.export.stl import stl_bytes
from fabfold.export.weld import printable_mesh
from fabfold.files import json_text, sha256_of
from fabfold.kit.stages import BuiltTree
from fabfold.kit.step_process import HARDWARE
from fabfold.kit.writing import remove_named
from fabfold.printing.checks import Check
from fabfold.recipe.recipe import Recipe
from fabfold.store import StageStore

__all__ = [
    "delivered_check",
    "delivered_checks",
    "delivered_digests",
    "is_exported",
    "recorded_export",
]

#: Endings of the files that a printer, a CAD program or a simulation takes.
_COUNTED = (".3mf", ".step", ".urdf", ".glb", ".csv", "assembly.json", "retention.json")
#: So many files are named in the note.
_NAMED = 4


@contextmanager
def recorded_export(store: StageStore, folder: Path, name: str) -> Iterator[None]:
    """Note whose files an export leaves in a folder; those of kits of other names go in the end.

    Parameters
    ----------
    store : StageStore
        Stages in that folder.
    folder : Path
        Kit folder.
    name : str
        Name of the kit.
    """
    earlier = set(store.names) - {name}
    store.record_names([*earlier, name])
    yield
    remove_named(folder, earlier)
    store.record_names([name])
    store.record_delivered(delivered_digests(folder))


def delivered_checks(
    store: StageStore, recipe: Recipe, join: Callable[[], BuiltTree]
) -> list[Check]:
    """Check of the files of an exported kit; none where this recipe was not exported.

    Parameters
    ----------
    store : StageStore
        Stages of the kit.
    recipe : Recipe
        Its recipe.
    join : callable
        Gives what was built.
    """
    if store.folder is None or not is_exported(store, recipe):
        return []
    return [delivered_check(store.folder.parent, join(), store.delivered)]


def is_exported(store: StageStore, recipe: Recipe) -> bool:
    """Whether a kit folder holds an export of this very recipe.

    Parameters
    ----------
    store : StageStore
        Stages of the kit, whose journal knows of exports.
    recipe : Recipe
        The recipe.
    """
    if store.folder is None or not store.delivered:
        return False
    path = store.folder.parent / "kit.toml"
    return path.is_file() and path.read_bytes() == recipe.to_toml().encode("utf-8")


def delivered_digests(folder: Path) -> dict[str, str]:
    """Digests of the files of an exported kit that people take from it.

    Parameters
    ----------
    folder : Path
        Kit folder.

    Returns
    -------
    dict of str to str
        By their names.
    """
    return {
        path.relative_to(folder).as_posix(): sha256_of(path)
        for path in sorted([*folder.iterdir(), *(folder / HARDWARE).glob("*")])
        if path.is_file() and path.name.endswith(_COUNTED)
    }


def delivered_check(folder: Path, built: BuiltTree, digests: dict[str, str]) -> Check:
    """Compare the files of an exported kit with what was built and proven.

    Parameters
    ----------
    folder : Path
        Kit folder.
    built : BuiltTree
        What the stages of the kit hold.
    digests : dict of str to str
        Digests at the export, by name, of files that are not compared byte for byte.

    Returns
    -------
    Check
        Its figure is the number of files that were changed, added or removed since.
    """
    tree, joinery = built.planned.tree, built.joinery
    wanted = {
        "tree.json": json_text(tree.to_json(joinery.voxel_mm, joinery.origin_mm)).encode("utf-8"),
        "motion.json": json_text(built.planned.motion.to_json()).encode("utf-8"),
        **{f"bodies/{body.name}.stl": stl_bytes(*printable_mesh(body)) for body in joinery.bodies},
    }
    wrong = [name for name, content in wanted.items() if not _holds(folder / name, content)]
    strange = {path.name for path in (folder / "bodies").glob("*.stl")}
    wrong += sorted(f"bodies/{name}" for name in strange if f"bodies/{name}" not in wanted)
    wrong += sorted(
        name
        for name, digest in digests.items()
        if not (folder / name).is_file() or sha256_of(folder / name) != digest
    )
    count = len(wanted) + len(digests)
    note = f"{count} files compared with what was built and proven"
    if wrong:
        note = f"{_listed(wrong)}: not what was proven; fabfold export writes the kit again"
    return Check("files as they were written", float(len(wrong)), 0.0, "files", not wrong, note)


def _holds(path: Path, content: bytes) -> bool:
    return path.is_file() and path.read_bytes() == content


def _listed(names: Iterable[str]) -> str:
    shown = list(names)
    more = f" and {len(shown) - _NAMED} more" if len(shown) > _NAMED else ""
    return ", ".join(shown[:_NAMED]) + more
