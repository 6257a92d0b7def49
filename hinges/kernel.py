"""Tell a broken CAD environment apart, and say how to mend it.

build123d 0.11 and later install ``cadquery-ocp-novtk``, CadQuery installs ``cadquery-ocp``. Both
wheels write the same ``OCP`` folder, so the second one installed overwrites the first without a
word, and neither package works for sure after that.
"""

from __future__ import annotations

from importlib import metadata
from importlib.util import find_spec

from .exceptions import KernelError

__all__ = ["check_kernel"]

_MEND = (
    "make a fresh environment with the one set that goes together:\n"
    "    python -m venv hinges-env && . hinges-env/bin/activate\n"
    "    pip install 'build123d==0.10.*' 'cadquery==2.7.*' 'cadquery-ocp<7.9' 'ocp-gordon<0.2'\n"
    "or, to keep this one and do without CadQuery:\n"
    "    pip uninstall -y cadquery cadquery-ocp cadquery-ocp-novtk\n"
    "    pip install --force-reinstall cadquery-ocp-novtk build123d"
)


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def check_kernel(*, cadquery: bool = False) -> None:
    """Raise if the packages of the CAD kernel cannot work together.

    Parameters
    ----------
    cadquery : bool
        Whether CadQuery is needed too.

    Raises
    ------
    KernelError
        If both kernel wheels are installed, if the kernel does not import, or if CadQuery is
        wanted and missing; the message says how to mend it.
    """
    full, slim = _version("cadquery-ocp"), _version("cadquery-ocp-novtk")
    if full and slim:
        raise KernelError(
            f"cadquery-ocp {full} and cadquery-ocp-novtk {slim} are both installed and have "
            f"overwritten one another's OCP folder: {_MEND}"
        )
    try:
        import OCP.gp  # noqa: F401
    except ImportError as error:
        raise KernelError(f"the CAD kernel does not import ({error}): {_MEND}") from error
    if cadquery and find_spec("cadquery") is None:
        raise KernelError(
            "CadQuery is not installed: pip install 'cadquery==2.7.*' beside build123d 0.10, or "
            "use the parts of hinges with build123d alone"
        )
