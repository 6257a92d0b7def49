"""STEP, read by the CAD kernel in a process of its own.

The kernel prints what it thinks to the terminal, and on some damaged files it dies. Neither may
happen to the program that asks.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fabfold.child_process import end_with_parent, module_call
from fabfold.errors import ModelError
from fabfold.solid.raw import RawMesh, head_of, what_is_it
from fabfold.solid.tessellate import tessellate

__all__ = ["check_step", "read_step"]

#: Seconds that the kernel has to read a file and cut it into triangles.
_PATIENCE = 600.0


def read_step(path: Path) -> RawMesh:
    """Read all solids of a STEP file and cut their surfaces into triangles.

    Parameters
    ----------
    path : Path
        A file that is not empty.

    Returns
    -------
    RawMesh
        The triangles of all solids; those of all faces if there is no solid.

    Raises
    ------
    ModelError
        If the file is cut off, cannot be read, or has no solid.
    """
    check_step(path)
    with tempfile.TemporaryDirectory(prefix="fabfold-") as folder:
        result = Path(folder) / "mesh.npz"
        plain = path.resolve()
        if head_of(path, 3) == b"\xef\xbb\xbf":  # The kernel stumbles over a byte-order mark.
            plain = Path(folder) / "model.step"
            plain.write_bytes(path.read_bytes()[3:])
        command, environment = module_call("fabfold.solid.read_step", str(plain), str(result))
        try:
            done = subprocess.run(
                command,
                env=environment,
                capture_output=True,
                encoding="utf-8",
                errors="replace",
                check=False,
                timeout=_PATIENCE,
            )
        except subprocess.TimeoutExpired:
            raise ModelError(
                f"{path.name} takes the CAD kernel more than {_PATIENCE / 60:g} minutes: export a "
                "simpler solid, or a mesh"
            ) from None
        if done.returncode < 0 or not result.is_file():
            lines = [line.strip() for line in done.stderr.splitlines() if line.strip()]
            why = "the CAD kernel breaks down on it" if done.returncode < 0 else lines[-1:]
            why = why if isinstance(why, str) else (why[0][:160] if why else "no reason given")
            raise ModelError(
                f"{path.name} cannot be read as STEP ({why}): the file is damaged; export it again"
            )
        with np.load(result) as data:
            vertices, faces, solids = data["vertices"], data["faces"], int(data["solids"])
    if len(faces) == 0:
        raise _no_solid(path)
    notes = [f"the file has {solids} separate solids"] if solids > 1 else []
    if solids == 0:
        notes.append("the file has surfaces only, no solid; they were taken for its skin")
    return RawMesh(vertices, faces, tuple(notes), unit="mm")


def check_step(path: Path) -> None:
    """Refuse what can be told without the CAD kernel.

    Parameters
    ----------
    path : Path
        A file called ``.step`` or ``.stp``.

    Raises
    ------
    ModelError
        If it does not begin or end like one, or has no face in it.
    """
    head = head_of(path, 1 << 16)
    # Comments may stand anywhere between words, before the first too.
    if not re.match(rb"(?:\xef\xbb\xbf)?(?:\s|/\*.*?\*/)*ISO-10303-21", head, re.DOTALL):
        raise ModelError(
            f"{path.name} is not a STEP file but {what_is_it(head)}; export the model as STEP"
        )
    with path.open("rb") as stream:
        # Blank lines, comments and signatures may follow the end.
        stream.seek(max(0, path.stat().st_size - (1 << 16)))
        tail = stream.read()
        if b"END-ISO-10303-21" not in tail:
            raise ModelError(
                f"{path.name} is incomplete: a STEP file ends with END-ISO-10303-21, this one was "
                "cut off; export or download it again"
            )
        stream.seek(0)
        if not any(b"FACE" in line.upper() for line in stream):
            raise _no_solid(path)


def _no_solid(path: Path) -> ModelError:
    return ModelError(
        f"{path.name} has no solid in it: only a solid body can be folded; export the part "
        "itself, not an empty assembly or a sketch"
    )


def _mesh(path: Path) -> tuple[NDArray[np.float64], NDArray[np.int64], int]:
    """Triangles of all solids of a file (of all faces if it has no solid), number of solids."""
    import build123d

    shape = build123d.import_step(path)
    solids = list(shape.solids())
    bodies = solids or list(shape.faces())
    if not bodies:
        return np.empty((0, 3)), np.empty((0, 3), dtype=np.int64), 0
    size = build123d.Compound(bodies).bounding_box().size
    parts = [tessellate(body, max(size.X, size.Y, size.Z)) for body in bodies]
    offsets = np.cumsum([0] + [len(vertices) for vertices, _ in parts])
    return (
        np.concatenate([vertices for vertices, _ in parts]),
        np.concatenate([part[1] + offset for part, offset in zip(parts, offsets, strict=False)]),
        len(solids),
    )


def _main(source: str, target: str) -> int:
    """What the child process does: read `source`, write the arrays to `target`."""
    try:
        vertices, faces, solids = _mesh(Path(source))
    except Exception as error:  # the kernel reports bad files by exceptions of many types
        reason = str(error).splitlines()[0] if str(error) else ""
        print(f"{type(error).__name__}: {reason}".rstrip(": "), file=sys.stderr)
        return 1
    np.savez(target, vertices=vertices, faces=faces, solids=np.int64(solids))
    return 0


if __name__ == "__main__":
    end_with_parent()
    sys.exit(_main(sys.argv[1], sys.argv[2]))
