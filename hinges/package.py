"""3MF packages in memory."""

from __future__ import annotations

import ctypes
import io
from typing import Any

__all__ = ["package_bytes"]


def package_bytes(writer: Any) -> bytes:
    """What a writer of lib3mf writes.

    lib3mf ends the whole program where it cannot write to a file, on a full disk for one; so it
    writes to memory, and Python to the disk.

    Parameters
    ----------
    writer : lib3mf.Writer
        As ``model.QueryWriter("3mf")`` gives it.

    Returns
    -------
    bytes
        The package.
    """
    import lib3mf

    package = io.BytesIO()

    def write(address: int, count: int, _: int | None) -> None:
        package.write(ctypes.string_at(address, count))

    def seek(position: int, _: int | None) -> None:
        package.seek(position)

    writer.WriteToCallback(lib3mf.WriteCallback(write), lib3mf.SeekCallback(seek), 0)
    return package.getvalue()
