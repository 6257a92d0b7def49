"""What the environment that runs the tests holds by design."""

from importlib import metadata

import pytest


def _installed(name: str) -> bool:
    try:
        metadata.version(name)
    except metadata.PackageNotFoundError:
        return False
    return True


#: For tests of CadQuery. build123d 0.11 and later bring the kernel ``cadquery-ocp-novtk``, which
#: CadQuery cannot stand beside: that environment has none. Any other must have it.
needs_cadquery = pytest.mark.skipif(
    _installed("cadquery-ocp-novtk"),
    reason="this environment has the kernel of a newer build123d, and so no CadQuery",
)
