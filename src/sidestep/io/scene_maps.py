"""Walls of recorded scenes, as OpenTraj gives them: XML of line segments (m) in a folder `maps` beside the tracks."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from sidestep.errors import InvalidFile
from sidestep.types import FloatArray

THICKNESS = 0.1  # m, given to a line, which has none


def scene_walls(tracks: Path, scene: str) -> tuple[FloatArray, ...]:
    """Return the walls of a scene, each a (4, 2) m rectangle around a line; () where no map belongs to it.

    A map belongs to a scene when letters and number agree: `UCY__zara01__map.xml` to `zara1`.

    Args:
        tracks: the file of tracks beside which the folder lies.
        scene: name.

    Raises:
        InvalidFile: the map cannot be read.
    """
    for file in sorted((tracks.parent / "maps").glob("*.xml")):
        if any(_plain(part) == _plain(scene) for part in file.stem.split("__")):
            return _walls(file)
    return ()


def _plain(name: str) -> str:
    """Letters and number without leading zeros."""
    return re.sub(r"0*(\d+)$", r"\1", name.lower().replace("_", ""))


def _walls(file: Path) -> tuple[FloatArray, ...]:
    try:
        lines = [e for e in ElementTree.parse(file).iter() if e.tag.rpartition("}")[2] == "Line"]
        ends = [[[float(e.attrib[f"x{i}"]), float(e.attrib[f"y{i}"])] for i in (1, 2)] for e in lines]
    except (OSError, ElementTree.ParseError, KeyError, ValueError) as error:
        raise InvalidFile(str(file), str(error), "XML with elements Line of x1, y1, x2, y2 in metres") from None
    walls: list[FloatArray] = []
    for a, b in np.array(ends).reshape(-1, 2, 2):
        along = b - a
        length = float(np.linalg.norm(along))
        if length > 0:
            side = np.array([-along[1], along[0]]) * (0.5 * THICKNESS / length)
            walls.append(np.array([a - side, b - side, b + side, a + side]))
    return tuple(walls)
