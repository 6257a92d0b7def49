"""The manual and the page: what they show is the certified path."""

from __future__ import annotations

import re
import shutil
import subprocess
import zipfile
from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations, pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pymeshlab
import pytest

from fabfold.export.camera import View, direction_frame, project
from fabfold.guide.fold_steps import gathered, turned
from fabfold.guide.manual import STEP_PIXELS, Manual, ManualStep, plan_steps
from fabfold.guide.manual_pdf import manual_pdf
from fabfold.guide.step_drawing import MOVING, STAYING, draw_step
from fabfold.guide.step_views import _blocks, _planned, visible_share
from fabfold.guide.wording import step_text
from fabfold.joinery.body_poses import poses_in_mm
from fabfold.meshes import is_closed

#: Least share of what moves that must be seen at the start of a step, and pixels that it covers.
LEAST_SEEN, LEAST_PIXELS = 0.3, 1500


@pytest.fixture(scope="module")
def kit(bar_kit: Any) -> SimpleNamespace:
    built = bar_kit.join()
    joinery, tree, motion = built.joinery, built.planned.tree, built.planned.motion
    plan = plan_steps(joinery, tree, motion, built.planned.voxels.rotation.T)
    meshes = [(body.vertices, body.faces) for body in joinery.bodies]
    return SimpleNamespace(
        joinery=joinery, tree=tree, motion=motion, plan=plan, meshes=meshes, folder=bar_kit.folder
    )


@pytest.fixture(scope="module")
def drawn(kit: SimpleNamespace) -> list[Any]:
    pairs = zip(kit.plan.groups, kit.plan.group_views, strict=False)
    return [
        draw_step(kit.meshes, step, view, kit.joinery.voxel_mm, STEP_PIXELS) for step, view in pairs
    ]


def phases(kit: SimpleNamespace, drawn: list[Any]) -> Iterator[tuple[Any, Any, Any]]:
    """Every picture of turns that are made at once: step, view, picture."""
    for step, view, picture in zip(kit.plan.groups, kit.plan.group_views, drawn, strict=False):
        for phase, panel in zip(step.phases, picture.panels or (picture,), strict=True):
            yield phase, view, panel


def test_pictures_are_drawn_from_meshes_as_fine_as_they_show(kit: SimpleNamespace) -> None:
    """Fewer triangles, closed, and no further from the body than a two-hundredth of a voxel."""
    most = 0.005 * kit.joinery.voxel_mm
    for body, (points, triangles) in zip(kit.joinery.bodies, kit.joinery.drawn, strict=True):
        assert len(triangles) < 0.7 * len(body.faces)
        assert is_closed(triangles)
        meshes = pymeshlab.MeshSet()
        meshes.add_mesh(pymeshlab.Mesh(body.vertices, body.faces))
        meshes.add_mesh(pymeshlab.Mesh(points, triangles))
        for one, other in ((0, 1), (1, 0)):
            found = meshes.get_hausdorff_distance(
                sampledmesh=one, targetmesh=other, samplevert=True, sampleface=True
            )
            assert found["max"] <= most + 1e-6
    assert kit.joinery.drawn is kit.joinery.drawn  # Found once.


def relative(poses: np.ndarray) -> np.ndarray:
    return np.asarray(np.linalg.inv(poses[0]) @ poses)


def test_steps_go_along_the_path(kit: SimpleNamespace) -> None:
    """Each step begins and ends in the pose of the path, but for where the whole lies."""
    moves = len(kit.motion.moves) - 1
    assert len(kit.plan.steps) == moves
    for row, step in enumerate(kit.plan.steps, start=1):
        before = poses_in_mm(kit.tree, kit.joinery, kit.motion.angles_deg[row - 1])
        after = poses_in_mm(kit.tree, kit.joinery, kit.motion.angles_deg[row])
        assert np.allclose(relative(step.before), relative(before), atol=1e-9)
        assert np.allclose(relative(step.after), relative(after), atol=1e-9)
    for one, other in pairwise(kit.plan.steps):
        assert np.array_equal(one.after, other.before)


