"""Named arrays from an `.npz` file, whatever state it is in."""

from __future__ import annotations

import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sidestep.errors import InvalidFile

_BROKEN = (
    OSError, EOFError, ValueError, TypeError, KeyError, SyntaxError, MemoryError, zipfile.BadZipFile, zlib.error,
    RuntimeError,  # encrypted, they say, or compressed in a way that is not implemented
)  # fmt: skip
"""How NumPy ends on what was cut off or garbled."""


def read_arrays(path: Path, what: str) -> dict[str, NDArray[Any]]:
    """Return all arrays of an archive by name; nothing in it is unpickled.

    Raises:
        InvalidFile: there is no such file, or it is not a whole archive of plain arrays; `what` says what it should be.
    """
    try:
        with path.open("rb") as file:  # NumPy leaves what it opened itself open when it fails
            if not file.peek(2).startswith((b"PK", b"\x93N")):  # which NumPy would take for a pickle, and say so
                raise ValueError("a file of another kind")
            archive = np.load(file, allow_pickle=False)
            if isinstance(archive, np.lib.npyio.NpzFile):
                with archive:
                    return {name: archive[name] for name in archive.files}
    except FileNotFoundError:
        raise InvalidFile(str(path), "no such file", what) from None
    except _BROKEN as error:
        raise InvalidFile(str(path), str(error) or type(error).__name__, what) from None
    raise InvalidFile(str(path), "a single array", what)
