"""The fold as a film or as a moving picture, drawn without a display."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import RecipeError
from fabfold.export.camera import View
from fabfold.export.render import Image, Mesh, posed_points, render
from fabfold.export.shading import corner_normals
from fabfold.files import replacing
from fabfold.guide.fold_steps import FoldStep, turned
from fabfold.guide.manual import StepPlan
from fabfold.progress import Progress, SilentProgress

__all__ = ["FILM_ENDINGS", "film_frames", "write_film"]

#: What a film can be written as.
FILM_ENDINGS = (".mp4", ".gif")
#: Pictures a second, of a film and of a GIF.
_RATES = {".mp4": 24, ".gif": 12}
#: Seconds that a quarter turn takes, that the camera takes to go round, and rests at the ends.
_QUARTER, _ROUND, _REST = 0.7, 0.5, 1.2


def _eased(count: int) -> Iterator[float]:
    for index in range(count):
        share = (index + 1) / count
        yield float(0.5 - 0.5 * np.cos(np.pi * share))


def _nearer(azimuth: float, goal: float) -> float:
    """The goal, or it a full turn on or back, so that the camera goes the short way."""
    return goal + 360.0 * round((azimuth - goal) / 360.0)


def film_frames(plan: StepPlan, rate: int) -> list[tuple[FoldStep, float, float, float]]:
    """What each picture of a film shows.

    Parameters
    ----------
    plan : StepPlan
        Steps and views.
    rate : int
        Pictures a second.

    Returns
    -------
    list of (FoldStep, float, float, float)
        Step, share of it that is done, azimuth and height of the camera in degrees.
    """
    first = plan.views[0]
    azimuth, height = first.azimuth_deg, first.elevation_deg
    frames = [(plan.steps[0], 0.0, azimuth, height)] * max(1, round(_REST * rate))
    for step, view in zip(plan.steps, plan.views, strict=False):
        goal = _nearer(azimuth, view.azimuth_deg), view.elevation_deg
        if goal != (azimuth, height):
            for share in _eased(max(1, round(_ROUND * rate))):
                at = azimuth + share * (goal[0] - azimuth), height + share * (goal[1] - height)
                frames.append((step, 0.0, *at))
            azimuth, height = goal
        for share in _eased(max(2, round(_QUARTER * step.degrees / 90 * rate))):
            frames.append((step, share, azimuth, height))
    last = plan.views[-1]
    goal = _nearer(azimuth, last.azimuth_deg), last.elevation_deg
    for share in _eased(max(1, round(_ROUND * rate))):
        at = azimuth + share * (goal[0] - azimuth), height + share * (goal[1] - height)
        frames.append((plan.steps[-1], 1.0, *at))
    return frames + [frames[-1]] * max(1, round(_REST * rate))


def _pictures(
    meshes: Sequence[Mesh],
    colours: NDArray[np.uint8],
    frames: Sequence[tuple[FoldStep, float, float, float]],
    size: tuple[int, int],
    progress: Progress,
) -> Iterator[Image]:
    """Draw frames, each that is shown for a time once, with a camera that does not jump."""
    reach = 0.0
    for step in {frame[0].number: frame[0] for frame in frames}.values():
        for poses in (step.before, step.after):
            spread = np.ptp(posed_points(meshes, poses), axis=0)
            reach = max(reach, float(np.linalg.norm(spread)))
    distance = 0.5 * reach / np.tan(np.radians(12.0)) * 0.88
    smooth = [corner_normals(vertices, faces) for vertices, faces in meshes]
    before: tuple[FoldStep, float, float, float] | None = None
    picture: Image | None = None
    for number, frame in enumerate(frames, start=1):
        if before is None or frame is not before:
            step, share, azimuth, height = frame
            view = View(azimuth, height, size=size, lights=4, samples=2)
            poses = turned(step, share)
            picture = render(meshes, colours, poses, view, distance=distance, smooth=smooth)
        before = frame
        progress.update(number / len(frames), f"picture {number} of {len(frames)}")
        assert picture is not None
        yield picture


def write_film(
    path: Path,
    meshes: Sequence[Mesh],
    colours: NDArray[np.uint8],
    plan: StepPlan,
    *,
    size: tuple[int, int] = (640, 480),
    progress: Progress | None = None,
) -> None:
    """Write the fold as a film.

    Parameters
    ----------
    path : Path
        File to write, with one of the endings :data:`FILM_ENDINGS`.
    meshes : sequence of (vertices, faces)
        Bodies in shape A, mm.
    colours : (b, 3) uint8 array
        Colour of each body, sRGB.
    plan : StepPlan
        Steps and views.
    size : (int, int)
        Width and height of the film in pixels, both even.
    progress : Progress, optional
        Hears of every picture.

    Raises
    ------
    RecipeError
        If imageio-ffmpeg is not installed, which an MP4 needs.
    """
    ending = path.suffix.lower()
    rate = _RATES[ending]
    frames = film_frames(plan, rate)
    pictures = _pictures(meshes, colours, frames, size, progress or SilentProgress())
    with replacing(path) as temporary:
        if ending == ".mp4":
            _write_mp4(temporary, pictures, size, rate)
        else:
            _write_gif(temporary, pictures, rate)


def _write_mp4(path: Path, pictures: Iterator[Image], size: tuple[int, int], rate: int) -> None:
    try:
        import imageio_ffmpeg
    except ImportError:
        raise RecipeError(
            "a film as MP4 needs imageio-ffmpeg: pip install 'fabfold[film]', or write a GIF"
        ) from None
    writer = imageio_ffmpeg.write_frames(
        str(path),
        size,
        fps=rate,
        codec="libx264",
        pix_fmt_out="yuv420p",
        macro_block_size=2,
        output_params=["-crf", "20", "-threads", "1", "-fflags", "+bitexact", "-f", "mp4"],
        ffmpeg_log_level="error",
    )
    writer.send(None)
    for picture in pictures:
        writer.send(np.ascontiguousarray(picture))
    writer.close()


def _write_gif(path: Path, pictures: Iterator[Image], rate: int) -> None:
    from PIL import Image as PillowImage

    drawn = [PillowImage.fromarray(picture) for picture in pictures]
    # One palette for all, so that colours do not flicker.
    palette = drawn[len(drawn) // 2].quantize(255, method=PillowImage.Quantize.MEDIANCUT)
    small = [image.quantize(palette=palette, dither=PillowImage.Dither.NONE) for image in drawn]
    small[0].save(
        path,
        "GIF",
        save_all=True,
        append_images=small[1:],
        duration=round(1000 / rate),
        loop=0,
        optimize=False,
    )