def test_the_heavier_side_stays(kit: SimpleNamespace) -> None:
    volume = np.array([body.volume for body in kit.joinery.bodies])
    for step in kit.plan.steps:
        moving = np.isin(np.arange(len(volume)), step.moving)
        assert volume[moving].sum() <= volume[~moving].sum() * (1 + 1e-9)
        assert np.array_equal(step.before[~moving], step.after[~moving])
        assert step.held not in step.moving


def test_half_of_a_step_is_half_of_its_turn(kit: SimpleNamespace) -> None:
    for row, step in enumerate(kit.plan.steps, start=1):
        angles = kit.motion.angles_deg[[row - 1, row]].mean(axis=0)
        wanted = poses_in_mm(kit.tree, kit.joinery, angles)
        assert np.allclose(relative(turned(step, 0.5)), relative(wanted), atol=1e-9)


def test_what_moves_is_seen(kit: SimpleNamespace, drawn: list[Any]) -> None:
    blocks = _blocks(kit.joinery, kit.tree)
    for step, view, picture in phases(kit, drawn):
        look = View(view.azimuth_deg, view.elevation_deg, size=(224, 168))
        before, after = blocks.posed(step.before), blocks.posed(step.after)
        moving = np.isin(blocks.body, step.all_moving)[blocks.faces[:, 0]]
        within = np.concatenate([before, after])
        assert visible_share(before, blocks.faces, moving, look, within) >= LEAST_SEEN
        # Pixels in about the colour of what moves in each turn, whatever its light.
        image = picture.image.astype(float) + 1
        red, green, blue = np.moveaxis(image, 2, 0)
        coloured = (
            (red > 2 * green) & (red > 3 * blue),
            (blue > 1.3 * green) & (blue > 3 * red),
            (blue > 1.5 * green) & (red > 1.3 * green),
        )
        for turn, pixels in zip(step.turns, coloured, strict=False):
            assert pixels.sum() > LEAST_PIXELS, (step.number, turn.hinge)
    # Without colour too, what moves is about as dark in each turn, and darker than what stays.
    grey = [float(np.dot(colour, (0.299, 0.587, 0.114))) for colour in (*MOVING, STAYING)]
    assert max(grey[:-1]) < 1.3 * min(grey[:-1]) < 0.7 * grey[-1]


def test_the_arrows_turn_as_the_hinges_do(kit: SimpleNamespace, drawn: list[Any]) -> None:
    for step, view, picture in phases(kit, drawn):
        height, width = picture.image.shape[:2]
        away = direction_frame(view.azimuth_deg, view.elevation_deg)[2]
        assert len(picture.arrows) == len(picture.labels) == len(step.turns)
        for turn, arrow in zip(step.turns, picture.arrows, strict=True):
            assert (arrow >= 0).all()
            assert (arrow[:, 0] < width).all()
            assert (arrow[:, 1] < height).all()
            towards = float(turn.axis @ away)
            if abs(towards) < 0.2:
                continue
            (hinge,) = project(turn.point[None], picture.camera)[:, :2]
            spokes = arrow - hinge
            # y points down: a turn that is counter-clockwise for the reader is negative here.
            cross = spokes[:-1, 0] * spokes[1:, 1] - spokes[:-1, 1] * spokes[1:, 0]
            assert np.sign(cross.sum()) == -np.sign(towards), step.number


def test_angles_stand_inside_the_picture_and_beside_the_arrow_heads(
    kit: SimpleNamespace, drawn: list[Any]
) -> None:
    for _, _, picture in phases(kit, drawn):
        height, width = picture.image.shape[:2]
        for (left, top, right, bottom), arrow in zip(picture.labels, picture.arrows, strict=True):
            assert 0 <= left < right <= width
            assert 0 <= top < bottom <= height
            x, y = arrow[-1]
            assert not (left < x < right and top < y < bottom)
        for one, other in combinations(picture.labels, 2):
            assert (
                one[2] <= other[0] or other[2] <= one[0] or one[3] <= other[1] or other[3] <= one[1]
            )


