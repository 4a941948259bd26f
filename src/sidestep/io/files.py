"""Files appear whole or not at all: written under another name in the same folder, then moved."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from sidestep.errors import OutputError


@contextmanager
def written(path: Path) -> Generator[IO[bytes]]:
    """Yield a binary file that takes the place of `path` when the block ends without an exception.

    Raises:
        OutputError: the folder does not exist or cannot be written to, or something else than a file has that name.
    """
    _replaceable(path)
    try:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=".part")
    except OSError as error:
        raise OutputError(path, error.strerror or str(error)) from None
    temporary = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
        temporary.chmod(0o644)
        temporary.replace(path)
    except OSError as error:
        raise OutputError(path, error.strerror or str(error)) from None
    finally:
        temporary.unlink(missing_ok=True)


def ready_for(page: Path | None) -> None:
    """Make the folder of a file that is written last (None: none is), before time is spent on what goes into it.

    Raises:
        OutputError: it cannot be made, or files cannot be written there, or something else than a file has that name.
    """
    if page is not None:
        ready_folder(page.parent)
        _replaceable(page)


def ready_folder(path: str | Path) -> Path:
    """Make a folder (and its parents) and check that files can be written there, before time is spent on them.

    Raises:
        OutputError: they cannot.
    """
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise OutputError(folder, error.strerror or str(error)) from None
    return folder


def _replaceable(path: Path) -> None:
    """Check that nothing is lost where a file takes the place of `path`: a folder, a device, a pipe."""
    if path.exists() and not path.is_file():
        raise OutputError(path, "it is there, and no file")
