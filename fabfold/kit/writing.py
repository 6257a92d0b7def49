"""Write the files of a kit, each whole or not at all."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fabfold.export.colours import body_colours
from fabfold.export.flat import flat_poses
from fabfold.export.glb import write_glb
from fabfold.export.render import png_bytes, thumbnail
from fabfold.export.report import write_report
from fabfold.export.sketch import picture_of_tree
from fabfold.export.slicer_files import (
    SLICER_ENDINGS,
    remove_slicer_files,
    write_slicer_files,
)
from fabfold.export.stl import write_stl
from fabfold.export.threemf import posed, write_3mf
from fabfold.export.urdf import write_urdf
from fabfold.files import write_bytes, write_json, write_text
from fabfold.kit.box_closure import BoxClosure
from fabfold.kit.figure_pictures import figure_pictures
from fabfold.kit.guide_files import PICTURE, write_guide
from fabfold.kit.retention_report import retention_data, retention_summary
from fabfold.kit.stages import BuiltTree, PlannedTree
from fabfold.kit.step_process import assembled_path
from fabfold.lattice.template import Template
from fabfold.printing.checks import Check
from fabfold.printing.print_mode import PrintMode
from fabfold.printing.print_pose import posed_kit, print_pose
from fabfold.progress import Progress, ProgressPart
from fabfold.recipe.recipe import Recipe
from fabfold.search.pareto import Solution
from fabfold.solid.closed_solid import Solid
from fabfold.tree.fold_tree import FoldTree
from fabfold.version import __version__

if TYPE_CHECKING:
    from fabfold.kit.kit import Kit

__all__ = [
    "kit_summary",
    "remove_named",
    "write_built",
    "write_checks",
    "write_kit",
    "write_pareto",
    "write_planned",
    "write_printable",
    "write_stage",
    "write_tree",
]


#: Endings of the files that are called by the name of the kit.
_NAMED = (".3mf", "-flat.3mf", ".step", ".urdf", *SLICER_ENDINGS.values())


def remove_named(folder: Path, names: Iterable[str]) -> None:
    """Remove the files of kits of other names that were written into a folder before.

    Parameters
    ----------
    folder : Path
        Kit folder.
    names : iterable of str
        Their names.
    """
    for name in names:
        for ending in _NAMED:
            (folder / f"{name}{ending}").unlink(missing_ok=True)
        assembled_path(folder / f"{name}.step").unlink(missing_ok=True)


def write_stage(kit: Kit, stage: str, result: Any) -> None:
    """Write the kit files of one stage that was run by itself.

    Parameters
    ----------
    kit : Kit
        The kit.
    stage : str
        Name of the stage.
    result : object
        What it returned.
    """
    folder = kit.folder
    if folder is None or stage in ("solid", "voxelize", "export"):
        return
    if stage == "pareto":
        with kit.listener.stage("pictures") as progress:
            write_pareto(folder, result, progress)
        return
    if stage == "fit":
        write_tree(folder, result[0].tree, kit.recipe.voxel_mm)
        return
    if stage == "fold":
        write_planned(folder, result, kit.recipe.voxel_mm)
        return
    built = kit.join()
    write_built(folder, built)
    if stage == "check":
        wishes = kit.wish_report(built.planned, built.joinery)
        closure = kit.box_closure(built.planned)
        profile = kit.print_mode().profile.name
        write_checks(folder, kit.cut_solid(), built, result, wishes, closure, profile)


def kit_summary(
    solid: Solid,
    built: BuiltTree,
    wishes: Sequence[dict[str, Any]] = (),
    closure: BoxClosure | None = None,
    profile: str = "",
) -> dict[str, Any]:
    """Figures of a kit for its report: counts, volumes, energies (JSON-ready)."""
    tree, motion, joinery = built.planned.tree, built.planned.motion, built.joinery
    voxels = built.planned.voxels
    return {
        "model": solid.name,
        "repairs": list(solid.notes),
        "template": tree.template.name,
        "template_cells": len(tree.template),
        "voxels": len(tree.source),
        "mean_fill": round(float(tree.fill.mean()), 4),
        "lost_volume": round(float(voxels.lost_volume), 5),
        "bodies": len(tree.bodies),
        "joints": tree.joints,
        "energy": {key: round(float(value), 4) for key, value in tree.energy.items()},
        **(
            {}
            if closure is None
            else {
                "box_closed": round(closure.closed, 4),
                "box_closed_at_most": round(closure.at_most, 4),
            }
        ),
        # Sorted, as they come back from the kit folder.
        "voxel_energy": {key: round(float(voxels.energy[key]), 4) for key in sorted(voxels.energy)},
        "moves": len(motion.moves) - 1,
        "voxel_mm": joinery.voxel_mm,
        "clearance_mm": joinery.clearance_mm,
        "barrel_radius_mm": joinery.barrel_radius_mm,
        "carved_cells": joinery.carved_cells,
        "carved_mm3": round(joinery.carved_mm3, 2),
        "rounded_cells": joinery.rounded_cells,
        "rounded_skin_mm3": round(joinery.rounded_skin_mm3, 2),
        "rounded_inside_mm3": round(joinery.rounded_inside_mm3, 2),
        "dropped_mm3": round(joinery.dropped_mm3, 2),
        "struts": joinery.struts,
        "volume_mm3": round(sum(body.volume for body in joinery.bodies), 1),
        "box_mm": [side * joinery.voxel_mm for side in tree.template.shape],
        "print": "in-place" if built.apart is None else "apart",
        **({"profile": profile} if profile else {}),
        **_printed_apart(built),
        **({} if built.retention is None else retention_summary(built, built.retention)),
        "notes": [*joinery.notes, *(note for note in voxels.notes if note not in solid.notes)],
        "refused_trees": list(built.refused),
        **({"wishes": list(wishes)} if wishes else {}),
    }


def _printed_apart(built: BuiltTree) -> dict[str, Any]:
    """Figures of pins and plates, where the kit is printed body by body."""
    joinery, apart = built.joinery, built.apart
    if apart is None:
        return {}
    names = [body.name for body in joinery.bodies]
    return {
        "face_gap_mm": joinery.face_gap_mm,
        "pins": len(joinery.pins),
        "pin_mm": 2 * joinery.pin_radius_mm,
        "plates": apart.plates.count,
        "bodies_with_support": [names[body] for body in apart.plates.supported],
        "bodies_with_brim": [names[body] for body in apart.plates.leaning],
    }


def write_tree(folder: Path, tree: FoldTree, voxel_mm: float) -> None:
    """Write ``tree.json`` of a tree that is not built yet; another tree's motion goes."""
    (folder / "motion.json").unlink(missing_ok=True)
    write_json(folder / "tree.json", tree.to_json(voxel_mm, (0.0, 0.0, 0.0)))


