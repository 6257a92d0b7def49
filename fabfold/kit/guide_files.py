"""Write what people fold a kit by: the manual, and the page that plays."""

from __future__ import annotations

from pathlib import Path

from fabfold.errors import RecipeError
from fabfold.export.colours import body_colours
from fabfold.export.kit_picture import strip, write_strip
from fabfold.export.render import png_bytes
from fabfold.files import write_bytes, write_text
from fabfold.guide.advice import assembly_lines, content_lines, print_lines
from fabfold.guide.fold_page import fold_page
from fabfold.guide.manual import draw_manual, plan_steps
from fabfold.guide.manual_html import manual_html
from fabfold.guide.manual_pdf import manual_pdf
from fabfold.guide.pauses import print_pauses
from fabfold.kit.stages import BuiltTree
from fabfold.printing.print_mode import PrintMode
from fabfold.progress import Progress
from fabfold.recipe.recipe import Recipe

__all__ = ["PICTURE", "render_kit", "write_guide"]

#: What the picture of the kit is called among the files for Bambu Studio.
PICTURE = "Model Pictures/folding.png"


def write_guide(
    folder: Path, recipe: Recipe, mode: PrintMode, built: BuiltTree, progress: Progress
) -> dict[str, bytes]:
    """Write ``fold.png``, ``manual.pdf``, ``manual-letter.pdf``, ``manual.html``, ``fold.html``.

    Parameters
    ----------
    folder : Path
        Kit folder.
    recipe : Recipe
        Names the kit.
    mode : PrintMode
        How it is printed.
    built : BuiltTree
        Tree, motion with certificate, and printed bodies.
    progress : Progress
        Hears of every step that is drawn.

    Returns
    -------
    dict of str to bytes
        What of it goes into the 3MF for Bambu Studio, by folder and name.
    """
    tree, motion, joinery = built.planned.tree, built.planned.motion, built.joinery
    upright, colours = built.planned.voxels.rotation.T, body_colours(tree)
    cover = strip(joinery, tree, motion, colours=colours, upright=upright)
    picture = png_bytes(cover)
    write_bytes(folder / "fold.png", picture)
    plan = plan_steps(joinery, tree, motion, upright)
    manual = draw_manual(
        joinery,
        tree,
        motion,
        plan,
        title=recipe.name,
        cover=cover,
        colours=colours,
        contents=content_lines(joinery, tree, mode, built.retention),
        advice=print_lines(mode, joinery, print_pauses(built.retention, built.apart)),
        assembly=assembly_lines(joinery, built.apart),
        retention=built.retention,
        progress=progress,
    )
    paper = manual_pdf(manual, "a4")
    write_bytes(folder / "manual.pdf", paper)
    write_bytes(folder / "manual-letter.pdf", manual_pdf(manual, "letter"))
    write_text(folder / "manual.html", manual_html(manual))
    facts = f"{len(tree.bodies)} parts, {len(tree.hinges)} hinges, {manual.subtitle}"
    page = fold_page(
        joinery,
        tree,
        motion,
        plan,
        title=recipe.name,
        facts=facts,
        colours=colours,
    )
    write_text(folder / "fold.html", page)
    return {
        "Assembly Guide/manual.pdf": paper,
        PICTURE: picture,
    }


def render_kit(built: BuiltTree, path: Path, size: tuple[int, int], progress: Progress) -> None:
    """Draw the folding of a kit as a film, a GIF, or a strip of three pictures.

    Parameters
    ----------
    built : BuiltTree
        Tree, motion and printed bodies.
    path : Path
        File to write; its ending says what: ``.mp4``, ``.gif`` or ``.png``.
    size : (int, int)
        Width and height of the film in pixels.
    progress : Progress
        Hears of every picture.

    Raises
    ------
    RecipeError
        If it cannot be written as such a file.
    """
    from fabfold.guide.film import FILM_ENDINGS, write_film

    ending = path.suffix.lower()
    if ending not in (*FILM_ENDINGS, ".png"):  # Before anything is drawn.
        endings = ", ".join((*FILM_ENDINGS, ".png"))
        raise RecipeError(f"--output {path.name}: its ending must be one of {endings}")
    tree, motion, joinery = built.planned.tree, built.planned.motion, built.joinery
    upright, colours = built.planned.voxels.rotation.T, body_colours(tree)
    if ending == ".png":
        write_strip(path, joinery, tree, motion, colours=colours, upright=upright)
        return
    plan = plan_steps(joinery, tree, motion, upright)
    write_film(path, joinery.drawn, colours, plan, size=size, progress=progress)
