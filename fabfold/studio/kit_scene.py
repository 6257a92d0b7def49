"""A folding kit in viser's scene: bodies, hinges, and what is picked out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from fabfold.export.colours import body_colours
from fabfold.joinery.bodies import Joinery
from fabfold.meshes import box_triangles
from fabfold.tree.fold_tree import FoldTree

if TYPE_CHECKING:
    import viser

__all__ = ["KitScene", "cube_meshes", "joinery_meshes"]

F64 = NDArray[np.float64]
Mesh = tuple[F64, NDArray[np.int32]]

#: Half side of a voxel that stands for bodies that are not built yet.
_CUBE = 0.485
_GREY = (205, 207, 212)
_PICKED = (255, 196, 0)
_HINGE = (40, 44, 52)


def cube_meshes(tree: FoldTree) -> list[Mesh]:
    """Bodies as cubes, for trees that are not built yet; lattice units of shape A.

    Parameters
    ----------
    tree : FoldTree
        Its bodies; a link plate is a thin sheet.

    Returns
    -------
    list of (vertices, faces)
        One a body.
    """
    meshes = []
    for body in tree.bodies:
        parts = [(tree.source[v].astype(float), np.full(3, _CUBE)) for v in body.voxels]
        if not parts:
            edge = tree.edges[-1 if body.edge is None else body.edge]
            one, other = (tree.source[v].astype(float) for v in (edge.parent, edge.child))
            flat = np.where(one == other, 0.45, 0.03)
            parts = [((one + other) / 2, flat)]
        corners: list[F64] = []
        faces: list[NDArray[np.int32]] = []
        for middle, half in parts:
            box, triangles = box_triangles(middle - half, middle + half)
            faces.append(triangles + 8 * len(corners))
            corners.append(box)
        meshes.append((np.concatenate(corners), np.concatenate(faces).astype(np.int32)))
    return meshes


def joinery_meshes(joinery: Joinery) -> list[Mesh]:
    """Printed bodies in lattice units of shape A."""
    origin = np.asarray(joinery.origin_mm)
    return [((b.vertices - origin) / joinery.voxel_mm, b.faces) for b in joinery.bodies]


class KitScene:
    """Bodies of one tree below one name of the scene.

    Parameters
    ----------
    server : viser.ViserServer
        Whose scene it is.
    name : str
        Of the node that everything hangs on.
    """

    def __init__(self, server: viser.ViserServer, name: str = "/kit") -> None:
        self._server, self._name = server, name
        self._tree: FoldTree | None = None
        self._bodies: list[Any] = []
        self._hinges: list[Any] = []
        self._colours: list[tuple[int, int, int]] = []
        self._picked: frozenset[int] = frozenset()
        self._angles: F64 = np.zeros(0)
        self._visible = True
        self._middle = np.zeros(3)
        #: Where the middle of shape A is in the scene.
        self.shift = np.zeros(3)
        #: Told of the body, and the ray of the click, where one is clicked.
        self.on_body: Callable[[int, F64, F64], None] | None = None
        #: Told of the hinge that is clicked.
        self.on_hinge: Callable[[int], None] | None = None
        #: Told of the body that is dragged, from where to where, and whether that is the end. Where
        #: nobody is told, a drag turns the view.
        self.on_drag: Callable[[int, F64, F64, bool], None] | None = None

    @property
    def tree(self) -> FoldTree | None:
        """What is shown."""
        return self._tree

    @property
    def angles_deg(self) -> F64:
        """Angles that are shown, degrees."""
        return self._angles

    def clear(self) -> None:
        """Take everything out of the scene."""
        for handle in (*self._hinges, *self._bodies):
            handle.remove()
        self._bodies, self._hinges, self._tree = [], [], None

    def show(self, tree: FoldTree, meshes: Sequence[Mesh], *, hinges: bool = True) -> None:
        """Show the bodies of a tree in shape A.

        Parameters
        ----------
        tree : FoldTree
            Bodies and hinges.
        meshes : sequence of (vertices, faces)
            One a body, lattice units of shape A.
        hinges : bool
            With a rod along each hinge.
        """
        self.clear()
        self._tree = tree
        self._picked = frozenset()
        self._middle = np.asarray(tree.source.mean(axis=0))
        self._colours = [(int(r), int(g), int(b)) for r, g, b in body_colours(tree)]
        for index, (vertices, faces) in enumerate(meshes):
            handle = self._server.scene.add_mesh_simple(
                f"{self._name}/{tree.bodies[index].name}",
                np.asarray(vertices, np.float32),
                np.asarray(faces, np.uint32),
                color=self._colours[index],
                flat_shading=True,
                cast_shadow=False,
                receive_shadow=False,
                visible=self._visible,
            )
            handle.on_click(self._clicked_body(index))
            if self.on_drag is not None:
                handle.on_drag(self._dragged_body(index))
            self._bodies.append(handle)
        for index, hinge in enumerate(tree.hinges if hinges else ()):
            along, middle = np.abs(np.array(hinge.direction)), np.array(hinge.point)
            half = np.where(along > 0, 0.5, 0.045)
            vertices, faces = box_triangles(middle - half, middle + half)
            handle = self._server.scene.add_mesh_simple(
                f"{self._name}/{tree.bodies[hinge.child].name}/{hinge.name}",
                np.asarray(vertices, np.float32),
                np.asarray(faces, np.uint32),
                color=_HINGE,
                flat_shading=True,
                cast_shadow=False,
                receive_shadow=False,
                visible=self._visible,
            )
            handle.on_click(self._clicked_hinge(index))
            self._hinges.append(handle)
        self.pose(np.zeros(len(tree.hinges)))

    def _clicked_body(self, index: int) -> Callable[[Any], None]:
        def clicked(event: Any) -> None:
            if self.on_body is not None:
                self.on_body(index, np.array(event.ray_origin), np.array(event.ray_direction))

        return clicked

    def _dragged_body(self, index: int) -> Callable[[Any], None]:
        def dragged(event: Any) -> None:
            if self.on_drag is not None:
                start, end = np.array(event.start_position), np.array(event.end_position)
                self.on_drag(index, start, end, event.phase == "end")

        return dragged

    def _clicked_hinge(self, index: int) -> Callable[[Any], None]:
        def clicked(_: Any) -> None:
            if self.on_hinge is not None:
                self.on_hinge(index)

        return clicked

    def set_visible(self, visible: bool) -> None:
        """Show or hide everything."""
        self._visible = visible
        for handle in (*self._bodies, *self._hinges):
            handle.visible = visible

    def pose(self, angles_deg: F64) -> None:
        """Fold to the given angles, (h,) degrees."""
        if self._tree is None:
            return
        self._angles = np.asarray(angles_deg, dtype=float)
        poses = self._tree.body_poses(self._angles)
        turns = Rotation.from_matrix(poses[:, :3, :3]).as_quat()[:, (3, 0, 1, 2)]
        places = poses[:, :3, 3] + self.shift - self._middle
        with self._server.atomic():
            for handle, turn, place in zip(self._bodies, turns, places, strict=True):
                handle.wxyz = turn
                handle.position = place

    def pick(self, bodies: Sequence[int], hinges: Sequence[int] = ()) -> None:
        """Pick bodies and hinges out by colour; none puts all colours back."""
        chosen, rods = frozenset(bodies), frozenset(hinges)
        self._picked = chosen
        with self._server.atomic():
            for index, handle in enumerate(self._bodies):
                plain = self._colours[index] if not chosen else _GREY
                handle.color = self._colours[index] if index in chosen else plain
            for index, handle in enumerate(self._hinges):
                handle.color = _PICKED if index in rods else _HINGE

    @property
    def picked(self) -> frozenset[int]:
        """Bodies that are picked out."""
        return self._picked

    def nearest_voxel(self, body: int, point: F64) -> int | None:
        """Voxel of a body whose middle is nearest to a point of the scene; None for a plate."""
        if self._tree is None or not self._tree.bodies[body].voxels:
            return None
        pose = self._tree.body_poses(self._angles)[body]
        here = pose[:3, :3].T @ (point - self.shift + self._middle - pose[:3, 3])
        voxels = list(self._tree.bodies[body].voxels)
        away = np.linalg.norm(self._tree.source[voxels] - here, axis=1)
        return voxels[int(away.argmin())]

    def voxel_at(self, body: int, start: F64, along: F64) -> int | None:
        """Voxel of a body that a ray of the scene meets first, None where it meets none."""
        if self._tree is None or not self._tree.bodies[body].voxels:
            return None
        pose = self._tree.body_poses(self._angles)[body]
        here = pose[:3, :3].T @ (start - self.shift + self._middle - pose[:3, 3])
        way = pose[:3, :3].T @ along
        best: tuple[float, int] | None = None
        for voxel in self._tree.bodies[body].voxels:
            low, high = (self._tree.source[voxel] + s for s in (-0.5, 0.5))
            with np.errstate(divide="ignore", invalid="ignore"):
                times = np.sort(np.array([(low - here) / way, (high - here) / way]), axis=0)
            enter, leave = float(np.nanmax(times[0])), float(np.nanmin(times[1]))
            if enter <= leave and leave > 0 and (best is None or enter < best[0]):
                best = (enter, voxel)
        return None if best is None else best[1]
