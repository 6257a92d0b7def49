"""Pictures of a kit in any state of its motion."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fabfold.export.camera import View, camera_for, project
from fabfold.export.colours import body_colours
from fabfold.export.render import Image, png_bytes, posed_points, render
from fabfold.files import write_bytes
from fabfold.fold.motion import Motion
from fabfold.joinery.bodies import Joinery
from fabfold.joinery.body_poses import poses_in_mm
from fabfold.lattice.rotations import ROTATIONS
from fabfold.tree.fold_tree import FoldTree

__all__ = ["halfway", "nearest_lattice", "picture_of_kit", "strip", "write_strip"]


def _poses_mm(
    joinery: Joinery,
    tree: FoldTree,
    angles_deg: NDArray[np.float64],
    upright: NDArray[np.float64] | None,
) -> NDArray[np.float64]:
    """Poses (b, 4, 4) of the bodies in mm, turned by the rotation `upright` if there is one."""
    poses = poses_in_mm(tree, joinery, angles_deg)
    if upright is not None:
        turn = np.eye(4)
        turn[:3, :3] = upright
        poses = turn @ poses
    return np.asarray(poses)


def picture_of_kit(
    joinery: Joinery,
    tree: FoldTree,
    angles_deg: NDArray[np.float64] | None = None,
    view: View | None = None,
    *,
    colours: NDArray[np.uint8] | None = None,
    upright: NDArray[np.float64] | None = None,
    distance: float | None = None,
) -> Image:
    """Draw a kit in any state of its motion.

    Parameters
    ----------
    joinery : Joinery
        The printed bodies in shape A.
    tree : FoldTree
        The bodies and hinges, in the same order.
    angles_deg : (h,) float64 array, optional
        Angle of every hinge in degrees; shape A by default.
    view : View, optional
        Direction, size and light of the picture.
    colours : (b, 3) uint8 array, optional
        Colour of each body, sRGB; by default :func:`~fabfold.export.colours.body_colours`.
    upright : (3, 3) float64 array, optional
        Rotation from shape A's axes to the picture's, whose z is up: ``voxels.rotation.T`` shows
        the model as it came in.
    distance : float, optional
        Distance of the camera from the middle of the kit in mm, see
        :func:`~fabfold.export.render.render`.

    Returns
    -------
    (height, width, 3) uint8 array
        The picture, sRGB.
    """
    angles = np.zeros(len(tree.hinges)) if angles_deg is None else angles_deg
    return render(
        joinery.drawn,
        body_colours(tree) if colours is None else colours,
        _poses_mm(joinery, tree, angles, upright),
        view,
        distance=distance,
    )


def halfway(motion: Motion) -> NDArray[np.float64]:
    """Angles of the hinges when half of all turning is done.

    Parameters
    ----------
    motion : Motion
        The folding path.

    Returns
    -------
    (h,) float64 array
        Angle of every hinge in degrees.
    """
    turns = np.abs(np.diff(motion.angles_deg, axis=0)).sum(axis=1)
    done = np.concatenate([[0.0], np.cumsum(turns)])
    if done[-1] <= 0.0:
        return np.asarray(motion.angles_deg[0])
    move = int(np.searchsorted(done, done[-1] / 2, side="right")) - 1
    move = min(move, len(turns) - 1)
    share = (done[-1] / 2 - done[move]) / turns[move]
    return np.asarray(
        motion.angles_deg[move] + share * (motion.angles_deg[move + 1] - motion.angles_deg[move])
    )


def nearest_lattice(rotation: NDArray[np.float64]) -> NDArray[np.float64]:
    """The lattice rotation that turns least from a rotation.

    Parameters
    ----------
    rotation : (3, 3) float64 array
        Any rotation.

    Returns
    -------
    (3, 3) float64 array
        One of the 24 that take the lattice onto itself.
    """
    traces = np.einsum("rij,ij->r", ROTATIONS, rotation)
    return np.asarray(ROTATIONS[int(np.round(traces, 9).argmax())], dtype=np.float64)


def _reach(points: NDArray[np.float64], view: View) -> float:
    """Distance from which points fill the height of a picture."""
    tall = replace(view, size=(8192, 64))
    camera = camera_for(points, tall, tall.size, None)
    z = points @ camera.frame[2]
    return float(camera.eye @ camera.frame[2] - (z.max() + z.min()) / 2)


def _width(points: NDArray[np.float64], view: View, distance: float) -> int:
    """Pixels that points take across, with the margins, from a distance."""
    wide = replace(view, size=(8192, view.size[1]))
    screen = project(points, camera_for(points, wide, wide.size, distance))
    room = 2 * view.margin * view.size[1]
    return int(np.clip(np.ceil(np.ptp(screen[:, 0]) + room), 64, 8192))


def strip(
    joinery: Joinery,
    tree: FoldTree,
    motion: Motion,
    view: View | None = None,
    *,
    colours: NDArray[np.uint8] | None = None,
    upright: NDArray[np.float64] | None = None,
    between: bool = True,
) -> Image:
    """Shape A, the kit half-way, and shape B side by side, at one scale.

    Parameters
    ----------
    joinery : Joinery
        The printed bodies in shape A.
    tree : FoldTree
        The bodies and hinges, in the same order.
    motion : Motion
        The folding path.
    view : View, optional
        Direction, size and light; the height of its size is the strip's, and each part is as wide
        as it needs.
    colours : (b, 3) uint8 array, optional
        Colour of each body, sRGB.
    upright : (3, 3) float64 array, optional
        Rotation from shape A's axes to the picture's, see :func:`picture_of_kit`. After A the
        nearest rotation of the lattice is taken, so that the box stands straight.
    between : bool
        Whether the kit half-way is shown too.

    Returns
    -------
    (height, width, 3) uint8 array
        The picture, sRGB.
    """
    view = view or View(size=(560, 560))
    stand = None if upright is None else nearest_lattice(upright)
    states = [(motion.angles_deg[0], upright), (motion.angles_deg[-1], stand)]
    if between:
        states.insert(1, (halfway(motion), stand))
    clouds = [
        posed_points(joinery.drawn, _poses_mm(joinery, tree, angles, turn))
        for angles, turn in states
    ]
    distance = max(_reach(cloud, view) for cloud in clouds)
    pictures = []
    for (angles, turn), cloud in zip(states, clouds, strict=True):
        part = replace(view, size=(_width(cloud, view, distance), view.size[1]))
        pictures.append(
            picture_of_kit(
                joinery, tree, angles, part, colours=colours, upright=turn, distance=distance
            )
        )
    return np.concatenate(pictures, axis=1)


def write_strip(
    path: Path,
    joinery: Joinery,
    tree: FoldTree,
    motion: Motion,
    view: View | None = None,
    *,
    colours: NDArray[np.uint8] | None = None,
    upright: NDArray[np.float64] | None = None,
) -> None:
    """Write shape A, the kit half-way, and shape B side by side as a PNG file.

    Parameters
    ----------
    path : Path
        File to write, ending in ``.png``.
    joinery : Joinery
        The printed bodies in shape A.
    tree : FoldTree
        The bodies and hinges, in the same order.
    motion : Motion
        The folding path.
    view : View, optional
        Direction, size and light, see :func:`strip`.
    colours : (b, 3) uint8 array, optional
        Colour of each body, sRGB.
    upright : (3, 3) float64 array, optional
        Rotation from shape A's axes to the picture's, see :func:`strip`.
    """
    image = strip(joinery, tree, motion, view, colours=colours, upright=upright)
    write_bytes(path, png_bytes(image))
