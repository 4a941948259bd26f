"""TOML ↔ Scenario, and the scenarios that come with the package."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from sidestep.checks import one_of
from sidestep.errors import InvalidFile, InvalidInput
from sidestep.io.files import written
from sidestep.io.toml import to_toml
from sidestep.simulation.scenario import Scenario
from sidestep.simulation.settings import without_none
from sidestep.simulation.tables import DEEPEST, read_human_table, tables_in, value_in

if TYPE_CHECKING:
    from sidestep.obstacles import Obstacles

_FOLDER = "scenarios"


def shipped_names() -> list[str]:
    """Names of the scenarios that come with the package, sorted."""
    folder = resources.files("sidestep") / _FOLDER
    return sorted(entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml"))


def shipped_text(name: str) -> str:
    """TOML text of a scenario that comes with the package.

    Raises:
        UnknownName: there is none of that name.
    """
    one_of("scenario", [name], shipped_names())
    return (resources.files("sidestep") / _FOLDER / f"{name}.toml").read_text(encoding="utf-8")


def load_scenario(name: str | Path, changes: Iterable[str] = (), **values: Any) -> Scenario:
    """Read a scenario by the name of a shipped one, or by the path of a TOML file.

    `human = "FILE"` instead of a table [human] takes it from a file that `sidestep fit` wrote.

    Args:
        name: of a shipped scenario, or a path (with a `/` or ending in `.toml`).
        changes: "table.field=value" each, value in TOML; applied in order, before anything is checked.
        values: top-level fields instead of the file's, after `changes`.

    Raises:
        InvalidInput: a name or value is not allowed; one line per mistake.
    """
    text, source, stem = _text_of(name)
    try:
        data: dict[str, Any] = without_none(tables_in(text))
    except ValueError as error:
        raise InvalidFile(source, str(error), "a TOML file") from None
    data.setdefault("name", stem)
    _absolute_files(data, Path(source).parent if source != stem else None)
    for change in changes:
        _apply(data, change)
    if isinstance(data.get("human"), str):
        data["human"] = read_human_table(data["human"])
    return Scenario.parse(without_none(data) | values, source="" if source == stem else source)


def load_obstacles(scenario: Scenario) -> Obstacles | None:
    """Return all walls of a scenario, its polygons and its map; None where there are none.

    Raises:
        InvalidFile: the map cannot be read.
    """
    from sidestep.simulation.assembly import obstacles_of

    if scenario.map is None:
        return obstacles_of(scenario)
    from sidestep.io.maps import read_map

    return obstacles_of(scenario, read_map(scenario.map))


def write_scenario(scenario: Scenario, path: str | Path) -> None:
    """Write a scenario as TOML, every number included; reading it gives an equal one.

    Raises:
        OutputError: the file cannot be written.
    """
    with written(Path(path)) as file:
        file.write(to_toml(scenario.settings()).encode())


def _text_of(name: str | Path) -> tuple[str, str, str]:
    """(text, source for complaints, default name)."""
    word = str(name)
    path = Path(name)
    if not (isinstance(name, Path) or word.endswith(".toml") or "/" in word):
        return shipped_text(word), word, word
    try:
        return path.read_text(encoding="utf-8-sig"), word, os.fsencode(path.stem).decode(errors="replace")
    except FileNotFoundError:
        raise InvalidFile(word, "no such file", f"a TOML file, or one of {', '.join(shipped_names())}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidFile(word, str(error), "a TOML file") from None


def _absolute_files(data: dict[str, Any], folder: Path | None) -> None:
    """Files that a scenario names lie beside it."""
    if folder is None:
        return
    recording = data.get("recording")
    for table, field in ((data, "map"), (data, "human"), (recording, "file")):
        if isinstance(table, dict) and isinstance(table.get(field), str):
            table[field] = str(folder / table[field])


def _apply(data: dict[str, Any], change: str) -> None:
    """Set one dotted field: tables are made where they are missing, people are counted from 0."""
    field, equals, text = change.partition("=")
    field = field.strip()
    if not equals or not all(field.split(".")):
        raise InvalidInput("--set", change, "field=value, e.g. planner.horizon=5 or people.0.speed=1.2")
    *tables, last = field.split(".")
    if len(tables) > DEEPEST:
        raise InvalidInput("--set", change, f"a field at most {DEEPEST} tables deep")
    place: Any = data
    for depth, name in enumerate(tables):
        place = _entered(place, name, ".".join(tables[: depth + 1]))
    if isinstance(place, list):
        people = cast(list[Any], place)
        people[_index(people, last, field)] = value_in(text.strip())
    elif isinstance(place, dict):
        place[last] = value_in(text.strip())
    else:
        raise InvalidInput(field, text, "a field of a table", f"{'.'.join(tables)} is a single value")


def _entered(place: Any, name: str, field: str) -> Any:
    if isinstance(place, list):
        entries = cast(list[Any], place)
        return entries[_index(entries, name, field)]
    if isinstance(place, dict):
        return cast(dict[str, Any], place).setdefault(name, {})
    raise InvalidInput(field, name, "a field of a table", f"{field.rpartition('.')[0]} is a single value")


def _index(entries: Sequence[Any], name: str, field: str) -> int:
    if not name.isdecimal() or int(name) >= len(entries):
        raise InvalidInput(field, name, f"0 to {len(entries) - 1}" if entries else "nothing: the list is empty")
    return int(name)
