"""The paper's physics in the studio: A and B unfold by forces, and a person helps them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from fabfold.errors import NoFoldError
from fabfold.physics.actions import (
    Action,
    Carve,
    Match,
    PinVoxel,
    Push,
    Release,
    ShapeName,
    Unfold,
    Wait,
)
from fabfold.physics.forced_path import path_of
from fabfold.physics.unfolding import Unfolding
from fabfold.studio.kit_scene import KitScene, cube_meshes
from fabfold.studio.page_tasks import PageTasks
from fabfold.tree.fold_tree import FoldTree

if TYPE_CHECKING:
    import viser

__all__ = ["ForcePanel"]

#: Time steps between two pictures.
_STEPS = 25
#: Force of a drag over one voxel side, and the most.
_PULL, _MOST_PULL = 40.0, 250.0


class ForcePanel:
    """Controls of the forces, and the two copies in the scene.

    Parameters
    ----------
    server : viser.ViserServer
        Whose page it is; the controls come into the container that is open.
    tasks : PageTasks
        Runs the simulation.
    tree : callable
        Gives the tree that is to fold; raises where there is none.
    use : callable
        Takes the actions whose path is to be used.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        tasks: PageTasks,
        tree: Callable[[], FoldTree],
        use: Callable[[list[Action]], None],
    ) -> None:
        self._tasks, self._tree, self._use = tasks, tree, use
        self._unfolding: Unfolding | None = None
        self._chosen: tuple[ShapeName, int] | None = None
        self._drag: Push | None = None  # as the hand has it now
        self._pulled: Push | None = None  # as the simulation has it
        gui: Any = server.gui
        gui.add_markdown(
            "A (left) and B (right) unfold by repulsion; then each is drawn to the other. Where "
            "they stick, drag a voxel, or click one and push it, pin it, or carve its corners."
        )
        gui.add_button("Begin").on_click(lambda _: tasks.start("Forces", self._begin))
        row = gui.add_button_group("forces", ("unfold", "match", "hold"))
        row.on_click(lambda event: self._force(event.target.value))
        self._told = gui.add_markdown("Not begun.")
        self._force_vector = gui.add_vector3("push", (0.0, 0.0, 60.0), step=5.0)
        row = gui.add_button_group("voxel", ("push", "pin", "carve"))
        row.on_click(lambda event: self._help(event.target.value))
        gui.add_button("Release pushes and pins").on_click(
            lambda _: self._act([Release(shape="A"), Release(shape="B")])
        )
        gui.add_button("Undo").on_click(lambda _: tasks.start("Undo", self._undo))
        gui.add_button("Use this path").on_click(lambda _: tasks.start("Path", self._take))
        self._scenes: dict[ShapeName, KitScene] = {
            "A": KitScene(server, "/forces-A"),
            "B": KitScene(server, "/forces-B"),
        }
        for shape, scene in self._scenes.items():
            scene.on_body = self._clicked(shape)
            scene.on_drag = self._dragged(shape)

    @property
    def unfolding(self) -> Unfolding | None:
        """The simulation; None before it was begun."""
        return self._unfolding

    def set_visible(self, visible: bool) -> None:
        """Show or hide both copies."""
        for scene in self._scenes.values():
            scene.set_visible(visible)

    def close(self) -> None:
        """Forget the simulation, whose tree is another one now."""
        self._unfolding = None
        for scene in self._scenes.values():
            scene.clear()
        self._told.content = "Not begun."

    def _begin(self) -> None:
        tree = self._tree()
        self._unfolding = Unfolding(tree)
        span = float(np.ptp(tree.source, axis=0).max()) + 6.0
        for sign, (_, scene) in zip((-1.0, 1.0), self._scenes.items(), strict=True):
            scene.shift = np.array([sign * span / 2, 0.0, 0.0])
            scene.show(tree, cube_meshes(tree))
        self._draw()

    def _force(self, name: str) -> None:
        if name == "hold":
            self._tasks.stop()
        elif name == "unfold":
            self._tasks.start("Unfolding", lambda: self._run(Unfold(steps=_STEPS), 3000))
        else:
            self._tasks.start("Matching", lambda: self._run(Match(steps=_STEPS), 2000))

    def _pull(self) -> None:
        """Let a drag act by itself, until the hand lets go."""
        unfolding = self._required()
        for done in range(1000):
            self._take_drag(unfolding)
            if self._pulled is None:
                break
            unfolding.do(Wait(steps=_STEPS), joined=done > 0)
            self._draw()
            self._tasks.tell(None, self._words())

    def _take_drag(self, unfolding: Unfolding) -> None:
        """Push as the hand drags now; each change is an action, so that it can be replayed."""
        drag, before = self._drag, self._pulled
        if drag == before:
            return
        if before is not None and (drag is None or drag.voxel != before.voxel):
            unfolding.do(before.model_copy(update={"force": (0.0, 0.0, 0.0)}))
        if drag is not None:
            unfolding.do(drag)
        self._pulled = drag

    def _dragged(self, shape: ShapeName) -> Callable[[int, Any, Any, bool], None]:
        def dragged(body: int, start: Any, end: Any, over: bool) -> None:
            scene = self._scenes[shape]
            voxel = scene.nearest_voxel(body, start)
            if self._drag is not None:
                voxel = self._drag.voxel  # The one that was taken hold of.
            if over or voxel is None or self._unfolding is None:
                self._drag = None
                return
            force = _PULL * (end - start)
            force *= min(1.0, _MOST_PULL / max(float(np.linalg.norm(force)), 1e-9))
            x, y, z = (round(float(value), 3) for value in force)
            first = self._drag is None
            self._drag = Push(shape=shape, voxel=voxel, force=(x, y, z))
            if first and not self._tasks.busy:
                self._tasks.start("Pulling", self._pull)

        return dragged

    def _run(self, action: Unfold | Match, steps: int) -> None:
        """Let a force act, a picture every few steps, until it is held or has done its time."""
        unfolding = self._required()
        for done in range(0, steps, _STEPS):
            self._take_drag(unfolding)
            unfolding.do(action, joined=done > 0)
            self._draw()
            self._tasks.tell((done + _STEPS) / steps, self._words())
            if isinstance(action, Match) and unfolding.met:
                break

    def _help(self, what: str) -> None:
        if self._chosen is None:
            self._told.content = "Click a voxel of A or B first."
            return
        shape, voxel = self._chosen
        x, y, z = (float(value) for value in self._force_vector.value)
        actions: dict[str, Any] = {
            "push": Push(shape=shape, voxel=voxel, force=(x, y, z)),
            "pin": PinVoxel(shape=shape, voxel=voxel),
            "carve": Carve(voxel=voxel),
        }
        self._act([actions[what]])

    def _act(self, actions: list[Action]) -> None:
        def work() -> None:
            unfolding = self._required()
            for action in actions:
                unfolding.do(action)
            self._draw()

        self._tasks.start(actions[0].do.capitalize(), work)

    def _undo(self) -> None:
        if not self._required().undo():
            raise NoFoldError("there is nothing to undo")
        self._draw()

    def _take(self) -> None:
        try:
            found = path_of(self._required())
        except NoFoldError as error:
            raise NoFoldError(
                f"{error}. Unfold further, help where they stick, or begin again and carve where "
                "voxels pass each other closely; then match"
            ) from error
        self._use(list(found.actions))

    def _required(self) -> Unfolding:
        if self._unfolding is None:
            raise NoFoldError("press Begin first")
        return self._unfolding

    def _clicked(self, shape: ShapeName) -> Callable[[int, Any, Any], None]:
        def clicked(body: int, start: Any, along: Any) -> None:
            scene = self._scenes[shape]
            voxel = scene.voxel_at(body, start, along)
            if voxel is None:
                return
            self._chosen = (shape, voxel)
            scene.pick([body])
            self._told.content = f"Voxel {voxel} of {shape} chosen. {self._words()}"

        return clicked

    def choose(self, shape: ShapeName, voxel: int) -> None:
        """Choose a voxel, as a click on it does."""
        self._chosen = (shape, voxel)

    def _words(self) -> str:
        unfolding = self._unfolding
        if unfolding is None:
            return "Not begun."
        carved = f", {len(unfolding.carved)} voxels carved" if unfolding.carved else ""
        if unfolding.met:
            return f"A and B have met{carved}: use this path"
        count = len(unfolding.actions)
        return (
            f"{count} action{'' if count == 1 else 's'}{carved}; A and B are up to "
            f"{unfolding.difference_deg:.0f}° apart"
        )

    def _draw(self) -> None:
        unfolding = self._unfolding
        if unfolding is None:
            return
        for shape, scene in self._scenes.items():
            scene.pose(unfolding.angles_deg(shape))
        self._told.content = self._words()
