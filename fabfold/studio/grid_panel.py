"""The grid placed by hand over the model (paper section 3), the fill of each cell shown live."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from fabfold.lattice.rotations import parity, rotation_of_degrees
from fabfold.lattice.template import Template
from fabfold.meshes import box_triangles, mesh_volume
from fabfold.solid.closed_solid import Solid
from fabfold.solid.scan import box_counts, summed_volume

if TYPE_CHECKING:
    import viser

__all__ = ["GridPanel", "ModelView", "grid_fill"]

F64 = NDArray[np.float64]

#: Subvoxels along a cell while a grid is moved.
_FINE = 8
#: Cells that are shown at most: a grid that is much too fine is told, not drawn.
_MOST_CELLS = 1500
#: Longest side of the model in the scene.
_SPAN = 5.0


def grid_fill(
    solid: Solid, rotation: F64, origin: F64, pitch: float
) -> tuple[NDArray[np.int32], F64]:
    """Cells of a regular grid that hold material of a solid, and how full they are.

    Parameters
    ----------
    solid : Solid
        The model.
    rotation : (3, 3) float64 array
        From model axes to lattice axes.
    origin : (3,) float64 array
        The centre of a cell: lattice axes, model units.
    pitch : float
        Side of a cell, model units.

    Returns
    -------
    cells : (n, 3) int32 array
        Multiples of the pitch from the origin.
    fill : (n,) float64 array
        Share of each that is material, above 0; from 8 x 8 x 8 samples.
    """
    lattice = (np.asarray(solid.vertices) @ rotation.T - origin) / pitch
    first = np.floor(lattice.min(axis=0) + 0.5).astype(int)
    last = np.floor(lattice.max(axis=0) + 0.5).astype(int)
    nx, ny, nz = (int(n) for n in last - first + 1)
    if nx * ny * nz > 40 * _MOST_CELLS:
        return np.zeros((0, 3), dtype=np.int32), np.zeros(0)
    table = summed_volume(
        np.ascontiguousarray((lattice - first + 0.5) * _FINE),
        np.asarray(solid.faces, dtype=np.int32),
        (nx * _FINE, ny * _FINE, nz * _FINE),
    )
    x, y, z = (np.arange(n + 1, dtype=np.int64) * _FINE for n in (nx, ny, nz))
    fill = box_counts(table, (x, y, z)) / float(_FINE**3)
    cells = np.argwhere(fill > 0)
    return (cells + first).astype(np.int32), np.asarray(fill[tuple(cells.T)])


class ModelView:
    """The model in the scene, and the way between its units and those of the scene.

    Parameters
    ----------
    server : viser.ViserServer
        Whose scene it is.
    """

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._node: Any = None
        self.solid: Solid | None = None
        self._middle, self._scale = np.zeros(3), 1.0
        #: Told of the point of the model, in its units, where it is clicked.
        self.on_point: Callable[[F64], None] | None = None

    def show(self, solid: Solid, visible: bool) -> None:
        """Take up a model."""
        if self._node is not None:
            self._node.remove()
        self.solid = solid
        low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
        self._middle = (low + high) / 2
        self._scale = _SPAN / float((high - low).max())
        self._node = self._server.scene.add_mesh_simple(
            "/model",
            np.asarray(self.to_scene(solid.vertices), np.float32),
            np.asarray(solid.faces, np.uint32),
            color=(196, 202, 212),
            flat_shading=True,
            visible=visible,
        )
        self._node.on_click(self._clicked)

    def set_visible(self, visible: bool) -> None:
        """Show or hide the model."""
        if self._node is not None:
            self._node.visible = visible

    @property
    def scale(self) -> float:
        """Length in the scene of one unit of the model."""
        return self._scale

    def to_scene(self, points: F64) -> F64:
        """Points of the model, (..., 3), in the scene."""
        return np.asarray((points - self._middle) * self._scale)

    def from_scene(self, points: F64) -> F64:
        """Points of the scene, (..., 3), in the model's units."""
        return np.asarray(points / self._scale + self._middle)

    def _clicked(self, event: Any) -> None:
        start, along = np.array(event.ray_origin), np.array(event.ray_direction)
        point = self.hit(start, along)
        if point is not None and self.on_point is not None:
            self.on_point(point)

    def hit(self, start: F64, along: F64) -> F64 | None:
        """First point of the model that a ray of the scene meets, in the model's units."""
        if self.solid is None:
            return None
        here, way = self.from_scene(start), along / np.linalg.norm(along)
        a, b, c = (self.solid.vertices[self.solid.faces[:, k]] for k in range(3))
        one, other = b - a, c - a
        across = np.cross(way, other)
        size = np.einsum("ij,ij->i", one, across)
        with np.errstate(divide="ignore", invalid="ignore"):
            offset = here - a
            u = np.einsum("ij,ij->i", offset, across) / size
            turned = np.cross(offset, one)
            v = turned @ way / size
            time = np.einsum("ij,ij->i", other, turned) / size
            good = (u >= 0) & (v >= 0) & (u + v <= 1) & (time > 0)
        if not good.any():
            return None
        return np.asarray(here + float(time[good].min()) * way)


