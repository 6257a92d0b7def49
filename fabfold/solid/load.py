"""Read a model of any supported format and make one closed solid of it.

The steps: read and check the file, scale the mesh to unit size, close its surface, unite the
shells, keep one piece, decimate a dense mesh, and go back to the model's own units.
"""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable
from pathlib import Path

import numpy as np

from fabfold.errors import ModelError
from fabfold.files import sha256_of
from fabfold.solid.closed_solid import Solid
from fabfold.solid.convert import decimated, to_mesh
from fabfold.solid.paint import painted_faces
from fabfold.solid.pieces import largest_piece
from fabfold.solid.raw import RawMesh
from fabfold.solid.read_3mf import read_3mf
from fabfold.solid.surface import OpenSurfaceError, close_surface
from fabfold.solid.topology import Points
from fabfold.solid.union import MAX_TRIANGLES, unite

__all__ = ["FORMATS", "load_solid", "read_mesh", "solid_from_mesh"]

#: Suffixes that can be read.
FORMATS = (".stl", ".obj", ".ply", ".off", ".glb", ".3mf", ".step", ".stp")
#: Smallest thickness of the whole model as a share of its longest side.
MIN_THICKNESS = 0.01
#: The largest file that is read, bytes, and the most triangles.
MAX_FILE_BYTES, MAX_TRIANGLES_READ = 2_000_000_000, 6_000_000
#: A 32-bit file must resolve the model at least this finely.
MIN_STEPS = 1_000


def load_solid(path: str | Path, wanted: str = "") -> Solid:
    """Load a model as one closed, outward-oriented manifold.

    Parameters
    ----------
    path : str or Path
        A file with one of the suffixes :data:`FORMATS`.
    wanted : str
        Name or number of the one object of a 3MF file to take; empty takes all.

    Returns
    -------
    Solid
        In the model's own units and place; `notes` says what was repaired.

    Raises
    ------
    ModelError
        If the file cannot be read or is not one solid; the message names the file, the cause and
        what to do.

    Notes
    -----
    The rules: overlapping shells are united (inside is where the winding number of the shells,
    each turned outwards, is at least 1); closed cavities are filled; loose pieces are dropped if
    together they are at most 5 % of the volume, and refused otherwise (small ones that hang free
    by a hair are moved to touch); holes are capped where the caps are small beside the surface;
    meshes above 200,000 triangles are decimated; a model thinner than 1 % of its longest side is
    refused.
    """
    path = Path(path)
    raw = read_mesh(path, wanted)
    return solid_from_mesh(path.stem, raw, sha256_of(path), label=path.name)


def read_mesh(path: Path, wanted: str = "") -> RawMesh:
    """Read the triangles of a file, nothing repaired.

    Parameters
    ----------
    path : Path
        A file with one of the suffixes :data:`FORMATS`.
    wanted : str
        Name or number of the one object of a 3MF file to take; empty takes all.

    Returns
    -------
    RawMesh
        In the file's own units.

    Raises
    ------
    ModelError
        If the file cannot be read.
    """
    read = _reader(path)
    if wanted:
        if path.suffix.lower() != ".3mf":
            raise ModelError(f"{path.name}: --object chooses in a 3MF file; leave it out")
        read = functools.partial(read_3mf, wanted=wanted)
    try:
        raw = read(path)
    except OSError as error:
        raise ModelError(f"{path.name} cannot be read: {error.strerror or error}") from error
    except MemoryError as error:
        raise ModelError(f"{path.name} is too large for this computer's memory") from error
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        # What a reader should have named; nobody who gave a damaged file is helped by a traceback.
        raise ModelError(
            f"{path.name} is damaged in a way that cannot be told ({type(error).__name__}: "
            f"{' '.join(str(error).split())[:80]}); export it again"
        ) from error
    if len(raw.faces) > MAX_TRIANGLES_READ:
        raise ModelError(
            f"{path.name} has {len(raw.faces):,} triangles, and {MAX_TRIANGLES_READ:,} are the "
            "most; export a coarser model"
        )
    _check_numbers(path.name, raw)
    return raw


def _reader(path: Path) -> Callable[[Path], RawMesh]:
    from fabfold.solid import read_binary, read_step, read_stl, read_text

    readers = {
        ".stl": read_stl.read_stl,
        ".obj": read_text.read_obj,
        ".off": read_text.read_off,
        ".ply": read_binary.read_ply,
        ".glb": read_binary.read_glb,
        ".3mf": read_3mf,
        ".step": read_step.read_step,
        ".stp": read_step.read_step,
    }
    known = ", ".join(suffix[1:].upper() for suffix in FORMATS if suffix != ".stp")
    if path.is_dir():
        raise ModelError(f"{path} is a folder: give the model file itself ({known})")
    if not path.exists():
        raise ModelError(f"{path}: there is no such file")
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise ModelError(
            f"{path.name}: files ending in {path.suffix or 'nothing'} cannot be read; "
            f"export the model as one of {known}"
        )
    size = path.stat().st_size
    if size == 0:
        raise ModelError(f"{path.name} is empty (0 bytes): export or download it again")
    if size > MAX_FILE_BYTES:
        raise ModelError(
            f"{path.name} has {size / 1e9:.1f} GB, and {MAX_FILE_BYTES / 1e9:g} GB are the most "
            "that is read; export a coarser model, or in a binary format"
        )
    return reader


