"""The fold in the studio: a timeline to scrub, step and play, and the hinges with their angles."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fabfold.fold.motion import Motion
from fabfold.studio.kit_scene import KitScene, Mesh
from fabfold.studio.page_tasks import table
from fabfold.tree.fold_tree import FoldTree

if TYPE_CHECKING:
    import viser

__all__ = ["FoldPanel", "angles_at"]

#: Pictures a second, and moves a second at the usual pace.
_RATE, _PACE = 30.0, 1.0


def angles_at(motion: Motion, moment: float) -> NDArray[np.float64]:
    """Angles of all hinges after a number of moves, which may end within one.

    Parameters
    ----------
    motion : Motion
        The path.
    moment : float
        From 0 (A) to the number of moves (B).

    Returns
    -------
    (h,) float64 array
        Degrees.
    """
    last = len(motion.moves) - 1
    moment = min(max(moment, 0.0), float(last))
    row = min(int(moment), max(last - 1, 0))
    share = moment - row
    start, end = motion.angles_deg[row], motion.angles_deg[min(row + 1, last)]
    return np.asarray(start + share * (end - start))


class FoldPanel:
    """Controls of the fold; a thread of its own plays it.

    Parameters
    ----------
    server : viser.ViserServer
        Whose page it is; the controls come into the container that is open.
    scene : KitScene
        Shows the bodies.
    """

    def __init__(self, server: viser.ViserServer, scene: KitScene) -> None:
        self._server, self._scene = server, scene
        self._motion: Motion | None = None
        self._playing = False
        self._loop = False
        self._told = 0.0
        self._lock = threading.RLock()
        gui: Any = server.gui
        self._title = gui.add_markdown("No path yet: search for one.")
        self._slider = gui.add_slider("moves", 0.0, 1.0, 0.01, 0.0)
        self._slider.on_update(self._scrubbed)
        row = gui.add_button_group("go", ("A", "◀", "play", "▶", "B"))
        row.on_click(lambda event: self._go(event.target.value))
        self._pace = gui.add_slider("pace", 0.25, 4.0, 0.25, _PACE)
        self._about = gui.add_markdown("Click a body or a hinge.")
        with gui.add_folder("Hinges", expand_by_default=False):
            self._hinges = gui.add_html("")
        scene.on_body = self._body_clicked
        scene.on_hinge = self._hinge_clicked
        self._alive = True
        self._thread = threading.Thread(target=self._play, daemon=True)
        self._thread.start()
        #: Voxel that was clicked last, for the forces.
        self.voxel: int | None = None

    def close(self) -> None:
        """End the thread."""
        self._alive = False

    @property
    def motion(self) -> Motion | None:
        """The path that is shown."""
        return self._motion

    @property
    def moment(self) -> float:
        """How many moves are made in the picture."""
        return float(self._slider.value)

    def show(
        self,
        tree: FoldTree,
        motion: Motion,
        meshes: Sequence[Mesh],
        title: str,
        *,
        play: bool = False,
    ) -> None:
        """Show a tree with its path.

        Parameters
        ----------
        tree, motion
            What folds, and how.
        meshes : sequence of (vertices, faces)
            One a body, lattice units of shape A.
        title : str
            Markdown above the timeline.
        play : bool
            Begin to play, over and over.
        """
        with self._lock:
            self._playing = False
            self._scene.show(tree, meshes)
            self._motion = motion
            self._slider.max = float(max(len(motion.moves) - 1, 1))
            self._title.content = title
            self.set_moment(0.0)
            self._playing = self._loop = play

    def set_moment(self, moment: float) -> None:
        """Show the kit after a number of moves."""
        with self._lock:
            if self._motion is None:
                return
            moment = min(max(moment, 0.0), float(len(self._motion.moves) - 1))
            self._slider.value = round(moment, 2)
            self._scene.pose(angles_at(self._motion, moment))
            self._tell(moment)

    def _scrubbed(self, event: Any) -> None:
        if event.client is not None:  # else it was moved from here
            self._playing = False
            self.set_moment(float(self._slider.value))

    def _go(self, where: str) -> None:
        if self._motion is None:
            return
        last, moment = len(self._motion.moves) - 1, self.moment
        if where == "play":
            if not self._playing and moment >= last - 1e-6:
                self.set_moment(0.0)
            self._playing, self._loop = not self._playing, False
            return
        self._playing = False
        at = {
            "A": 0.0,
            "B": float(last),
            "◀": float(np.ceil(moment - 1e-6) - 1),
            "▶": float(np.floor(moment + 1e-6) + 1),
        }
        self.set_moment(at[where])

    def _play(self) -> None:
        then = time.monotonic()
        while self._alive:
            time.sleep(1.0 / _RATE)
            now = time.monotonic()
            passed, then = now - then, now
            with self._lock:
                self._advance(passed)

    def _advance(self, seconds: float) -> None:
        motion = self._motion
        if not self._playing or motion is None:
            return
        last = len(motion.moves) - 1
        moment = self.moment + seconds * float(self._pace.value)
        if moment >= last:
            self._playing = self._loop
            moment = float(last) if not self._loop or self.moment < last else 0.0
        self.set_moment(moment)

    def forget(self, title: str) -> None:
        """Show no kit, and say why."""
        with self._lock:
            self._playing, self._motion = False, None
            self._scene.clear()
            self._title.content = title
            self._hinges.content = ""
            self._about.content = ""

    def _tell(self, moment: float) -> None:
        """Table of hinges and name of the move, not at every picture."""
        motion, tree = self._motion, self._scene.tree
        now = time.monotonic()
        if motion is None or tree is None or (self._playing and now - self._told < 0.3):
            return
        self._told = now
        angles = angles_at(motion, moment)
        gaps: dict[str, float] = {}
        for move in motion.certificate.get("moves", []):
            name = move["hinge"]
            gaps[name] = min(gaps.get(name, np.inf), move["min_gap_mm"])
        turning = self._turning(moment)
        rows = [
            [
                ("→ " if index in turning else "") + hinge.name,
                f"{angles[index]:.0f}°",
                f"{hinge.angle_deg:.0f}°",
                f"{gaps[hinge.name]:.3f} mm" if hinge.name in gaps else "–",
            ]
            for index, hinge in enumerate(tree.hinges)
        ]
        self._hinges.content = table(["hinge", "now", "in B", "gap"], rows)
        if turning:
            names = ", ".join(tree.hinges[index].name for index in turning)
            number = min(int(moment) + 1, len(motion.moves) - 1)
            self._about.content = f"Move {number} of {len(motion.moves) - 1}: {names}"

    def _turning(self, moment: float) -> tuple[int, ...]:
        motion = self._motion
        if motion is None or len(motion.moves) < 2:
            return ()
        return motion.moves[min(int(moment) + 1, len(motion.moves) - 1)]

    def _body_clicked(
        self, body: int, start: NDArray[np.float64], along: NDArray[np.float64]
    ) -> None:
        tree = self._scene.tree
        if tree is None:
            return
        self._scene.pick([body])
        self.voxel = self._scene.voxel_at(body, start, along)
        hinges = [h.name for h in tree.hinges if body in (h.parent, h.child)]
        told = "" if self.voxel is None else f", voxel {self.voxel} clicked"
        self._about.content = (
            f"**{tree.bodies[body].name}**: {len(tree.bodies[body].voxels)} voxels{told}; "
            f"hinges {', '.join(hinges) or 'none'}"
        )

    def _hinge_clicked(self, hinge: int) -> None:
        tree = self._scene.tree
        if tree is None:
            return
        one = tree.hinges[hinge]
        self._scene.pick([one.parent, one.child], [hinge])
        self._about.content = (
            f"**{one.name}** joins {tree.bodies[one.parent].name} and "
            f"{tree.bodies[one.child].name}; it turns by {one.angle_deg:g}° and stands at "
            f"{self._scene.angles_deg[hinge]:.0f}° now"
        )
