"""Record ↔ one `.npz` file: plain arrays, and everything else as JSON in `meta`. No pickle, readable by any numpy."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sidestep.archives import read_arrays
from sidestep.errors import InvalidFile
from sidestep.io.files import written
from sidestep.simulation.record import Record, Snapshot
from sidestep.types import frozen_array

FORMAT = "sidestep-record"
VERSION = 1
_TEXT = ("scenario", "settings", "seed", "robot_radius", "people", "status", "risk_limit", "clearance")
_MORE_TEXT = ("time_step", "control_step", "reached_goal")
_APART = ("snapshots", "walls")
_LATER = ("other_robots", "other_radii", "other_goals")  # not in older files
_SNAPSHOT = ("origin", "rotation", "probability", "instants", "weights", "sigmas")


def write_record(record: Record, path: str | Path) -> Path:
    """Write a record; an existing file is replaced whole or not at all.

    Returns:
        The path, with `.npz` added where it had no such ending.

    Raises:
        OutputError: the file cannot be written.
    """
    path = Path(path)
    path = path if path.suffix == ".npz" else path.with_name(path.name + ".npz")
    meta: dict[str, Any] = {"format": FORMAT, "version": VERSION}
    meta |= {name: getattr(record, name) for name in (*_TEXT, *_MORE_TEXT)}
    meta["snapshots"] = [{"step": s.step, "person": s.person, "spacing": s.spacing} for s in record.snapshots]
    meta["walls"] = len(record.walls)
    arrays: dict[str, NDArray[Any]] = {name: getattr(record, name) for name in _array_names()}
    for i, shot in enumerate(record.snapshots):
        arrays |= {f"snapshot_{i}_{name}": getattr(shot, name) for name in _SNAPSHOT}
    arrays |= {f"wall_{i}": wall for i, wall in enumerate(record.walls)}
    with written(path) as file:
        np.savez_compressed(file, allow_pickle=False, **{"meta": np.array(json.dumps(meta))} | arrays)
    return path


def read_record(path: str | Path) -> Record:
    """Read a record that `write_record` wrote.

    Raises:
        InvalidFile: there is no such file, or it is not a record of this format, or of a newer version.
    """
    what = f"a {FORMAT} file (.npz), version ≤ {VERSION}"
    held = read_arrays(Path(path), what)
    try:
        meta = json.loads(str(held.pop("meta")))
        if meta["format"] != FORMAT or meta["version"] > VERSION:
            raise InvalidFile(str(path), f"{meta['format']} {meta['version']}", what, "update sidestep")
        return _assembled(meta, held)
    except InvalidFile:
        raise
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise InvalidFile(str(path), str(error) or type(error).__name__, what) from None


def _array_names() -> list[str]:
    return [f.name for f in fields(Record) if f.name not in (*_TEXT, *_MORE_TEXT, *_APART)]


def _assembled(meta: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Record:
    shots: list[Snapshot] = []
    for i, scalars in enumerate(meta["snapshots"]):
        held = {name: f"snapshot_{i}_{name}" for name in _SNAPSHOT}  # the spread is not in older files
        shots.append(Snapshot(**{name: _frozen(arrays[key]) for name, key in held.items() if key in arrays}, **scalars))
    values: dict[str, Any] = {name: meta[name] for name in (*_TEXT, *_MORE_TEXT)}
    values["people"], values["status"] = tuple(meta["people"]), tuple(meta["status"])
    values |= {name: frozen_array(arrays[name]) for name in _array_names() if name in arrays or name not in _LATER}
    values["snapshots"] = tuple(shots)
    values["walls"] = tuple(frozen_array(arrays[f"wall_{i}"]) for i in range(meta["walls"]))
    return Record(**values)


def _frozen(array: NDArray[Any]) -> NDArray[Any]:
    array.setflags(write=False)
    return array