def solid_from_mesh(name: str, raw: RawMesh, sha256: str = "", label: str = "") -> Solid:
    """Make a solid of triangles by the rules of :func:`load_solid`.

    Parameters
    ----------
    name : str
        Name of the solid.
    raw : RawMesh
        Triangles as a reader gives them, nothing repaired yet.
    sha256 : str, optional
        Digest of the file; that of the triangles if not given.
    label : str, optional
        What messages call the model; `name` if not given.

    Returns
    -------
    Solid
        In the units and place of the triangles; `notes` says what was repaired.

    Raises
    ------
    ModelError
        If the triangles cannot be made one solid.
    """
    label = label or name
    _check_numbers(label, raw)
    vertices, centre, scale = _normalised(label, raw)
    notes = list(raw.notes)
    try:
        shells, done = close_surface(label, vertices, raw.faces)
    except OpenSurfaceError as error:
        from fabfold.solid.wrap import wrap_surface

        shells, done = wrap_surface(label, vertices, raw.faces, str(error.args[0]))
    notes += done
    united = unite(label, shells, notes)
    if raw.negative is not None:
        holes, _ = close_surface(label, (raw.negative[0] - centre) / scale, raw.negative[1])
        united = united - unite(label, holes, [])
        notes.append("a negative part was taken away from the solid, as the slicer does")
        if united.is_empty():
            raise ModelError(f"{label} has nothing left once its negative parts are taken away")
    try:
        body = largest_piece(label, united, notes, scale)
    except ModelError as error:
        if len(raw.objects) < 2:
            raise
        listed = ", ".join(f"{n}: {name}" for n, name in enumerate(raw.objects[:12], start=1))
        raise ModelError(
            f"{label} has {len(raw.objects)} objects that are not one piece; choose one with "
            f"--object NAME or its number ({listed}{', ...' if len(raw.objects) > 12 else ''})"
        ) from error
    body = decimated(body, MAX_TRIANGLES)
    if len(raw.faces) > MAX_TRIANGLES:
        notes.append(f"{len(raw.faces):,} triangles were thinned to {body.num_tri():,}")
    points, faces = to_mesh(body)
    return Solid(
        name=name,
        vertices=np.ascontiguousarray(points * scale + centre),
        faces=np.ascontiguousarray(faces, dtype=np.int32),
        notes=tuple(notes),
        sha256=sha256 or hashlib.sha256(raw.vertices.tobytes() + raw.faces.tobytes()).hexdigest(),
        paint=painted_faces(raw.vertices, raw.faces, raw.colours),
        pieces=len(united.decompose()),
    )


def _check_numbers(label: str, raw: RawMesh) -> None:
    outside = ((raw.faces < 0) | (raw.faces >= len(raw.vertices))).any(axis=1)
    if bool(np.any(outside)):
        raise ModelError(
            f"{label}: triangle {int(np.argmax(outside))} (counted from 0) names a vertex that is "
            f"not there, the file has {len(raw.vertices)}; export the model again"
        )
    finite = np.asarray(np.isfinite(raw.vertices).all(axis=1))
    if not finite.all():
        vertex = int(np.flatnonzero(~finite)[0])
        hit = np.flatnonzero(~finite[raw.faces].all(axis=1))
        first = f"triangle {hit[0]}, " if len(hit) else ""
        raise ModelError(
            f"{label}: {len(hit)} triangles have corners that are no finite numbers (NaN or "
            f"infinite), first {first}vertex {vertex} (counted from 0); repair or export the "
            "model again"
        )


def _normalised(label: str, raw: RawMesh) -> tuple[Points, Points, float]:
    """Vertices about the origin with a longest side of 0.5 to 1, and the way back.

    Models come a nanometre or a thousand kilometres long: all tolerances hold for this frame.
    """
    in_use = np.zeros(len(raw.vertices), dtype=bool)
    in_use[raw.faces] = True
    used = raw.vertices[in_use]
    low, high = used.min(axis=0), used.max(axis=0)
    longest = float((high - low).max())
    far = float(np.abs(used).max())
    if longest == 0:
        raise ModelError(f"{label} is not a solid: all its corners are one point")
    if not np.isfinite(longest) or not 1e-100 < longest < 1e100:
        raise ModelError(f"{label}: a size of {longest:g} is beyond reckoning; scale the model")
    if raw.float32 and (step := float(np.spacing(np.float32(far)))) * MIN_STEPS > longest:
        raise ModelError(
            f"{label}: its precision is lost, since the model is {longest:.3g} long but stands "
            f"{far:.3g} from the origin, where the file can only store steps of {step:.3g}; move "
            "it to the origin and export it again"
        )
    # A power of two scales without rounding.
    scale = float(2.0 ** np.ceil(np.log2(longest)))
    centre = (low + high) / 2
    _check_thickness(label, (used - centre) / longest)
    return (raw.vertices - centre) / scale, centre, scale


def _check_thickness(label: str, points: Points) -> None:
    """Refuse what is flat or next to it, along the axes and along its own principal axes."""
    _, axes = np.linalg.eigh(np.cov(points.T))
    sides = np.r_[np.ptp(points, axis=0), np.ptp(points @ axes, axis=0)]
    if sides.min() < 1e-7:
        raise ModelError(
            f"{label} is not a solid: all its corners lie in one plane and its volume is zero; "
            "give it a thickness"
        )
    if sides.min() < MIN_THICKNESS:
        raise ModelError(
            f"{label} is too thin to fold: its thickness is {sides.min():.2g} of its length, and "
            f"at least {MIN_THICKNESS:g} is needed; make it thicker or shorter"
        )
