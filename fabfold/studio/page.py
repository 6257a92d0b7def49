"""The page of the studio: what its parts show, and what they do to the kit."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from fabfold.errors import FabfoldError, NoFoldError
from fabfold.fold.motion import motion_of
from fabfold.kit.figure_pictures import bodies_named
from fabfold.kit.kit import Kit
from fabfold.kit.stages import BuiltTree, PlannedTree
from fabfold.lattice.shipped import template_names
from fabfold.printing.checks import Check
from fabfold.studio.fold_panel import FoldPanel
from fabfold.studio.force_panel import ForcePanel
from fabfold.studio.grid_panel import GridPanel, ModelView
from fabfold.studio.kit_scene import KitScene, cube_meshes, joinery_meshes
from fabfold.studio.page_tasks import PageTasks, StoppedError, escaped, table
from fabfold.studio.print_panel import PrintPanel
from fabfold.studio.size_panel import SizePanel
from fabfold.studio.steps import StudioSteps
from fabfold.studio.wish_panel import WishPanel
from fabfold.tree.bound import closed_share

if TYPE_CHECKING:
    import viser

    from fabfold.search.rounds import Found

__all__ = ["StudioPage"]

#: Views of the scene, and what is seen in each.
_VIEWS = ("Kit", "Model", "Grid", "Forces")

#: Light from all around beside viser's lamps.
_SKY = 2.0

#: Where one looks from.
_CAMERA = (6.5, -7.5, 5.5)


class StudioPage:
    """All controls of the page.

    Parameters
    ----------
    server : viser.ViserServer
        Serves it.
    steps : StudioSteps
        The recipe as it is changed.
    """

    def __init__(self, server: viser.ViserServer, steps: StudioSteps) -> None:
        self._server, self._steps = server, steps
        self._solid_voxels = 0.0
        self._far = False
        self._checks: list[Check] = []
        gui: Any = server.gui
        gui.configure_theme(
            control_layout="fixed",
            control_width="large",
            dark_mode=False,
            show_logo=False,
            show_share_button=False,
            brand_color=(54, 116, 196),
        )
        gui.set_panel_label(f"fabfold: {steps.recipe.name}")
        server.scene.set_up_direction("+z")
        # Shadows of tens of thousands of triangles cost more than all the rest of a picture.
        server.scene.configure_default_lights(enabled=True, cast_shadow=False)
        # A map of surroundings to light bodies takes four seconds to make without a graphics card.
        server.scene.configure_environment_map(None)
        server.scene.add_light_hemisphere(
            "/sky", sky_color=(255, 255, 255), ground_color=(205, 205, 215), intensity=_SKY
        )
        server.initial_camera.position = _CAMERA
        server.initial_camera.look_at = (0.0, 0.0, 0.0)
        self.tasks = PageTasks(server)
        self._view = gui.add_button_group("view", _VIEWS)
        self._view.on_click(lambda event: self.set_view(event.target.value))
        self.scene, self.model = KitScene(server), ModelView(server)
        tabs = gui.add_tab_group()
        with tabs.add_tab("Fold"):
            self.fold = FoldPanel(server, self.scene)
        with tabs.add_tab("Search"):
            self._add_search(gui)
        with tabs.add_tab("Grid"):
            self.grid = GridPanel(server, self.model, lambda: steps.kit().template, self._use_grid)
        with tabs.add_tab("Wish"):
            self.wishes = WishPanel(server, self.model, self.change)
        with tabs.add_tab("Force"):
            self.forces = ForcePanel(
                server, self.tasks, lambda: self._planned().tree, self._use_actions
            )
        with tabs.add_tab("Size"):
            self.size = SizePanel(server, self.change, self._material)
        with tabs.add_tab("Print"):
            self.printing = PrintPanel(server, self.change)
        with tabs.add_tab("Check"):
            self._add_checks(gui)
        with gui.add_folder("Steps", expand_by_default=False):
            row = gui.add_button_group("step", ("undo", "redo"))
            row.on_click(lambda event: self._go(event.target.value))
            self._list = gui.add_markdown("")
        self.set_view("Model")

    def _add_search(self, gui: Any) -> None:
        recipe = self._steps.recipe
        known = tuple(dict.fromkeys([recipe.template, *template_names()]))
        self._template = gui.add_dropdown("box", known, initial_value=recipe.template)
        self._effort = gui.add_dropdown(
            "effort", ("quick", "normal", "thorough"), initial_value=recipe.effort
        )
        self._seed = gui.add_number("seed", recipe.seed, step=1, min=0, max=2**31 - 1)
        gui.add_button("Search").on_click(lambda _: self.tasks.start("Search", self.search))
        gui.add_button("List of solutions to choose from").on_click(
            lambda _: self.tasks.start("Solutions", self.list_solutions)
        )
        self._best = gui.add_markdown("")
        self._solutions = gui.add_folder("Solutions", expand_by_default=True, visible=False)
        self._entries: list[Any] = []

    def _add_checks(self, gui: Any) -> None:
        gui.add_button("Make the bodies").on_click(
            lambda _: self.tasks.start("Bodies", self._build_only)
        )
        gui.add_button("Check").on_click(lambda _: self.tasks.start("Check", self.check))
        gui.add_button("Export the kit").on_click(lambda _: self.tasks.start("Export", self.export))
        self._verdict = gui.add_markdown("Not checked yet.")
        self._shown_check = gui.add_dropdown("show where", ("–",), initial_value="–")
        self._shown_check.on_update(lambda _: self._show_check())
        self._table = gui.add_html("")

    # What is seen -------------------------------------------------------------------------------

    def set_view(self, name: str) -> None:
        """Show the kit, the model with its regions or its grid, or the two copies of the forces."""
        self.scene.set_visible(name == "Kit")
        self.model.set_visible(name in ("Model", "Grid"))
        self.grid.set_visible(name == "Grid")
        self.wishes.set_visible(name == "Model")
        self.forces.set_visible(name == "Forces")
        if (name == "Forces") != self._far:
            self._far = name == "Forces"
            away = 2.2 if self._far else 1.0
            for client in self._server.get_clients().values():
                client.camera.position = away * np.array(_CAMERA)
                client.camera.look_at = (0.0, 0.0, 0.0)

    def begin(self) -> None:
        """Read the model, and show what the kit has already."""
        kit = self._kit()
        self.model.show(kit.solid(), visible=True)
        recipe = self._steps.recipe
        self.grid.begin(recipe.rotation, recipe.origin, recipe.pitch)
        self._refresh()
        self._show_kit()

    def _show_kit(self) -> None:
        """Show what there is of the recipe that counts now, without making anything."""
        kit = self._kit()
        self._checks = []
        self._verdict.content = "Not checked yet."
        if kit.is_made("join"):
            self.build()
        elif kit.is_made("fold"):
            self._show_planned()
            self.set_view("Kit")
        else:
            self._solid_voxels = 0.0
            self.forces.close()
            self.fold.forget("No tree for this recipe yet: search for one.")
            self.set_view("Model")

    def change(self, title: str, **fields: Any) -> None:
        """Change the recipe, and say so where it cannot be."""
        try:
            self._steps.change(title, **fields)
        except FabfoldError as error:
            self.tasks.say(f"**{escaped(title)}:** {escaped(str(error))}")
            return
        self._refresh()
        self.tasks.start(title, self._show_kit)

    def _use_grid(self, rotation: Any, origin: Any, pitch: Any) -> None:
        title = "grid by the search" if pitch is None else "grid by hand"
        self.change(title, rotation=rotation, origin=origin, pitch=pitch)

    def _use_actions(self, actions: list[Any]) -> None:
        self._steps.fold_by_forces(actions)
        self._refresh()
        self._kit().run("fold")
        self._show_planned()
        self.set_view("Kit")

    def _go(self, way: str) -> None:
        moved = self._steps.undo() if way == "undo" else self._steps.redo()
        if not moved:
            self.tasks.say(f"There is nothing to {way}.")
            return
        self._refresh()
        self.tasks.start(way.capitalize(), self._show_kit)

    def _refresh(self) -> None:
        """Show the recipe in all controls."""
        recipe = self._steps.recipe
        self.wishes.begin(recipe)
        self.size.begin(recipe)
        self.printing.begin(recipe)
        self._seed.value = recipe.seed
        self._effort.value = recipe.effort
        if recipe.template in self._template.options:
            self._template.value = recipe.template
        lines = [
            f"{'**' if number == self._steps.place else ''}{number}. {escaped(step.title)}"
            f"{'**' if number == self._steps.place else ''}"
            for number, step in enumerate(self._steps.steps)
        ]
        self._list.content = "\n\n".join(lines[-30:])

    # What is done, in the first thread ----------------------------------------------------------

    def _kit(self) -> Kit:
        return self._heard(self._steps.kit())

    def _heard(self, kit: Kit) -> Kit:
        kit.listener = self.tasks
        return kit

    def _planned(self) -> PlannedTree:
        kit = self._kit()
        if not kit.is_made("fold"):
            raise NoFoldError("there is no tree yet: search for one first")
        return kit.fold()

    def search(self) -> None:
        """Search with what the controls say, the best so far folding before one's eyes."""
        fields = {
            "template": self._template.value,
            "effort": self._effort.value,
            "seed": int(self._seed.value),
            "pick": 0,
        }
        if fields["template"] != self._steps.recipe.template:
            fields["template_sha256"] = ""
        self._steps.change(f"search {fields['template']}, {fields['effort']}", **fields)
        self._refresh()
        kit = self._heard(self._steps.new_kit())
        kit.on_better = self._show_better
        self.set_view("Kit")
        try:
            kit.run("fold")
        except StoppedError:
            # The best so far counts, where there is any.
            self.tasks.go_on()
            self._heard(self._steps.new_kit(seconds=0.0)).run("fold")
        self.forces.close()
        self._show_planned()

    def _show_better(self, found: Found) -> None:
        _, candidate = found
        tree = candidate.tree
        motion = motion_of(tree, candidate.path)
        words = self._words(PlannedTree(found[0], tree, motion))
        self._best.content = f"Best so far: {words}"
        self.fold.show(tree, motion, cube_meshes(tree), f"Best so far: {words}", play=True)

    @staticmethod
    def _words(planned: PlannedTree) -> str:
        tree = planned.tree
        return (
            f"{len(tree.hinges)} hinges, {len(planned.motion.moves) - 1} moves, box closed to "
            f"{100 * closed_share(tree):.0f} %"
        )

    def _show_planned(self) -> None:
        planned = self._planned()
        self._solid_voxels = float(np.sum(planned.tree.fill))
        words = self._words(planned)
        self._best.content = words
        title = f"{words}. Cubes; make the bodies to see what is printed."
        self.fold.show(planned.tree, planned.motion, cube_meshes(planned.tree), title)
        self.size.tell()

    def list_solutions(self) -> None:
        """Search the Pareto list, and show it with pictures."""
        kit = self._kit()
        kit.run("pareto")
        while self._entries:
            self._entries.pop().remove()
        from PIL import Image

        with self._solutions:
            for number, solution in enumerate(kit.pareto(), start=1):
                gui: Any = self._server.gui
                tree = solution.candidate.tree
                words = f"{solution.joints} joints, closed to {100 * closed_share(tree):.0f} %"
                with Image.open(self._steps.folder / f"pareto-{number}.png") as picture:
                    pixels = np.asarray(picture.convert("RGB").resize((480, 180)))
                self._entries.append(gui.add_image(pixels, label=f"{number}: {words}"))
                button = gui.add_button(f"Take {number}")
                button.on_click(self._taker(number))
                self._entries.append(button)
        self._solutions.visible = True

    def _taker(self, number: int) -> Callable[[Any], None]:
        def take(_: Any) -> None:
            def work() -> None:
                self._steps.change(f"solution {number}", pick=number)
                self._refresh()
                self._kit().run("fold")
                self._show_planned()
                self.set_view("Kit")

            self.tasks.start(f"Solution {number}", work)

        return take

    def build(self) -> BuiltTree:
        """Make the bodies, and show them."""
        kit = self._kit()
        built = kit.join()
        gap = built.planned.motion.certificate["min_gap_mm"]
        words = self._words(built.planned)
        title = f"{words}. Proven gap on the whole path: {gap:g} mm."
        meshes = joinery_meshes(built.joinery)
        self.fold.show(built.planned.tree, built.planned.motion, meshes, title)
        self.set_view("Kit")
        return built

    def _build_only(self) -> None:
        self.build()

    def check(self) -> None:
        """Check the bodies; what fails comes first."""
        self.build()
        kit = self._kit()
        checks = kit.check()
        self._checks = sorted(checks, key=lambda check: check.ok)
        bad = sum(not check.ok for check in checks)
        self._verdict.content = (
            f"**{bad} of {len(checks)} checks failed.**" if bad else f"All {len(checks)} passed."
        )
        self._shown_check.options = ("–", *(check.name for check in self._checks))
        rows = [
            [
                "ok" if check.ok else "FAILED",
                check.name,
                f"{check.figure:.4g} {check.unit}",
                "–" if check.limit is None else f"{check.limit:.4g}",
                check.note[:160],
            ]
            for check in self._checks
        ]
        self._table.content = table(["", "check", "found", "limit", "what it means"], rows)

    def _show_check(self) -> None:
        """Pick out the bodies that a check is about."""
        name = self._shown_check.value
        check = next((check for check in self._checks if check.name == name), None)
        tree = self.scene.tree
        if check is None or tree is None:
            self.scene.pick([])
            return
        about = bodies_named(check.note, [body.name for body in tree.bodies])
        self.scene.pick(about)
        self.tasks.say(escaped(f"{check.name}: {check.note}"))

    def export(self) -> None:
        """Write the kit."""
        self.build()
        folder = self._kit().export()
        self.check()
        self.tasks.say(f"Kit written to {escaped(str(folder.resolve()))}")

    def _material(self) -> tuple[float, tuple[int, ...]]:
        template = self._steps.kit().template
        return self._solid_voxels or float(len(template)), tuple(template.shape)
