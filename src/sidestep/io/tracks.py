"""Pedestrian data sets: CSV of tracks, `scene,t,agent,kind,x,y[,vx,vy]`, plain or gzipped.

Velocities in the file are not used: some sets estimate them with a look at the future. They are taken anew from past
positions where they are needed.
"""

from __future__ import annotations

import csv
import gzip
import math
import zlib
from collections import defaultdict
from collections.abc import Iterator, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import TextIO, cast

import numpy as np

from sidestep.errors import InvalidFile, UnknownName
from sidestep.simulation.recordings import Recording, Track

_NEEDED = ("scene", "t", "agent", "kind", "x", "y")
_SHOWN = 8  # scene names in a complaint; some sets have hundreds

Samples = dict[tuple[str, str], tuple[str, list[float], list[float], list[float]]]
"""(scene, agent) → kind, t, x, y."""


def read_recording(path: str | Path, scene: str | None = None) -> Recording:
    """Read one scene.

    Args:
        path: CSV file, `.gz` or plain.
        scene: its name; None where the file holds only one.

    Raises:
        InvalidFile: the file is absent, not a CSV of tracks, or has a value that is not a finite number.
        UnknownName: there is no such scene.
    """
    samples = _read(Path(path), scene)
    if scene is None:
        names = sorted({name for name, _ in samples})
        if len(names) != 1:
            shown = ", ".join(names[:_SHOWN]) + (", …" if len(names) > _SHOWN else "")
            raise InvalidFile(f"{path}: scene", len(names), f"one scene; it holds {shown}", "choose one with --scene")
        scene = names[0]
    elif not samples:
        names = scene_names(path)
        if not names:
            raise _nothing_in(path)
        near = get_close_matches(scene, names, n=_SHOWN, cutoff=0.0)
        raise UnknownName(f"{path}: scene", scene, near)
    return _recordings(Path(path), samples)[scene]


def read_recordings(path: str | Path) -> dict[str, Recording]:
    """Read all scenes of a file, by name.

    Raises:
        InvalidFile: as `read_recording`.
    """
    return _recordings(Path(path), _read(Path(path), None))


def scene_names(path: str | Path) -> list[str]:
    """Names of the scenes in a file, sorted.

    Raises:
        InvalidFile: as `read_recording`.
    """
    return sorted({row[0] for _, row in _rows(Path(path))})


def _recordings(path: Path, samples: Samples) -> dict[str, Recording]:
    tracks: defaultdict[str, list[Track]] = defaultdict(list)
    for (scene, agent), (kind, t, x, y) in samples.items():
        order = np.argsort(t, kind="stable")
        time = np.array(t)[order]
        twice = np.flatnonzero(np.diff(time) <= 0)
        if len(twice):
            field = f"{path}: scene {scene!r}, agent {agent!r}, t"
            raise InvalidFile(field, float(time[twice[0]]), "one row per agent and time", "remove the second row")
        tracks[scene].append(Track(agent=agent, kind=kind, time=time, positions=np.stack([x, y], axis=1)[order]))
    return {scene: Recording(name=scene, tracks=tuple(found)) for scene, found in tracks.items()}


def _read(path: Path, scene: str | None) -> Samples:
    samples: Samples = {}
    for line, row in _rows(path):
        name, t, agent, kind, x, y = row
        if scene is not None and name != scene:
            continue
        key = (name, agent)
        if key not in samples:
            samples[key] = (kind, [], [], [])
        _, times, xs, ys = samples[key]
        times.append(_number(path, line, "t", t))
        xs.append(_number(path, line, "x", x))
        ys.append(_number(path, line, "y", y))
    if scene is None and not samples:
        raise _nothing_in(path)
    return samples


def _nothing_in(path: str | Path) -> InvalidFile:
    return InvalidFile(f"{path}", "no rows", "at least one row of " + ",".join(_NEEDED))


def _number(path: Path, line: int, field: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        mend = "" if text else "leave the line out where nobody was seen"
        raise InvalidFile(f"{path}, line {line}, {field}", text, "a finite number", mend)
    return value


def _rows(path: Path) -> Iterator[tuple[int, Sequence[str]]]:
    """Line numbers and the six needed columns, in their order."""
    try:
        with _opened(path) as file:
            reader = csv.reader(file)
            header = [name.strip() for name in next(reader, [])]
            absent = [name for name in _NEEDED if name not in header]
            if absent:
                got = ",".join(header)
                mend = "put commas between the columns" if len(header) == 1 else f"add {', '.join(absent)}"
                raise InvalidFile(f"{path}, header", got, ",".join(_NEEDED) + "[,vx,vy]", mend)
            columns = [header.index(name) for name in _NEEDED]
            for row in reader:
                if not row:
                    continue
                if len(row) <= max(columns):
                    raise InvalidFile(f"{path}, line {reader.line_num}", ",".join(row), f"{len(header)} columns")
                yield reader.line_num, [row[column].strip() for column in columns]
    except FileNotFoundError:
        raise InvalidFile(str(path), "no such file", "a CSV of tracks, plain or .gz") from None
    except (OSError, EOFError, UnicodeDecodeError, csv.Error, zlib.error) as error:
        raise InvalidFile(str(path), str(error), "a CSV of tracks, plain or .gz") from None


def _opened(path: Path) -> TextIO:
    """The text, without the mark that spreadsheets put before it."""
    if path.suffix == ".gz":
        return cast(TextIO, gzip.open(path, "rt", encoding="utf-8-sig", newline=""))
    return path.open(encoding="utf-8-sig", newline="")