def write_planned(folder: Path, planned: PlannedTree, voxel_mm: float) -> None:
    """Write ``tree.json`` and ``motion.json`` of a tree that is not built yet."""
    write_tree(folder, planned.tree, voxel_mm)
    write_json(folder / "motion.json", planned.motion.to_json())


def write_pareto(folder: Path, found: Sequence[Solution], progress: Progress) -> None:
    """Write ``pareto.json`` and ``pareto-1.png`` ..., one picture for each solution."""
    for old in sorted(folder.glob("pareto-*.png")):
        old.unlink()
    for number, solution in enumerate(found, start=1):
        image = picture_of_tree(solution.voxels, solution.candidate.tree)
        write_bytes(folder / f"pareto-{number}.png", png_bytes(image))
        progress.update(number / len(found), f"{number} of {len(found)}")
    entries = [solution.to_json(number) for number, solution in enumerate(found, start=1)]
    content = {"format": "fabfold-pareto", "version": 1, "solutions": entries}
    write_json(folder / "pareto.json", content)


def write_built(folder: Path, built: BuiltTree) -> None:
    """Write ``tree.json``, ``motion.json`` and ``bodies/`` of a tree that was built."""
    tree, joinery = built.planned.tree, built.joinery
    write_json(folder / "tree.json", tree.to_json(joinery.voxel_mm, joinery.origin_mm))
    write_json(folder / "motion.json", built.planned.motion.to_json())
    names = {f"{body.name}.stl" for body in joinery.bodies}
    for old in sorted((folder / "bodies").glob("*.stl")):
        if old.name not in names:  # of a tree with more bodies
            old.unlink()
    write_stl(folder / "bodies", joinery)


