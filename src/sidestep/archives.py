"""Named arrays from an `.npz` file, whatever state it is in."""

from __future__ import annotations

import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sidestep.errors import InvalidFile


def read_arrays(path: Path, what: str) -> dict[str, NDArray[Any]]:
    """Return all arrays of an archive by name; nothing in it is unpickled.

    Raises:
        InvalidFile: there is no such file, or it is not a whole archive of plain arrays; `what` says what it should be.
    """
    try:
        with path.open("rb") as file:
            archive = np.load(file, allow_pickle=False)
            if not isinstance(archive, np.lib.npyio.NpzFile):
                raise InvalidFile(str(path), "a single array", what)
            with archive:
                return {name: archive[name] for name in archive.files}
    except InvalidFile:
        raise
    except FileNotFoundError:
        raise InvalidFile(str(path), "no such file", what) from None
    except (OSError, EOFError, ValueError, TypeError, KeyError, SyntaxError, NotImplementedError, MemoryError) as error:
        raise InvalidFile(str(path), str(error) or type(error).__name__, what) from None
    except (RuntimeError, zipfile.BadZipFile, zlib.error) as error:  # encrypted, they say; cut off; garbled
        raise InvalidFile(str(path), str(error), what) from None
