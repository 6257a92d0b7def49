"""The built-in samples by name, and models from a sample or a file.

A sample is a model drawn with build123d, to fold without a file at hand. Drawing takes the kernel
ten seconds, so the mesh of each comes with the package; ``python -m fabfold.samples.builtin``
draws them again.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fabfold.errors import GeometryError, ModelError
from fabfold.files import write_npz
from fabfold.solid.closed_solid import Solid

if TYPE_CHECKING:
    import build123d

__all__ = [
    "PREFIX",
    "Sample",
    "build_sample",
    "draw_meshes",
    "drawn_from",
    "load_model",
    "load_sample",
    "mesh_sample",
    "sample",
    "sample_names",
    "source_digest",
]

#: What the name of a sample begins with where a model file could stand.
PREFIX = "sample:"


@dataclass(frozen=True)
class Sample:
    """A built-in model.

    Attributes
    ----------
    name : str
        As in ``sample:NAME``.
    title : str
        What it shows, in a few words.
    template : str
        The box that it is meant for.
    version : int
        Counts changes of the shape.
    """

    name: str
    title: str
    template: str
    version: int


_SAMPLES = {
    sample.name: sample
    for sample in (
        Sample("car", "a chunky little car", "box-3x4x4", 1),
        Sample("duck", "a bath duck", "box-4x4x4", 1),
        Sample("elephant", "an elephant with trunk and tusks", "box-4x4x4", 1),
        Sample("locomotive", "a small tank locomotive", "box-4x4x4", 1),
        Sample("rabbit", "a sitting rabbit", "box-4x4x4", 1),
    )
}


def sample_names() -> list[str]:
    """Names of the samples.

    Returns
    -------
    list of str
        Sorted.
    """
    return sorted(_SAMPLES)


def sample(name: str) -> Sample:
    """What is known of a sample before it is drawn.

    Parameters
    ----------
    name : str
        One of :func:`sample_names`.

    Returns
    -------
    Sample
        Its title, template and version.

    Raises
    ------
    ModelError
        If there is no such sample.
    """
    try:
        return _SAMPLES[name]
    except KeyError:
        raise ModelError(f"no sample {name!r}: there are {', '.join(sample_names())}") from None


def build_sample(name: str) -> build123d.Part:
    """Draw a sample.

    Parameters
    ----------
    name : str
        One of :func:`sample_names`.

    Returns
    -------
    build123d.Part
        One valid solid that stands on z = 0 and looks along +x.

    Raises
    ------
    ModelError
        If there is no such sample.
    GeometryError
        If the CAD kernel does not draw it as one valid solid.
    """
    known = sample(name)
    draw: Callable[[], Any] = import_module(f"fabfold.samples.{known.name}").draw
    part = draw()
    if len(part.solids()) != 1 or not part.is_valid:
        raise GeometryError(f"sample {name!r} did not come out as one valid solid")
    part.label = known.name
    return part


def load_sample(name: str) -> Solid:
    """A sample as a closed solid, the same bytes every time.

    Parameters
    ----------
    name : str
        One of :func:`sample_names`.

    Returns
    -------
    Solid
        In mm.

    Raises
    ------
    ModelError
        If there is no such sample.
    """
    known = sample(name)
    with np.load(_mesh_file(name), allow_pickle=False) as data:
        return Solid(name, data["vertices"], data["faces"], (), _digest(known))


def _mesh_file(name: str) -> Path:
    return Path(__file__).parent / "meshes" / f"{name}.npz"


def _digest(known: Sample) -> str:
    return hashlib.sha256(f"sample:{known.name}:{known.version}".encode()).hexdigest()


def draw_meshes() -> None:
    """Draw all samples, and write the meshes that come with the package."""
    for name in sample_names():
        solid = mesh_sample(build_sample(name), sample(name))
        write_npz(
            _mesh_file(name),
            {
                "vertices": solid.vertices,
                "faces": solid.faces,
                "source": np.array(source_digest(name)),
            },
        )


def source_digest(name: str) -> str:
    """Digest of the modules that draw a sample.

    Parameters
    ----------
    name : str
        One of :func:`sample_names`.

    Returns
    -------
    str
        SHA-256, hexadecimal.
    """
    folder = Path(__file__).parent
    sources = [folder / f"{name}.py", folder / "round_shapes.py"]
    return hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()


def drawn_from(name: str) -> str:
    """Digest of the modules that drew the mesh that comes with the package.

    Parameters
    ----------
    name : str
        One of :func:`sample_names`.

    Returns
    -------
    str
        :func:`source_digest` at that time.
    """
    with np.load(_mesh_file(name), allow_pickle=False) as data:
        return str(data["source"])


def load_model(source: str | Path, wanted: str = "") -> Solid:
    """A model file or a built-in sample as a closed solid.

    Parameters
    ----------
    source : str or Path
        Path of a model file, or ``"sample:NAME"``.
    wanted : str
        Name or number of the one object of a 3MF file to take; empty takes all.

    Returns
    -------
    Solid
        In the units of the file; samples are in mm.

    Raises
    ------
    ModelError
        If there is no such file or sample, or the file is not one solid.
    """
    from fabfold.solid.load import load_solid

    text = str(source)
    if text.startswith(PREFIX):
        return load_sample(text.removeprefix(PREFIX))
    return load_solid(source, wanted)


def mesh_sample(part: build123d.Part, known: Sample) -> Solid:
    """Mesh of a drawn sample.

    Parameters
    ----------
    part : build123d.Part
        What :func:`build_sample` returns.
    known : Sample
        Gives the solid its name and its digest.

    Returns
    -------
    Solid
        In mm.
    """
    from fabfold.solid.load import solid_from_mesh
    from fabfold.solid.raw import RawMesh
    from fabfold.solid.tessellate import tessellate

    size = part.bounding_box().size
    vertices, faces = tessellate(part, max(size.X, size.Y, size.Z))
    # Rounded, since the kernel's last digits mean nothing and may differ between processors.
    return solid_from_mesh(known.name, RawMesh(np.round(vertices, 9), faces), _digest(known))


if __name__ == "__main__":
    draw_meshes()
