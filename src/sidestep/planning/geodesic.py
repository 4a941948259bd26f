"""Distance to the goal around walls, for a planner that sees only a few steps ahead."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sidestep._kernels.walls import interpolate
from sidestep._kernels.ways import shortest_ways
from sidestep.obstacles import Obstacles, coarse_enough
from sidestep.types import BoolArray, FloatArray, IntArray, Vector, VectorLike, frozen_array

_STRAIGHT = ((0, 0), (0, 0))
KNIGHT = ((1, 0), (0, 1), (1, 1), (1, -1), (2, 1), (1, 2), (2, -1), (1, -2))
"""Half of the 16 moves between cells; ways are at most 2.7 % too long."""
FLANKS = (
    _STRAIGHT, _STRAIGHT, ((1, 0), (0, 1)), ((1, 0), (0, -1)),
    ((1, 0), (1, 1)), ((0, 1), (1, 1)), ((1, 0), (1, -1)), ((0, -1), (1, -1)),
)  # fmt: skip
"""The two cells that each of them passes between."""
SIGHT = 20.0
"""m from the goal within which a way is straight where nothing is between; farther off it may be 2.7 % too long."""
CELLS = 2_000_000
"""About so many cells are enough for 140 m by 140 m at 0.1 m; passages narrower than a cell may be missed."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DistanceField:
    """Length of the shortest way to the goal that keeps a margin from walls.

    Attributes:
        goal: (2,) m; where it is not reachable, the nearest place that is free.
        corner: (2,) m, place of values[0, 0]; spacing: m; values: (w, h) m.
        open: (w, h) whether a way leads from there to the goal, or from a place no farther than the margin.
    """

    goal: Vector
    corner: Vector
    spacing: float
    values: FloatArray
    open: BoolArray

    def reaches(self, point: Vector) -> bool:
        """Whether a way leads to the goal from `point` (d,) m; off the raster there always is one."""
        i, j = (round(float(x)) for x in (point[:2] - self.corner) / self.spacing)
        w, h = self.open.shape
        return not (0 <= i < w and 0 <= j < h) or bool(self.open[i, j])

    def at(self, points: FloatArray | VectorLike) -> FloatArray:
        """Return (…,) m for `points` (…, d) m: interpolated, never less than the straight line, finite everywhere.

        Off the raster: the straight line to its edge plus the value there, by the shortest such way.
        """
        array = np.asarray(points, dtype=np.float64)
        flat = np.ascontiguousarray(array[..., :2].reshape(-1, 2))
        return interpolate(flat, self.values, self.corner, self.spacing, self.goal).reshape(array.shape[:-1])


def distance_to_goal(
    obstacles: Obstacles,
    goal: VectorLike,
    *,
    margin: float,
    spacing: float = 0.1,
    reach: float = 3.0,
    cells: int = CELLS,
) -> DistanceField:
    """Compute the field for one goal and one map: Dijkstra on cells with 16 neighbours, from those in sight.

    Args:
        obstacles: walls.
        goal: (2,) m (or (3,): the first two count).
        margin: m, to be kept from walls.
        spacing: m between cells; coarser where the map has more than `cells` of them.
        reach: m, how far around the walls and the goal the raster goes.
        cells: about the largest number of cells.
    """
    target = np.asarray(goal, dtype=np.float64)[:2]
    x0, y0, x1, y1 = obstacles.bounds
    low = np.minimum((x0, y0), target) - reach
    high = np.maximum((x1, y1), target) + reach
    width, height = (high - low).tolist()
    spacing = max(spacing, coarse_enough(width, height, cells))
    shape = tuple(int(n) for n in np.ceil((high - low) / spacing) + 1)
    places = np.stack(np.meshgrid(*(low[a] + spacing * np.arange(shape[a]) for a in (0, 1)), indexing="ij"), axis=-1)
    flat = places.reshape(-1, 2)
    margin = max(margin, 1e-3)
    free = obstacles.free(flat, margin)
    if not bool(obstacles.free(target, margin)) and free.any():
        target = flat[free][np.argmin(((flat[free] - target) ** 2).sum(axis=1))]
    values = _walk(obstacles, flat, free, shape, target, margin, spacing)
    values, apart = _filled(values, spacing, flat, target)
    return DistanceField(
        goal=frozen_array(target),
        corner=frozen_array(low),
        spacing=spacing,
        values=values,
        open=apart <= margin + spacing,
    )


def _walk(
    obstacles: Obstacles,
    places: FloatArray,
    free: BoolArray,
    shape: tuple[int, ...],
    goal: FloatArray,
    margin: float,
    spacing: float,
) -> FloatArray:
    """(w, h) lengths of the shortest ways, inf where there is none."""
    straight = np.sqrt(((places - goal) ** 2).sum(axis=1))
    close = np.flatnonzero(free & (straight < SIGHT))
    seen = close[obstacles.segment_free(places[close], np.broadcast_to(goal, places[close].shape), margin)]
    values = np.full(shape, np.inf)
    values.reshape(-1)[seen] = straight[seen]
    passable = free.reshape(shape)
    guarded = 0.6 * spacing < margin  # no place on a move is farther than this from its ends and its flanks
    long = [math.hypot(a, b) * spacing > margin for a, b in KNIGHT]  # such a move could jump a thin wall
    flanks = [pair if guarded and far else _STRAIGHT for pair, far in zip(FLANKS, long, strict=True)]
    shut = np.zeros((0, 0, 0), dtype=np.bool_)
    if any(long) and not guarded:
        shut = _shut(obstacles, places, passable, margin)
    shortest_ways(values, passable, shut, np.array(KNIGHT), np.array(flanks), spacing)
    return values


def _shut(obstacles: Obstacles, places: FloatArray, passable: BoolArray, margin: float) -> BoolArray:
    """(8, w, h) whether a move from a free cell to a free cell meets a wall."""
    shut = np.zeros((len(KNIGHT), *passable.shape), dtype=np.bool_)
    index, flat = np.arange(passable.size).reshape(passable.shape), passable.ravel()
    for m, (a, b) in enumerate(KNIGHT):
        here, there = _shifted(index, a, b)
        both = flat[here] & flat[there]
        here, there = here[both], there[both]
        shut[m].reshape(-1)[here] = ~obstacles.segment_free(places[here], places[there], margin)
    return shut


def _shifted(index: IntArray, a: int, b: int) -> tuple[IntArray, IntArray]:
    """Pairs of cells that lie (a, b) apart."""
    w, h = index.shape
    low, high = max(0, -b), h - max(0, b)
    return index[: w - a, low:high].ravel(), index[a:, low + b : high + b].ravel()


def _filled(values: FloatArray, spacing: float, places: FloatArray, goal: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values everywhere, and (w, h) m to the nearest cell with a way: from there, plus twice the way there."""
    from scipy.ndimage import distance_transform_edt

    known = np.isfinite(values)
    if not known.any():
        return np.sqrt(((places - goal) ** 2).sum(axis=1)).reshape(values.shape), np.full(values.shape, np.inf)
    transform = distance_transform_edt(~known, return_indices=True)
    assert transform is not None
    apart, nearest = (np.asarray(part) for part in transform)
    return np.ascontiguousarray(values[tuple(nearest)] + 2.0 * spacing * apart), spacing * apart
