"""Pictures beside the checks of a report show the bodies and the pose that a figure is about."""

from __future__ import annotations

import io
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from PIL import Image

from fabfold.kit.figure_pictures import figure_pictures, place_of
from fabfold.printing.checks import Check


def check(note: str, name: str = "thinnest wall") -> Check:
    return Check(name=name, figure=1.0, limit=0.5, unit="mm", ok=True, note=note)


@pytest.fixture(scope="module")
def built(bar_kit: Any) -> Any:
    return bar_kit.join()


def test_bodies_and_pose_are_read_from_the_note(built: Any) -> None:
    tree, motion = built.planned.tree, built.planned.motion
    bodies, angles = place_of(check("the most on body-01 (12 %)"), tree, motion)
    assert bodies == [1]
    assert np.array_equal(angles, motion.angles_deg[0])
    hinge = motion.moves[2][0]
    note = f"move 2 of 9 ({tree.hinges[hinge].name}), 20°: body-02 and body-00"
    bodies, angles = place_of(check(note), tree, motion)
    assert bodies == [0, 2]
    wanted = motion.angles_deg[1].copy()
    wanted[hinge] += 20.0 * np.sign(motion.angles_deg[2, hinge] - wanted[hinge])
    assert np.allclose(angles, wanted)
    assert place_of(check("all 4 meshes are watertight; body-99 is none"), tree, motion) is None


def test_the_smallest_gap_is_shown_in_its_move(built: Any) -> None:
    tree, motion = built.planned.tree, built.planned.motion
    moves = [{**move, "min_gap_mm": 0.9} for move in motion.certificate["moves"]]
    moves[1]["min_gap_mm"] = 0.5
    motion = replace(motion, certificate={**motion.certificate, "moves": moves})
    bodies, angles = place_of(check("proven", "smallest gap on the folding path"), tree, motion)
    hinge = tree.hinges[motion.moves[2][0]]
    assert bodies == [hinge.parent, hinge.child]
    assert np.allclose(angles, motion.angles_deg[1:3].mean(axis=0))


def test_what_is_named_is_seen_in_colour(built: Any) -> None:
    drawn = figure_pictures([check("body-00"), check("nothing", "volume")], built)
    assert list(drawn) == ["thinnest wall"]
    pixels = np.asarray(Image.open(io.BytesIO(drawn["thinnest wall"])).convert("RGB")).astype(int)
    red = pixels[..., 0] > 1.8 * pixels[..., 1]
    assert 300 < red.sum() < 0.5 * red.size


def test_the_page_holds_the_pictures(bar_kit: Any) -> None:
    page = (bar_kit.folder / "report.html").read_text(encoding="utf-8")
    assert page.count('class="where"') >= 3
    assert "http" not in page.split("<body>")[1]
