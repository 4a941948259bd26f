"""Distance to the goal around walls, for a planner that sees only a few steps ahead."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sidestep._kernels.walls import interpolate
from sidestep.obstacles import Obstacles, coarse_enough
from sidestep.types import BoolArray, FloatArray, IntArray, Vector, VectorLike, frozen_array

KNIGHT = ((1, 0), (0, 1), (1, 1), (1, -1), (2, 1), (1, 2), (2, -1), (1, -2))
"""Half of the 16 moves between cells; ways are at most 2.7 % too long."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DistanceField:
    """Length of the shortest way to the goal that keeps a margin from walls.

    Attributes:
        goal: (2,) m; where it is not reachable, the nearest place that is free.
        corner: (2,) m, place of values[0, 0]; spacing: m; values: (w, h) m.
    """

    goal: Vector
    corner: Vector
    spacing: float
    values: FloatArray

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
    cells: int = 40000,
) -> DistanceField:
    """Compute the field for one goal and one map: Dijkstra on cells with 16 neighbours, from all cells in sight.

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
    return DistanceField(
        goal=frozen_array(target),
        corner=frozen_array(low),
        spacing=spacing,
        values=_filled(values, spacing, flat, target),
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
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import dijkstra

    straight = np.sqrt(((places - goal) ** 2).sum(axis=1))
    seen = np.zeros(len(places), dtype=np.bool_)
    seen[free] = obstacles.segment_free(places[free], np.broadcast_to(goal, places[free].shape), margin)
    index = np.arange(len(places)).reshape(shape)
    passable = free.reshape(shape)
    rows: list[IntArray] = [np.full(int(seen.sum()), len(places), dtype=np.int64)]
    columns: list[IntArray] = [np.flatnonzero(seen)]
    lengths: list[FloatArray] = [np.maximum(straight[seen], 1e-9)]
    for a, b in KNIGHT:
        here, there = _shifted(index, a, b)
        ways = (passable.ravel()[here] & passable.ravel()[there]) & ~(seen[here] & seen[there])
        here, there = here[ways], there[ways]
        if math.hypot(a, b) * spacing > margin:  # so long a move could jump a thin wall
            clear = obstacles.segment_free(places[here], places[there], margin)
            here, there = here[clear], there[clear]
        rows.append(here)
        columns.append(there)
        lengths.append(np.full(len(here), spacing * math.hypot(a, b)))
    size = len(places) + 1
    graph = coo_array((np.concatenate(lengths), (np.concatenate(rows), np.concatenate(columns))), shape=(size, size))
    return np.asarray(dijkstra(graph.tocsr(), directed=False, indices=len(places)))[:-1].reshape(shape)


def _shifted(index: IntArray, a: int, b: int) -> tuple[IntArray, IntArray]:
    """Pairs of cells that lie (a, b) apart."""
    w, h = index.shape
    low, high = max(0, -b), h - max(0, b)
    return index[: w - a, low:high].ravel(), index[a:, low + b : high + b].ravel()


def _filled(values: FloatArray, spacing: float, places: FloatArray, goal: FloatArray) -> FloatArray:
    """Values everywhere: cells without a way take that of the nearest cell with one, plus twice the way there."""
    from scipy.ndimage import distance_transform_edt

    known = np.isfinite(values)
    if not known.any():
        return np.sqrt(((places - goal) ** 2).sum(axis=1)).reshape(values.shape)
    transform = distance_transform_edt(~known, return_indices=True)
    assert transform is not None
    apart, nearest = (np.asarray(part) for part in transform)
    return np.ascontiguousarray(values[tuple(nearest)] + 2.0 * spacing * apart)
