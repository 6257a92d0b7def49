"""The examples of hinges as modules."""

import importlib.util
from pathlib import Path

HOME = Path(__file__).parents[2] / "examples"


def load(name):
    """The module of an example, by its file's name."""
    spec = importlib.util.spec_from_file_location(f"example_{name}", HOME / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
