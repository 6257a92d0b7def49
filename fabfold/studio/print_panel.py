"""How a kit is printed and held shut, in the studio: the recipe's choices as controls."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, get_args

from fabfold.recipe.recipe import Recipe

if TYPE_CHECKING:
    import viser

__all__ = ["PrintPanel"]

#: Fields of the recipe that a person chooses from a list, with what they are called on the page.
_CHOICES = {
    "print": "printed",
    "skin": "surface",
    "retention": "held shut by",
    "magnet": "magnets, mm",
    "magnet_fit": "magnets are",
    "slicer": "3MF also for",
}
#: Fields that are on or off.
_SWITCHES = {
    "fill": "close open faces from inside",
    "retention_in_a": "magnets hold the model too",
}
#: Poses to print in by name, as the recipe calls them.
_POSES = {"the model": "a", "the box": "b", "what prints best": "auto", "after a move": ""}


def _choices(field: str) -> tuple[str, ...]:
    """Values that a field of the recipe can have."""
    return tuple(get_args(Recipe.model_fields[field].annotation))


class PrintPanel:
    """Controls of how a kit is printed, and of what holds it shut.

    Parameters
    ----------
    server : viser.ViserServer
        Whose page it is; the controls come into the container that is open.
    change : callable
        Takes a title and fields of the recipe.
    """

    def __init__(self, server: viser.ViserServer, change: Callable[..., None]) -> None:
        self._change = change
        gui: Any = server.gui
        self._controls: dict[str, Any] = {}
        for field, label in _CHOICES.items():
            self._controls[field] = gui.add_dropdown(
                label,
                _choices(field),
                initial_value=Recipe.model_fields[field].default,
                hint=Recipe.model_fields[field].description,
            )
        for field, label in _SWITCHES.items():
            self._controls[field] = gui.add_checkbox(
                label, False, hint=Recipe.model_fields[field].description
            )
        self._pose = gui.add_dropdown(
            "in place, as",
            tuple(_POSES),
            initial_value=next(iter(_POSES)),
            hint=Recipe.model_fields["pose"].description,
        )
        self._move = gui.add_number("move", 1, min=1, max=9999, step=1, visible=False)
        self._pose.on_update(lambda _: self._show_move())
        gui.add_button("Print it like this").on_click(lambda _: self._take())

    def begin(self, recipe: Recipe) -> None:
        """Show the choices of a recipe."""
        for field, control in self._controls.items():
            control.value = getattr(recipe, field)
        number = re.fullmatch("[0-9]+", recipe.pose)
        names = {pose: name for name, pose in _POSES.items()}
        self._pose.value = names["" if number else recipe.pose]
        if number:
            self._move.value = max(1, int(recipe.pose))
        self._show_move()

    def _show_move(self) -> None:
        self._move.visible = not _POSES[self._pose.value]

    def _take(self) -> None:
        fields = {field: control.value for field, control in self._controls.items()}
        fields["pose"] = _POSES[self._pose.value] or str(int(self._move.value))
        held = "" if fields["retention"] == "none" else f", held by {fields['retention']}"
        self._change(f"printed {fields['print']}{held}", **fields)