def test_merged_steps_are_those_that_were_proven(kit: SimpleNamespace) -> None:
    """Groups hold every move once, in order; their parts have no body in common."""
    proven = [tuple(pair) for pair in kit.motion.certificate["any_order"]]
    sizes = [len(group.turns) + len(group.then) for group in kit.plan.groups]
    assert sum(sizes) == len(kit.plan.steps)
    at = 0
    merged = []
    for number, group in enumerate(kit.plan.groups, start=1):
        assert group.number == number
        size = len(group.turns) + len(group.then)
        mine = kit.plan.steps[at : at + size]
        turns = (*group.turns, *group.then)
        assert [turn.hinge for turn in turns] == [step.hinge for step in mine]
        assert len(set(group.all_moving)) == len(group.all_moving)
        assert np.allclose(group.before, mine[0].before)
        assert np.allclose(group.phases[-1].after, mine[-1].after)
        for one, other in pairwise(group.phases):
            assert np.array_equal(one.after, other.before)
        if group.also:
            assert np.allclose(turned(group, 1.0), mine[-1].after, atol=1e-9)
            merged.append((at + 1, at + size))
        at += size
    assert set(merged) <= set(proven)
    assert merged


def test_turns_of_one_small_part_are_one_picture_of_cut_outs(kit: SimpleNamespace) -> None:
    """Three turns of the last part are gathered; those of larger parts are not."""
    steps = list(kit.plan.steps)
    small = np.array([1.0 if body in steps[0].moving else 50.0 for body in range(4)])
    one = replace(steps[0], moving=tuple(steps[0].moving))
    run = [replace(one, number=number) for number in (1, 2, 3)]
    (step,) = gathered(run, small)
    assert len(step.phases) == 3
    assert "a) " in step_text(step)
    assert "c) " in step_text(step)
    assert len(gathered(run, np.ones(4))) == 3
    # What follows on another part, and what may be made in any order, stays by itself.
    other = replace(one, moving=tuple(set(range(4)) - set(one.moving)))
    assert len(gathered([one, replace(other, number=2)], np.array([1.0, 1, 1, 1]))) == 2
    assert len(gathered([replace(one, also=(one,)), one], small)) == 2
    view = kit.plan.views[0]
    picture = draw_step(kit.meshes, step, view, kit.joinery.voxel_mm, (300, 226))
    assert picture.image.shape == (226, 300, 3)
    assert len(picture.panels) == 3
    for panel in picture.panels:
        assert panel.image.shape == (339, 450, 3)
    # Each cell shows what moves, and the fourth is empty.
    red = picture.image[..., 0].astype(int) > 1.6 * picture.image[..., 1].astype(int)
    assert red[:113, :150].sum() > 200
    assert red[:113, 150:].sum() > 200
    assert red[113:, :150].sum() > 200
    assert (picture.image[120:, 160:] == 255).all()


def test_the_whole_is_turned_where_that_pays_for_what_follows() -> None:
    seen = np.ones((4, 3))
    # A little better elsewhere, step by step: it stays as it lies.
    scores = np.array([[1.0, 1.2, 1.0], [1.0, 1.0, 1.2], [1.0, 1.2, 1.0], [1.0, 1.0, 1.2]])
    assert _planned(scores, seen, 0) == [0, 0, 0, 0]
    # Twice as good from the second step on, three times over: one turn, before the second step.
    scores = np.array([[1.0, 0.5, 1.0], [1.0, 2.0, 1.0], [1.0, 2.0, 1.0], [1.0, 2.0, 1.0]])
    assert _planned(scores, seen, 0) == [0, 1, 1, 1]
    # A hidden part asks for a turn whatever it costs; the next step stays there.
    scores = np.ones((4, 3))
    seen[2, 0] = seen[2, 1] = 0.1
    assert _planned(scores, seen, 0) == [2, 2, 2, 2]
    # What is hidden from everywhere asks for none.
    seen[2] = 0.1
    assert _planned(scores, seen, 1) == [1, 1, 1, 1]
    assert _planned(np.zeros((0, 3)), np.zeros((0, 3)), 0) == []


def words_of(pdf: Path) -> list[list[tuple[float, ...]]]:
    """Boxes of the words of each page."""
    if shutil.which("pdftotext") is None:
        pytest.skip("pdftotext (poppler-utils) is not installed")
    done = subprocess.run(
        ["pdftotext", "-bbox", str(pdf), "-"], capture_output=True, encoding="utf-8", check=True
    )
    pages = []
    for page in done.stdout.split("<page ")[1:]:
        found = re.findall(r'xMin="([\d.]+)" yMin="([\d.]+)" xMax="([\d.]+)" yMax="([\d.]+)"', page)
        pages.append([tuple(map(float, box)) for box in found])
    return pages


