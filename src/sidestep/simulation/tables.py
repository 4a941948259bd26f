"""Tables in TOML files, unchecked but for the file itself; a scenario, a node and a human model are read from them."""

from __future__ import annotations

import tomllib
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, cast

from sidestep.errors import InvalidFile
from sidestep.simulation.settings import without_none

DEEPEST = 50
"""Tables and lists within each other; what checks and copies them goes one call deeper for each."""
_TOO_DEEP = f"tables or lists nested more than {DEEPEST} deep"


def tables_in(text: str) -> dict[str, Any]:
    """Return TOML text as nested tables.

    Raises:
        ValueError: it is no TOML, or tables and lists are nested deeper than `DEEPEST`.
    """
    try:
        data = tomllib.loads(text)
    except RecursionError:
        raise ValueError(_TOO_DEEP) from None
    level: list[Any] = [data]
    for _ in range(DEEPEST):
        level = [inner for value in level for inner in _within(value)]
    if level:
        raise ValueError(_TOO_DEEP)
    return data


def value_in(text: str) -> Any:
    """Return a TOML value; what is none is taken as the text that it is, so that words need no quotes."""
    try:
        return tables_in(f"value = {text}")["value"]
    except ValueError:
        return text


def _within(value: Any) -> Collection[Any]:
    if isinstance(value, Mapping):
        return cast(Mapping[str, Any], value).values()
    return cast(list[Any], value) if isinstance(value, list) else ()


def read_tables(path: str | Path, allowed: str = "a TOML file") -> dict[str, Any]:
    """Return everything in a file, with None for each "none"; `allowed` says what it should be.

    Raises:
        InvalidFile: the file is absent, or no TOML, or nested too deep.
    """
    try:
        return without_none(tables_in(Path(path).read_text(encoding="utf-8-sig")))
    except FileNotFoundError:
        raise InvalidFile(str(path), "no such file", allowed) from None
    except (OSError, ValueError) as error:
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
