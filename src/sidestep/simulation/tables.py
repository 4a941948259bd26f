"""Tables in TOML files, unchecked but for the file itself; a scenario, a node and a human model are read from them."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any, cast

from sidestep.errors import InvalidFile
from sidestep.simulation.settings import without_none


def read_tables(path: str | Path, allowed: str = "a TOML file") -> dict[str, Any]:
    """Return everything in a file, with None for each "none"; `allowed` says what it should be.

    Raises:
        InvalidFile: the file is absent, or no TOML.
    """
    try:
        return without_none(tomllib.loads(Path(path).read_text(encoding="utf-8-sig")))
    except FileNotFoundError:
        raise InvalidFile(str(path), "no such file", allowed) from None
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InvalidFile(str(path), str(error), allowed) from None


def read_human_table(path: str | Path) -> dict[str, Any]:
    """Return the table [human] of a file.

    Raises:
        InvalidFile: the file is absent, no TOML, or has no such table.
    """
    allowed = "a TOML file with a table [human], as `sidestep fit` writes it"
    table = read_tables(path, allowed).get("human")
    if not isinstance(table, dict):
        raise InvalidFile(str(path), "no table [human]", allowed)
    return cast(dict[str, Any], table)
