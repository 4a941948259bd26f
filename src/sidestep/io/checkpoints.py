"""Finished pieces of a long study, one file each, so that a study that was stopped goes on where it was."""

from __future__ import annotations

import hashlib
import json
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import sidestep
from sidestep.io.files import ready_folder, written


class Checkpoints:
    """A folder of finished pieces.

    A piece counts only while the program that made it is the present one: results of two versions never mix.
    """

    def __init__(self, folder: str | Path) -> None:
        """Make the folder.

        Raises:
            OutputError: files cannot be written there.
        """
        self.folder = ready_folder(folder)

    def load(self, name: str) -> Any | None:
        """Return what was kept under `name`, or None where there is nothing that counts."""
        try:
            kept = json.loads(self._path(name).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        if not isinstance(kept, dict) or kept.get("program") != program():
            return None
        return kept.get("content")

    def keep(self, name: str, content: Any) -> None:
        """Write `content` (anything JSON can hold) under `name`, whole or not at all.

        Raises:
            OutputError: it cannot be written.
        """
        with written(self._path(name)) as file:
            file.write(json.dumps({"program": program(), "content": content}).encode())

    def _path(self, name: str) -> Path:
        safe = "".join(c if c.isalnum() or c in "-_." else "_" for c in name)
        return self.folder / f"{safe}.json"


@cache
def program() -> str:
    """Return a digest of what decides over results: this program's source and scenarios, and what it counts with."""
    digest = hashlib.sha256(sidestep.__version__.encode())
    for library in ("numpy", "numba", "scipy", "piqp"):
        digest.update(f"{library} {version(library)}".encode())
    root = Path(sidestep.__file__).parent
    for file in sorted(root.rglob("*")):
        mine = file.suffix in (".py", ".toml", ".npz")
        if mine and file.relative_to(root).parts[0] not in ("viewer", "ros", "commands"):  # they change no result
            digest.update(file.read_bytes())
    return digest.hexdigest()[:20]