def write_printable(
    folder: Path,
    recipe: Recipe,
    mode: PrintMode,
    built: BuiltTree,
    guide: Mapping[str, bytes] | None = None,
    *,
    slicers: bool = True,
) -> None:
    """Write the tree, its certified motion, the bodies as STL, 3MF and URDF, and what to buy.

    Parameters
    ----------
    folder : Path
        Kit folder.
    recipe : Recipe
        Names the files.
    mode : PrintMode
        How it is printed; the profile is named in the 3MF.
    built : BuiltTree
        What is written.
    guide : mapping of str to bytes, optional
        Manual and pictures for Bambu Studio, by folder and name.
    slicers : bool
        Whether the files for single slicers are written beside the 3MF that all can read.
    """
    from fabfold.apart.plate_files import remove_plates, write_bill, write_plates

    tree, joinery = built.planned.tree, built.joinery
    name, colours = recipe.name, body_colours(tree)
    metadata = {
        "Application": f"fabfold {__version__}",
        "Description": (
            f"{len(tree.bodies)} bodies, {len(tree.hinges)} hinges, voxel "
            f"{joinery.voxel_mm:g} mm, clearance {joinery.clearance_mm:g} mm, "
            f"profile {mode.profile.name}, seed {recipe.seed}"
        ),
    }
    write_built(folder, built)
    write_bill(folder, joinery, mode.profile.material, mode.pin, built.retention)
    beside: dict[str, bytes] = dict(guide or {})
    if guide:
        beside["Bill of Materials/bom.csv"] = (folder / "bom.csv").read_bytes()
    if built.apart is not None:
        write_plates(folder, name, tree, joinery, built.apart, colours, metadata, beside)
        remove_slicer_files(folder, name, [SLICER_ENDINGS["bambu"]])
    else:
        remove_plates(folder)
        printed = joinery
        if mode.pose != "a":
            pose = print_pose(tree, built.planned.motion, joinery, mode.profile, mode.pose)
            printed = posed_kit(joinery, pose)
            metadata["Description"] += f"; {pose.figures}"
        title = f"{name} folds into {tree.template.name}"
        picture = thumbnail(printed.drawn, colours)
        write_3mf(
            folder / f"{name}.3mf",
            printed,
            title=title,
            metadata=metadata,
            colours=colours,
            thumbnail=picture,
        )
        if slicers:
            write_slicer_files(
                folder,
                name,
                printed,
                recipe.slicer,
                title=title,
                metadata=metadata,
                colours=colours,
                thumbnail=picture,
                auxiliaries=beside,
            )
    if built.retention is not None:
        write_json(folder / "retention.json", retention_data(built, built.retention))
    else:
        (folder / "retention.json").unlink(missing_ok=True)
    write_urdf(folder / f"{name}.urdf", joinery, tree, built.planned.motion, name)


def write_checks(
    folder: Path,
    solid: Solid,
    built: BuiltTree,
    checks: list[Check],
    wishes: Sequence[dict[str, Any]] = (),
    closure: BoxClosure | None = None,
    profile: str = "",
    pictures: Sequence[tuple[str, bytes]] = (),
) -> None:
    """Write ``report.json`` and ``report.html``, with what became of each wish and of the box."""
    summary = kit_summary(solid, built, wishes, closure, profile)
    places = figure_pictures(checks, built)
    write_report(folder, checks, summary, title=solid.name, pictures=pictures, where=places)


def write_kit(
    folder: Path,
    recipe: Recipe,
    mode: PrintMode,
    solid: Solid,
    built: BuiltTree,
    checks: list[Check],
    progress: Progress,
    finish_step: Callable[[], None],
    wishes: Sequence[dict[str, Any]] = (),
    template: Template | None = None,
    closure: BoxClosure | None = None,
) -> None:
    """Write every file of the kit into `folder`.

    Parameters
    ----------
    folder : Path
        Made where it is missing; files of an older export are replaced one by one.
    recipe : Recipe
        Written as ``kit.toml``; names the files.
    mode : PrintMode
        How it is printed.
    solid : Solid
        The model; its repairs are told in the report.
    built : BuiltTree
        Tree, motion with certificate, and printed bodies.
    checks : list of Check
        Every check, passed or failed.
    progress : Progress
        Hears which file is written.
    finish_step : callable
        Returns once the STEP file is there; the report, written last, says that the kit is whole.
    wishes : sequence of dict
        What became of each wish.
    template : Template, optional
        The target as it is filled; one with creases is also written as it lies flat.
    closure : BoxClosure, optional
        How closed the box is, and could be.
    """
    tree, motion, joinery = built.planned.tree, built.planned.motion, built.joinery
    name = recipe.name
    colours = body_colours(tree)
    write_text(folder / "kit.toml", recipe.to_toml())
    progress.update(0.05, "pictures of the steps")
    guide = write_guide(folder, recipe, mode, built, ProgressPart(progress, 0.05, 0.5))
    progress.update(0.5, "bodies and 3MF")
    write_printable(folder, recipe, mode, built, guide)
    flat = None if template is None else flat_poses(joinery, tree, motion, template)
    if flat is None:
        (folder / f"{name}-flat.3mf").unlink(missing_ok=True)
    if template is not None and flat is not None:
        write_3mf(
            folder / f"{name}-flat.3mf",
            posed(joinery, flat),
            title=f"{name} laid flat as {template.name}",
            metadata={"Application": f"fabfold {__version__}"},
            colours=colours,
        )
    progress.update(0.6, "animation")
    write_glb(folder / "fold.glb", joinery, tree, motion, title=name, colours=colours)
    progress.update(0.8, "STEP")
    finish_step()
    progress.update(0.95, "report")
    pictures = [("The model, half-way, and folded", guide[PICTURE])]
    write_checks(folder, solid, built, checks, wishes, closure, mode.profile.name, pictures)
    progress.update(1.0, str(folder))
