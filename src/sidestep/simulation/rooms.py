"""Rooms to look around in: random walls and furniture, with the things that resemble legs in a scan."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np

from sidestep.simulation.scene import Scene, rectangle
from sidestep.types import FloatArray

_Piece = tuple[list[FloatArray], list[tuple[float, float, float]]]
"""Polygons, and cylinders (x, y, radius)."""


def random_room(generator: np.random.Generator, *, size: tuple[float, float] = (5.0, 14.0), pieces: int = 12) -> Scene:
    """Draw a room with walls, openings and up to 2·`pieces` pieces of furniture; its middle is the origin.

    Args:
        generator: of everything drawn.
        size: m, smallest and largest side of the room.
        pieces: mean number of pieces of furniture.
    """
    width, depth = generator.uniform(*size, 2)
    polygons = _walls(generator, width, depth)
    cylinders: list[tuple[float, float, float]] = []
    makers: tuple[Callable[..., _Piece], ...] = (
        _table, _chair, _chair, _office_chair, _box, _box, _cylinder, _pole, _shelf, _clutter, _clutter,
    )  # fmt: skip
    for _ in range(generator.integers(pieces // 3, 2 * pieces)):
        at = generator.uniform(-0.5, 0.5, 2) * (width, depth)
        angle = generator.uniform(0, 2 * np.pi)
        maker = makers[generator.integers(len(makers))]
        more_polygons, more_cylinders = maker(generator, (float(at[0]), float(at[1])), angle)
        polygons += more_polygons
        cylinders += more_cylinders
    return Scene(polygons=tuple(polygons), cylinders=np.array(cylinders).reshape(-1, 3))


def _walls(generator: np.random.Generator, width: float, depth: float) -> list[FloatArray]:
    """Return four thick walls, each with a few openings that leave narrow pieces standing, and niches before them."""
    polygons: list[FloatArray] = []
    for angle, length, distance in ((0, width, depth), (np.pi / 2, depth, width), (np.pi, width, depth),
                                    (-np.pi / 2, depth, width)):  # fmt: skip
        cuts = np.sort(generator.uniform(-length / 2, length / 2, generator.integers(0, 4)))
        ends = np.concatenate(([-length / 2], cuts, [length / 2]))
        for left, right in itertools.pairwise(ends):
            opening = generator.choice([0.0, 0.1, 0.3, 0.9])
            piece = right - left - opening
            if piece > 0.05:
                setback = generator.choice([0.0, 0.0, 0.05, 0.3])
                middle = np.array([(left + right) / 2, distance / 2 + setback + 0.05])
                turned = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]) @ middle
                polygons.append(rectangle((turned[0], turned[1]), (piece, 0.1), angle))
    return polygons


def _posts(
    generator: np.random.Generator, at: tuple[float, float], offsets: FloatArray, angle: float, thickness: float
) -> _Piece:
    """Return upright posts at `offsets` (K, 2) m: round or square, `thickness` m across."""
    c, s = np.cos(angle), np.sin(angle)
    places = offsets @ np.array([[c, s], [-s, c]]) + np.asarray(at)
    if generator.random() < 0.5:
        return [], [(float(x), float(y), thickness / 2) for x, y in places]
    return [rectangle((float(x), float(y)), (thickness, thickness), angle) for x, y in places], []


def _corners(generator: np.random.Generator, low: float, high: float) -> FloatArray:
    return np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * generator.uniform(low, high, 2) / 2


def _table(generator: np.random.Generator, at: tuple[float, float], angle: float) -> _Piece:
    return _posts(generator, at, _corners(generator, 0.6, 2.0), angle, generator.uniform(0.03, 0.09))


def _chair(generator: np.random.Generator, at: tuple[float, float], angle: float) -> _Piece:
    polygons, cylinders = _posts(generator, at, _corners(generator, 0.36, 0.55), angle, generator.uniform(0.015, 0.05))
    if generator.random() < 0.2:  # a seat, a bag or a coat at the height of the scanner
        polygons.append(rectangle(at, tuple(generator.uniform(0.1, 0.45, 2)), angle))
    return polygons, cylinders


def _office_chair(generator: np.random.Generator, at: tuple[float, float], angle: float) -> _Piece:
    spokes = angle + 2 * np.pi * np.arange(5) / 5
    size = generator.uniform(0.22, 0.34)
    casters = [(at[0] + size * np.cos(a), at[1] + size * np.sin(a), 0.03) for a in spokes]
    return [], [(*at, generator.uniform(0.02, 0.06)), *(casters if generator.random() < 0.5 else [])]


def _box(generator: np.random.Generator, at: tuple[float, float], angle: float) -> _Piece:
    longest = generator.choice([0.2, 0.5, 1.5])
    return [rectangle(at, tuple(generator.uniform(0.06, longest, 2)), angle)], []


def _cylinder(generator: np.random.Generator, at: tuple[float, float], angle: float) -> _Piece:
    return [], [(*at, generator.uniform(0.1, 0.3))]


def _pole(generator: np.random.Generator, at: tuple[float, float], angle: float) -> _Piece:
    return [], [(*at, generator.uniform(0.01, 0.1))]


def _shelf(generator: np.random.Generator, at: tuple[float, float], angle: float) -> _Piece:
    """Return a deep front with uneven things on it: short flat pieces at different depths."""
    polygons: list[FloatArray] = []
    along = np.array([np.cos(angle), np.sin(angle)])
    inward = np.array([-along[1], along[0]])
    offset = 0.0
    for _ in range(generator.integers(3, 9)):
        piece = generator.uniform(0.05, 0.4)
        centre = np.asarray(at) + along * (offset + piece / 2) + inward * generator.uniform(0.0, 0.3)
        polygons.append(rectangle((centre[0], centre[1]), (piece, 0.05), angle))
        offset += piece + generator.choice([0.0, 0.02, 0.15])
    return polygons, []


def _clutter(generator: np.random.Generator, at: tuple[float, float], angle: float) -> _Piece:
    """Return plants, bags, cables, grass: small pieces without any order."""
    count = int(generator.integers(2, 9))
    places = np.asarray(at) + generator.normal(0.0, generator.uniform(0.08, 0.5), (count, 2))
    polygons = [
        rectangle((float(x), float(y)), tuple(generator.uniform(0.01, 0.2, 2)), generator.uniform(0, np.pi))
        for x, y in places[: count // 2]
    ]
    cylinders = [(float(x), float(y), generator.uniform(0.005, 0.08)) for x, y in places[count // 2 :]]
    return polygons, cylinders
