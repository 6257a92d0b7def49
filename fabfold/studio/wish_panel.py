"""Wishes in the studio: regions painted on the model, what shall be seen where, and the joints."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, cast, get_args

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import RecipeError
from fabfold.recipe.recipe import Recipe
from fabfold.solid.regions import parse_region
from fabfold.studio.grid_panel import ModelView
from fabfold.tree.catalogue import JointChoice

if TYPE_CHECKING:
    import viser

__all__ = ["WishPanel", "sphere_text"]

F64 = NDArray[np.float64]


def sphere_text(point: F64, radius: float) -> str:
    """A painted dab as a region of the recipe: ``sphere(x,y,z,r)`` in model units."""
    return f"sphere({','.join(f'{value:.6g}' for value in (*point, radius))})"


class WishPanel:
    """Regions and wishes.

    Parameters
    ----------
    server : viser.ViserServer
        Whose page it is; the controls come into the container that is open.
    view : ModelView
        The model, on which regions are painted.
    change : callable
        Takes a title and fields of the recipe.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        view: ModelView,
        change: Callable[..., None],
    ) -> None:
        self._server, self._view, self._change = server, view, change
        self._dabs: list[Any] = []
        self._protect: tuple[str, ...] = ()
        gui: Any = server.gui
        gui.add_markdown(
            "Show the model, turn the brush on, and click what no cut may cross: a face, a logo."
        )
        self._brush = gui.add_checkbox("brush", False)
        self._radius = gui.add_slider("radius, % of the model", 2, 30, 1, 10)
        self._regions = gui.add_markdown("nothing protected")
        gui.add_button("Take the last region away").on_click(lambda _: self._unpaint())
        gui.add_divider()
        self._keep = gui.add_text(
            "keep, WHAT:SIDE", "", hint="Such as front:front, or painted:top."
        )
        self._joints = gui.add_dropdown(
            "joints", tuple(get_args(JointChoice)), initial_value="auto"
        )
        self._prefer = gui.add_slider("fewest hinges … best surface", 0.0, 1.0, 0.05, 0.5)
        self._void = gui.add_slider("empty space outside … inside", -1.0, 1.0, 0.1, 0.0)
        self._share = gui.add_checkbox("two voxels may share a cell", False)
        self._inside = gui.add_checkbox("no hinge on the outside", False)
        gui.add_button("Take these wishes").on_click(lambda _: self._take())
        view.on_point = self._painted

    def begin(self, recipe: Recipe) -> None:
        """Show the wishes of a recipe."""
        self._protect = recipe.protect
        self._keep.value = " ".join(recipe.keep)
        self._joints.value = recipe.joints
        self._prefer.value, self._void.value = recipe.prefer, recipe.void
        self._share.value, self._inside.value = recipe.share, recipe.joints_inside
        self.draw()

    def _painted(self, point: F64) -> None:
        solid = self._view.solid
        if not self._brush.value or solid is None:
            return
        extent = float(np.ptp(solid.vertices, axis=0).max())
        text = sphere_text(point, float(self._radius.value) / 100 * extent)
        self._change("painted a region", protect=(*self._protect, text))

    def _unpaint(self) -> None:
        if self._protect:
            self._change("took a region away", protect=self._protect[:-1])

    def _take(self) -> None:
        self._change(
            "wishes",
            keep=tuple(self._keep.value.split()),
            joints=self._joints.value,
            prefer=float(self._prefer.value),
            void=float(self._void.value),
            share=bool(self._share.value),
            joints_inside=bool(self._inside.value),
        )

    def set_visible(self, visible: bool) -> None:
        """Show or hide the regions."""
        for dab in self._dabs:
            dab.visible = visible

    def draw(self) -> None:
        """Show the regions on the model, and list them."""
        while self._dabs:
            self._dabs.pop().remove()
        solid, scene = self._view.solid, cast("Any", self._server.scene)
        words = "; ".join(self._protect).replace("*", "\\*")
        self._regions.content = f"protected: {words}" if words else "nothing protected"
        if solid is None:
            return
        bounds = np.array([solid.vertices.min(axis=0), solid.vertices.max(axis=0)])
        for number, text in enumerate(self._protect):
            try:
                region = parse_region(text, "--protect")
            except RecipeError:
                continue
            if region.kind == "painted":
                continue
            box = region.bounding_box(bounds)
            middle = self._view.to_scene(box.mean(axis=0))
            size = (box[1] - box[0]) * self._view.scale
            if region.kind == "sphere":
                dab = scene.add_icosphere(
                    f"/regions/{number}", float(size[0] / 2), color=(60, 120, 230),
                    position=middle, opacity=0.35,
                )  # fmt: skip
            else:
                dab = scene.add_box(
                    f"/regions/{number}", color=(60, 120, 230), dimensions=tuple(size),
                    position=middle, opacity=0.35,
                )  # fmt: skip
            self._dabs.append(dab)