class GridPanel:
    """Rotation, origin and pitch of a grid, by numbers or by its handles in the scene.

    Parameters
    ----------
    server : viser.ViserServer
        Whose page it is; the controls come into the container that is open.
    view : ModelView
        The model.
    template : callable
        Gives the template that the voxels are for.
    use : callable
        Takes rotation (degrees), origin and pitch; all None lets the search place the grid.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        view: ModelView,
        template: Callable[[], Template],
        use: Callable[[Any, Any, Any], None],
    ) -> None:
        self._server, self._view, self._template, self._use = server, view, template, use
        self._cells: Any = None
        self._handles: Any = None
        self._visible = False
        gui: Any = server.gui
        gui.add_markdown(
            "Turn and move the grid until little is cut off and few cells are slivers."
        )
        self._rotation = gui.add_vector3("rotation °", (0.0, 0.0, 0.0), step=1.0)
        self._origin = gui.add_vector3("origin", (0.0, 0.0, 0.0), step=0.01)
        self._pitch = gui.add_number("pitch", 1.0, step=0.01, min=1e-9)
        self._told = gui.add_markdown("")
        gui.add_button("Use this grid").on_click(lambda _: self._take())
        gui.add_button("Let the search place it").on_click(lambda _: use(None, None, None))
        for control in (self._rotation, self._origin, self._pitch):
            control.on_update(self._changed)

    def begin(
        self,
        rotation: tuple[float, float, float] | None,
        origin: tuple[float, float, float] | None,
        pitch: float | None,
    ) -> None:
        """Begin with a grid; what is None is put about the model's middle."""
        solid = self._view.solid
        if solid is None:
            return
        turn = rotation or (0.0, 0.0, 0.0)
        lattice = solid.vertices @ rotation_of_degrees(turn).T
        low, high = lattice.min(axis=0), lattice.max(axis=0)
        # Voxels that would be full to two thirds.
        volume = mesh_volume(solid.vertices, solid.faces)
        usual = float(np.cbrt(volume / (0.66 * len(self._template()))))
        side = usual if pitch is None else pitch
        at = (low + high) / 2 if origin is None else np.array(origin)
        self._rotation.value, self._pitch.value = turn, side
        self._origin.value = tuple(float(x) for x in at)
        self.draw()

    def set_visible(self, visible: bool) -> None:
        """Show or hide the grid."""
        self._visible = visible
        self.draw()

    def grid(self) -> tuple[tuple[float, float, float], tuple[float, float, float], float]:
        """Rotation in degrees, origin and pitch as they stand."""
        return self._rotation.value, self._origin.value, float(self._pitch.value)

    def _take(self) -> None:
        rotation, origin, pitch = self.grid()
        self._use(rotation, origin, pitch)

    def _changed(self, event: Any) -> None:
        if event.client is not None:
            self.draw()

    def draw(self) -> None:
        """Show the cells of the grid, and say what they hold."""
        solid = self._view.solid
        if self._cells is not None:
            self._cells.remove()
            self._cells = None
        if solid is None or not self._visible:
            if self._handles is not None:
                self._handles.visible = False
            return
        degrees, origin, pitch = self.grid()
        turn = rotation_of_degrees(degrees)
        cells, fill = grid_fill(solid, turn, np.array(origin), pitch)
        self._told.content = self._words(cells, fill)
        if 0 < len(cells) <= _MOST_CELLS:
            self._draw_cells(cells, fill, turn, np.array(origin), pitch)
        self._draw_handles(turn, np.array(origin))

    def _draw_cells(
        self, cells: NDArray[np.int32], fill: F64, turn: F64, origin: F64, pitch: float
    ) -> None:
        middles = self._view.to_scene((cells * pitch + origin) @ turn)
        wxyz = Rotation.from_matrix(turn.T).as_quat()[[3, 0, 1, 2]]
        side = pitch * self._view.scale * 0.96
        box, faces = box_triangles(np.full(3, -side / 2), np.full(3, side / 2))
        # From red (a sliver) over yellow to green (full).
        share = fill[:, None]
        low, middle, high = (
            np.array(c, float) for c in ((220, 60, 50), (240, 200, 70), (70, 170, 90))
        )
        colours = np.where(
            share < 0.5,
            low + 2 * share * (middle - low),
            middle + (2 * share - 1) * (high - middle),
        )
        self._cells = self._server.scene.add_batched_meshes_simple(
            "/grid",
            np.asarray(box, np.float32),
            np.asarray(faces, np.uint32),
            np.tile(wxyz, (len(cells), 1)).astype(np.float32),
            middles.astype(np.float32),
            batched_colors=colours.astype(np.uint8),
            opacity=0.45,
            flat_shading=True,
            lod="off",
            cast_shadow=False,
        )

    def _draw_handles(self, turn: F64, origin: F64) -> None:
        wxyz = Rotation.from_matrix(turn.T).as_quat()[[3, 0, 1, 2]]
        position = self._view.to_scene(origin @ turn)
        if self._handles is None:
            self._handles = self._server.scene.add_transform_controls(
                "/grid-handles", scale=1.6, wxyz=wxyz, position=position, depth_test=False
            )
            self._handles.on_update(self._moved)
        else:
            self._handles.wxyz, self._handles.position = wxyz, position
        self._handles.visible = True

    def _moved(self, event: Any) -> None:
        if event.client is None:
            return
        w, x, y, z = self._handles.wxyz
        turn = Rotation.from_quat([x, y, z, w]).as_matrix().T
        degrees = Rotation.from_matrix(turn).as_euler("xyz", degrees=True)
        origin = turn @ self._view.from_scene(np.array(self._handles.position))
        self._rotation.value = tuple(round(float(angle), 2) for angle in degrees)
        self._origin.value = tuple(round(float(value), 6) for value in origin)
        self.draw()

    def _words(self, cells: NDArray[np.int32], fill: F64) -> str:
        """How the grid suits the model and the template."""
        if not len(cells):
            return "This grid is much too fine: give a larger pitch."
        template = self._template()
        kept = fill >= 0.04
        counts = np.bincount(parity(cells[kept]), minlength=2)
        room = np.bincount(parity(template.cells), minlength=2)
        fits = np.sort(counts)[::-1] <= np.sort(room)[::-1]
        verdict = (
            "fits the template"
            if fits.all()
            else f"**too many cells of one colour**: {counts.max()} for {room.max()} in the box"
        )
        lost = 100 * float(fill[~kept].sum() / fill.sum())
        return (
            f"{int(kept.sum())} cells for {len(template)}, {int((fill > 0.9).sum())} full, "
            f"{int((kept & (fill < 0.25)).sum())} slivers; {lost:.1f} % would be lost; {verdict}"
        )
