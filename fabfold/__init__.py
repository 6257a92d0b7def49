"""fabfold: turn a 3D model into one printed object that folds into a box.

The names below are what a script needs. Each is loaded when it is first used, so that
``import fabfold`` costs nothing.

Examples
--------
>>> import fabfold
>>> fabfold.load_template("box-3x4x4").shape
(3, 4, 4)
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from fabfold.version import __version__

if TYPE_CHECKING:
    from fabfold.errors import FabfoldError
    from fabfold.fold.motion import Motion
    from fabfold.kit.kit import Kit, open_kit
    from fabfold.lattice.shipped import load_template, template_names
    from fabfold.printing.profiles import load_profile, profile_names
    from fabfold.recipe.recipe import Recipe, read_recipe
    from fabfold.samples.builtin import load_model, sample_names
    from fabfold.tree.fold_tree import FoldTree

__all__ = [
    "FabfoldError",
    "FoldTree",
    "Kit",
    "Motion",
    "Recipe",
    "__version__",
    "load_model",
    "load_profile",
    "load_template",
    "open_kit",
    "profile_names",
    "read_recipe",
    "sample_names",
    "template_names",
]

#: Where each name is defined.
_HOME = {
    "FabfoldError": "fabfold.errors",
    "FoldTree": "fabfold.tree.fold_tree",
    "Kit": "fabfold.kit.kit",
    "Motion": "fabfold.fold.motion",
    "Recipe": "fabfold.recipe.recipe",
    "load_model": "fabfold.samples.builtin",
    "load_profile": "fabfold.printing.profiles",
    "load_template": "fabfold.lattice.shipped",
    "open_kit": "fabfold.kit.kit",
    "profile_names": "fabfold.printing.profiles",
    "read_recipe": "fabfold.recipe.recipe",
    "sample_names": "fabfold.samples.builtin",
    "template_names": "fabfold.lattice.shipped",
}


def __getattr__(name: str) -> Any:
    """Load a public name when it is first asked for (PEP 562)."""
    if name not in _HOME:
        raise AttributeError(f"module 'fabfold' has no attribute {name!r}")
    value = getattr(import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
