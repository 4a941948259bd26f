"""Maps as ROS `map_server` writes them: a YAML file that names an image (PGM or PNG).

    image: office.pgm
    resolution: 0.05                # m per pixel
    origin: [-10.0, -5.0, 0.0]      # x, y in m and yaw in rad of the lower left corner
    negate: 0
    occupied_thresh: 0.65
    free_thresh: 0.196

Only this flat form is read (the one that `map_saver` writes), so no YAML library is needed.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np

from sidestep.errors import InvalidFile
from sidestep.obstacles import OccupancyGrid
from sidestep.types import BoolArray, FloatArray

KEYS = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh", "mode")


def read_map(path: str | Path, *, unknown_is_free: bool = False) -> OccupancyGrid:
    """Read a map for `Obstacles(grid=…)`.

    Args:
        path: of the YAML file; the image is looked for beside it.
        unknown_is_free: what pixels between the two thresholds (and transparent ones) count as; by default as walls,
            because nobody has seen that they are free.

    Raises:
        InvalidFile: the file or its image is missing or is not what it should be; names the key.
    """
    place = Path(path)
    entries = _entries(place)
    image = _text(entries, "image", place)
    resolution = _number(entries, "resolution", place)
    if resolution <= 0:
        raise InvalidFile(f"{place}: resolution", resolution, "a number > 0 (m per pixel)")
    origin = _numbers(entries.get("origin", "[0, 0, 0]"), f"{place}: origin")
    if len(origin) not in (2, 3):
        raise InvalidFile(f"{place}: origin", entries["origin"], "[x, y, yaw] in m, m and rad")
    mode = entries.get("mode", "trinary").strip("'\"")
    if mode not in ("trinary", "scale"):
        raise InvalidFile(f"{place}: mode", mode, "trinary or scale", "save the map again in one of these modes")
    least, most = _number(entries, "occupied_thresh", place, 0.65), _number(entries, "free_thresh", place, 0.196)
    if not 0.0 <= most <= least <= 1.0:
        wrong = f"free_thresh {most:g}, occupied_thresh {least:g}"
        raise InvalidFile(str(place), wrong, "0 ≤ free_thresh ≤ occupied_thresh ≤ 1", "they are shares, not percent")
    shade, opaque = _image(place.parent / image)
    darkness = shade if _number(entries, "negate", place, 0.0) else 1.0 - shade
    walls = (darkness > least) & opaque if unknown_is_free else ~((darkness < most) & opaque)
    yaw = origin[2] if len(origin) == 3 else 0.0
    return OccupancyGrid(
        occupied=np.ascontiguousarray(walls[::-1].T), resolution=resolution, origin=(origin[0], origin[1]), yaw=yaw
    )


def _entries(place: Path) -> dict[str, str]:
    try:
        text = place.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidFile(str(place), str(error), "a readable YAML file as map_server writes it") from error
    entries: dict[str, str] = {}
    joined = re.sub(r"(?m)^(\w+:)\s*\n((?:\s*-\s*\S+\s*\n?)+)", _inlined, text)
    for number, line in enumerate(joined.splitlines(), start=1):
        bare = re.sub(r"(^|\s)#.*$", "", line).strip()
        if not bare or bare in ("---", "..."):
            continue
        key, colon, value = bare.partition(":")
        if not colon or (value and not value[0].isspace()):
            raise InvalidFile(f"{place}, line {number}", line, "lines 'key: value' with " + ", ".join(KEYS))
        entries[key.strip()] = value.strip()
    return entries


def _inlined(match: re.Match[str]) -> str:
    """A block list as [a, b, c] on one line."""
    items = re.findall(r"-\s+(\S+)", match.group(2))
    return f"{match.group(1)} [{', '.join(items)}]\n"


def _text(entries: dict[str, str], key: str, place: Path) -> str:
    value = entries.get(key, "").strip("'\"")
    if not value:
        raise InvalidFile(f"{place}: {key}", None, "a value", f"add a line '{key}: …'")
    return value


def _number(entries: dict[str, str], key: str, place: Path, default: float | None = None) -> float:
    if key not in entries and default is not None:
        return default
    text = _text(entries, key, place)
    if text.lower() in ("true", "false"):
        return float(text.lower() == "true")
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InvalidFile(f"{place}: {key}", text, "a finite number")
    return value


def _numbers(text: str, field: str) -> list[float]:
    try:
        values = [float(part) for part in text.strip("[] ").split(",")]
    except ValueError as error:
        raise InvalidFile(field, text, "a list of numbers like [0.0, 0.0, 0.0]") from error
    if not all(math.isfinite(v) for v in values):
        raise InvalidFile(field, text, "finite numbers")
    return values


def _image(path: Path) -> tuple[FloatArray, BoolArray]:
    """Shade in [0, 1] (1 is white) and opacity of every pixel, the top row first."""
    if not path.is_file():
        raise InvalidFile(str(path), "no such file", "the image that the map names", "put it beside the YAML file")
    if path.suffix.lower() == ".pgm":
        shade = _pgm(path)
        return shade, np.full(shade.shape, True)
    from matplotlib.image import imread

    try:
        pixels = np.atleast_3d(np.asarray(imread(path), dtype=np.float64))
    except Exception as error:  # whatever the image library says, the file is the cause
        raise InvalidFile(str(path), str(error), "a PGM or PNG image") from error
    if path.suffix.lower() != ".png":
        pixels = pixels / 255.0
    transparent = pixels.shape[2] in (2, 4)
    opaque: BoolArray = np.asarray(pixels[..., -1] >= 1.0) if transparent else np.full(pixels.shape[:2], True)
    colours = pixels[..., : 1 if pixels.shape[2] < 3 else 3]
    return colours.mean(axis=2), opaque


def _pgm(path: Path) -> FloatArray:
    """Read a PGM image, plain (P2) or raw (P5), with 8 or 16 bits."""
    data = path.read_bytes()
    header = re.match(rb"(P[25])(?:\s*#[^\n]*\n|\s)+(\d+)(?:\s*#[^\n]*\n|\s)+(\d+)(?:\s*#[^\n]*\n|\s)+(\d+)\s", data)
    if header is None:
        raise InvalidFile(str(path), data[:16], "a PGM image (P2 or P5)")
    width, height, top = (int(header.group(i)) for i in (2, 3, 4))
    if header.group(1) == b"P2":
        try:
            values = np.array(re.sub(rb"#[^\n]*", b"", data[header.end() :]).split(), dtype=np.float64)
        except ValueError as error:
            raise InvalidFile(str(path), str(error), "numbers after the header of a P2 image") from error
    else:
        size = 2 if top > 255 else 1
        count = min(width * height, (len(data) - header.end()) // size)  # something may follow the last pixel
        values = np.frombuffer(data, f">u{size}", count, header.end()).astype(np.float64)
    if top <= 0 or width * height == 0 or values.size < width * height:
        raise InvalidFile(str(path), f"{values.size} pixels", f"{width} × {height} pixels as its header says")
    return values[: width * height].reshape(height, width) / top
