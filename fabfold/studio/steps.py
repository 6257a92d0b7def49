"""What a person did in the studio, step by step, kept in the kit: undo, redo, reopen."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fabfold.errors import FabfoldError, KitError
from fabfold.files import write_json
from fabfold.kit.holding import mode_of
from fabfold.kit.kit import Kit
from fabfold.physics.actions import Action, actions_json
from fabfold.recipe.recipe import Recipe, make_recipe
from fabfold.recipe.start import ProjectSetup
from fabfold.recipe.targets import find_input, named_actions

__all__ = ["Step", "StudioSteps", "with_folder"]

_FORMAT = "fabfold-studio"
#: Steps that are kept.
_MOST = 500


@dataclass(frozen=True)
class Step:
    """A state of the recipe, and what was done to come to it.

    Attributes
    ----------
    title : str
        What was done, in a few words.
    recipe : Recipe
        The recipe after it.
    """

    title: str
    recipe: Recipe


class StudioSteps:
    """The recipe of a kit as a person changes it.

    Parameters
    ----------
    start : ProjectSetup
        Recipe and files of the kit; it must have a folder.

    Attributes
    ----------
    steps : list of Step
        All steps, the first being the recipe as it was opened.
    place : int
        Index of the step that counts now.
    """

    def __init__(self, start: ProjectSetup) -> None:
        if start.folder is None:
            raise KitError("the studio needs a folder for its kit")
        self._start = start
        self.folder: Path = start.folder
        self.steps = [Step("opened", start.recipe)]
        self.place = 0
        self._kits: dict[str, Kit] = {}
        self._read()

    @property
    def recipe(self) -> Recipe:
        """The recipe that counts now."""
        return self.steps[self.place].recipe

    @property
    def path(self) -> Path:
        """File that the steps are kept in."""
        return self.folder / "stages" / "studio.json"

    def change(self, title: str, **fields: Any) -> None:
        """Change the recipe; steps that were undone are forgotten.

        Parameters
        ----------
        title : str
            What was done, in a few words.
        **fields
            Fields of the recipe; None takes a field's default.

        Raises
        ------
        RecipeError
            If a value is wrong, or the printer cannot do what is asked; then nothing changes.
        """
        recipe = make_recipe(**{**self.recipe.model_dump(), **fields})
        if recipe == self.recipe:
            return
        mode_of(recipe)  # What the printer cannot do is no step.
        del self.steps[self.place + 1 :]
        self.steps.append(Step(title, recipe))
        del self.steps[1 : max(1, len(self.steps) - _MOST)]
        self.place = len(self.steps) - 1
        self._write()

    def fold_by_forces(self, actions: list[Action]) -> None:
        """Take a path that forces find with these actions, which are kept in the kit."""
        content = json.dumps(actions_json(actions), indent=1).encode()
        kept = self.folder / "stages" / "actions" / "session.json"
        write_json(kept, json.loads(content))
        fields, path = named_actions(str(kept))
        # One file a session: undo finds each by its digest.
        if path is not None:
            own = kept.with_name(f"session-{fields['actions_sha256'][:12]}.json")
            path.replace(own)
            fields["actions"] = own.name
        self.change(f"path by forces, {len(actions)} actions", **fields)

    def undo(self) -> bool:
        """Go back one step; False at the first."""
        return self._go(self.place - 1)

    def redo(self) -> bool:
        """Go forward one step; False at the last."""
        return self._go(self.place + 1)

    def _go(self, place: int) -> bool:
        if not 0 <= place < len(self.steps):
            return False
        self.place = place
        self._write()
        return True

    def kit(self) -> Kit:
        """The kit of the recipe that counts now; what was made of it is kept in memory.

        Raises
        ------
        FabfoldError
            If a file that the recipe names is gone.
        """
        known = self._kits.get(self.recipe.model_dump_json())
        return self.new_kit() if known is None else known

    def new_kit(self, seconds: float | None = None) -> Kit:
        """The same kit afresh, with what its folder keeps: for a search that goes on.

        Parameters
        ----------
        seconds : float or None
            As of :class:`fabfold.kit.kit.Kit`; 0 takes the best of what an ended search has left.

        Raises
        ------
        FabfoldError
            If a file that the recipe names is gone.
        """
        recipe, start = self.recipe, self._start
        actions = None
        if recipe.actions:
            actions = find_input(recipe.actions, recipe.actions_sha256, self.folder, "actions")
        template = start.template if recipe.template == start.recipe.template else None
        kit = Kit(
            recipe, model=start.model, template=template, actions=actions, folder=self.folder,
            seconds=seconds,
        )  # fmt: skip
        # Bodies of one kit fill enough memory.
        self._kits = {recipe.model_dump_json(): kit}
        return kit

    # How they are kept --------------------------------------------------------------------------

    def _write(self) -> None:
        write_json(
            self.path,
            {
                "format": _FORMAT,
                "version": 1,
                "place": self.place,
                "steps": [
                    {"title": step.title, "recipe": step.recipe.model_dump(mode="json")}
                    for step in self.steps
                ],
            },
        )

    def _read(self) -> None:
        """Take up the steps of an earlier session of this model; what cannot be read is left."""
        try:
            data = json.loads(self.path.read_text(encoding="utf-8"))
            if data["format"] != _FORMAT or data["version"] != 1:
                return
            steps = [Step(str(s["title"]), make_recipe(**s["recipe"])) for s in data["steps"]]
            place = int(data["place"])
        except (OSError, ValueError, KeyError, TypeError, RecursionError, FabfoldError):
            return
        model = (self._start.recipe.model, self._start.recipe.sha256)
        if not steps or any((s.recipe.model, s.recipe.sha256) != model for s in steps):
            return
        self.steps, self.place = steps, min(max(place, 0), len(steps) - 1)
        if all(step.recipe != self._start.recipe for step in steps):
            # kit.toml was changed elsewhere since: that is the newest step.
            self.change("changed outside the studio", **self._start.recipe.model_dump())


def with_folder(start: ProjectSetup) -> ProjectSetup:
    """The same with a folder for its kit, named after the model where it has none."""
    if start.folder is not None:
        return start
    return replace(start, folder=Path(f"{start.recipe.name}-kit"))