@pytest.mark.parametrize("name", ["manual.pdf", "manual-letter.pdf"])
def test_no_words_of_the_manual_overlap(name: str, kit: SimpleNamespace) -> None:
    pages = words_of(kit.folder / name)
    steps = -(-len(kit.plan.groups) // 6)
    assert 3 + steps <= len(pages) <= 4 + steps
    wide, high = (595.3, 841.9) if name == "manual.pdf" else (612.0, 792.0)
    for page in pages:
        assert page
        for box in page:
            assert box[0] > 0
            assert box[2] < wide
            assert box[3] < high
        for one, other in combinations(page, 2):
            across = min(one[2], other[2]) - max(one[0], other[0])
            down = min(one[3], other[3]) - max(one[1], other[1])
            # Boxes of letters are higher than letters: lines may touch.
            assert across < 0.5 or down < 2.5, (one, other)


@pytest.mark.parametrize(("paper", "high"), [("a4", 297.0), ("letter", 279.4)])
def test_words_of_four_lines_stay_in_the_place_of_their_step(
    paper: str, high: float, drawn: list[Any], tmp_path: Path
) -> None:
    text = "; ".join(f"{letter}) quarter turn (90°): 12 parts together" for letter in "abcdef")
    steps = tuple(ManualStep(number, text, text, True, drawn[0]) for number in range(1, 7))
    image = drawn[0].image
    path = tmp_path / "long.pdf"
    made = Manual("long", "", image, ("one",), ("two",), (), steps, image, (image,), ("body",))
    path.write_bytes(manual_pdf(made, paper))
    (page,) = (page for page in words_of(path) if len(page) > 6 * len(text.split()))
    top, row = 14.0, (high - 2 * 14.0 - 4.0) / 3
    lines: dict[int, set[float]] = {0: set(), 1: set(), 2: set()}
    for _, low, _, end in page:
        first, last = ((point / 72 * 25.4 - top) / row for point in (low, end))
        if first < 3:  # else the foot of the page
            assert int(first) == int(last), (low, end)
            lines[int(first)].add(round(low))
    assert all(len(found) >= 5 for found in lines.values())


def test_the_font_is_inside(kit: SimpleNamespace) -> None:
    if shutil.which("pdffonts") is None:
        pytest.skip("pdffonts (poppler-utils) is not installed")
    done = subprocess.run(
        ["pdffonts", str(kit.folder / "manual.pdf")],
        capture_output=True,
        encoding="utf-8",
        check=True,
    )
    fonts = done.stdout.splitlines()[2:]
    assert fonts
    for line in fonts:
        assert "DejaVu" in line
        assert "TrueType" in line
        assert re.search(r"Identity-H\s+yes", line), line


def test_bambu_studio_gets_the_manual_too(kit: SimpleNamespace) -> None:
    with zipfile.ZipFile(kit.folder / "bar-bambu.3mf") as archive:
        manual = archive.read("Auxiliaries/Assembly Guide/manual.pdf")
        bill = archive.read("Auxiliaries/Bill of Materials/bom.csv")
        types = archive.read("[Content_Types].xml").decode()
    assert manual == (kit.folder / "manual.pdf").read_bytes()
    assert bill == (kit.folder / "bom.csv").read_bytes()
    assert "application/pdf" in types


def test_pages_ask_for_nothing(kit: SimpleNamespace) -> None:
    for name in ("manual.html", "report.html", "fold.html"):
        page = (kit.folder / name).read_text("utf-8")
        assert "Content-Security-Policy" in page
        assert not re.search(r"""(?:src|href)=["'](?:https?:)?//""", page), name
        assert "{{" not in page or name == "fold.html"
    page = (kit.folder / "fold.html").read_text("utf-8")
    assert "Three.js Authors" in page
    assert "SPDX-License-Identifier: MIT" in page
    assert not re.search(r"\{\{[A-Z]+\}\}", page)
    assert len(page) < 2_000_000
