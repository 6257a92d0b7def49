"""Films of the fold: their frames follow the steps, and the files are films."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image
from test_robust import command

from fabfold.guide.film import film_frames
from fabfold.guide.manual import plan_steps


@pytest.fixture(scope="module")
def plan(bar_kit):
    built = bar_kit.join()
    upright = built.planned.voxels.rotation.T
    return plan_steps(built.joinery, built.planned.tree, built.planned.motion, upright)


def test_frames_go_through_all_steps_and_nothing_jumps(plan):
    frames = film_frames(plan, 24)
    done = [step.number - 1 + share for step, share, _, _ in frames]
    assert done[0] == 0
    assert done[-1] == len(plan.steps)
    assert (np.diff(done) >= 0).all()
    degrees = np.array([step.degrees for step, *_ in frames])
    assert (np.diff(done) * degrees[1:]).max() < 15  # degrees a picture
    assert np.abs(np.diff([azimuth for *_, azimuth, _ in frames])).max() < 30
    assert np.abs(np.diff([height for *_, height in frames])).max() < 30


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["gif", "mp4", "png"])
def test_the_command_writes_what_its_ending_says(ending, bar_kit, plan, tmp_path):
    path = tmp_path / f"fold.{ending}"
    arguments = ("render", bar_kit.folder, "-o", path, "--size", "128x96", "-q")
    done = command(*arguments)
    assert done.exit_code == 0, done.stderr
    content = path.read_bytes()
    if ending == "mp4":
        assert content[4:8] == b"ftyp"
        command(*arguments)
        assert path.read_bytes() == content
    else:
        with Image.open(path) as image:
            assert image.format == ending.upper()
            if ending == "gif":
                assert image.size == (128, 96)
                # Pillow joins pictures that are the same.
                assert 0.5 * len(film_frames(plan, 12)) < image.n_frames
    assert not list(tmp_path.glob(".part-*"))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [(("-o", "fold.avi"), "mp4"), (("--size", "large"), "--size large"), (("--size", "8x8"), "64")],
)
def test_what_cannot_be_drawn_is_told(arguments, words, bar_kit, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = command("render", bar_kit.folder, "-q", *arguments)
    assert done.exit_code == 2
    assert words in done.stderr
    assert list(tmp_path.iterdir()) == []
