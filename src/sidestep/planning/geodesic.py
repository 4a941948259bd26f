"""Distance to the goal around walls, for a planner that sees only a few steps ahead."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sidestep._kernels.walls import interpolate
from sidestep._kernels.ways import shade, shortest_ways
from sidestep.obstacles import Obstacles, coarse_enough
from sidestep.types import BoolArray, FloatArray, IntArray, Vector, VectorLike, frozen_array, sealed

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
COARSE, FAR = 0.2, 140.0
"""m between cells, at most: where a map needs coarser ones, what is farther than so many m from the goal is no part."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DistanceField:
    """Length of the shortest way to the goal that keeps a margin from walls.

    Attributes:
        goal: (d,) m; where it is not reachable, the nearest place that is free.
        corner: (2,) m, place of values[0, 0]; spacing: m; values: (w, h) m, in the plane.
        free: (w, h) cells that ways may lead over; open: (w, h) those from which one leads to the goal.
        near: m to the nearest cell that is free, within which a place counts as that cell does.
    """

    goal: Vector
    corner: Vector
    spacing: float
    values: FloatArray
    free: BoolArray
    open: BoolArray
    near: float

    def reaches(self, point: Vector) -> bool:
        """Whether a way leads to the goal from `point` (d,) m; off the raster there always is one."""
        where = (np.asarray(point[:2]) - self.corner) / self.spacing
        i, j = (round(float(x)) for x in where)
        w, h = self.open.shape
        if not (0 <= i < w and 0 <= j < h) or self.open[i, j]:
            return True
        most = math.ceil(self.near / self.spacing)
        low = max(i - most, 0), max(j - most, 0)
        around = slice(low[0], i + most + 1), slice(low[1], j + most + 1)
        cells = np.argwhere(self.free[around]) + low
        away = np.square(cells - where).sum(axis=1)
        if not len(cells) or away.min() > (most + 1) ** 2:
            return False
        return bool(self.open[tuple(cells[away.argmin()])])

    def at(self, points: FloatArray | VectorLike) -> FloatArray:
        """Return (…,) m for `points` (…, d) m: interpolated, never less than the straight line, finite everywhere.

        Off the raster: the straight line to its edge plus the value there, by the shortest such way. Walls reach to the
        sky: a way that climbs evenly is as long as the diagonal of the way in the plane and the height.
        """
        array = np.asarray(points, dtype=np.float64)
        flat = np.ascontiguousarray(array[..., :2].reshape(-1, 2))
        walk = interpolate(flat, self.values, self.corner, self.spacing, self.goal[:2]).reshape(array.shape[:-1])
        return walk if self.goal.size == 2 else np.hypot(walk, array[..., 2] - self.goal[2])


def way_to(goal: Vector, place: Vector, field: DistanceField | None) -> float:
    """Return m from `place` to `goal`, both (d,) m, along a field; None: straight."""
    return math.dist(goal, place) if field is None else float(field.at(place[None])[0])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ways:
    """A raster of the places that ways to one goal may lead over.

    Attributes:
        goal: (d,) m; where it is not reachable, the nearest place that is free.
        corner: (2,) m, place of cell [0, 0]; spacing: m; margin: m, kept from walls.
        free: (w, h) cells that are far enough from walls.
        straight: (w, h) m to the goal where nothing is between, inf elsewhere.
        flanks: (8, 2, 2), and shut: (8, w, h) or of size 0, as in `shortest_ways`.
    """

    goal: Vector
    corner: Vector
    spacing: float
    margin: float
    free: BoolArray
    straight: FloatArray
    flanks: IntArray
    shut: BoolArray

    @property
    def far(self) -> Vector:
        """(2,) m, place of the last cell."""
        return self.corner + self.spacing * (np.array(self.free.shape) - 1)

    def covers(self, places: FloatArray) -> bool:
        """Whether all `places` (M, 2) m are on the raster."""
        return bool(((places >= self.corner) & (places <= self.far)).all())

    def field(self, centres: FloatArray | None = None, radii: FloatArray | None = None) -> DistanceField:
        """Walk from the goal over all cells: Dijkstra with 16 neighbours, from those in sight.

        Args:
            centres: (K, 2) m, and radii: (K,) m, of discs to go around, as around walls; the goal is in none of them.
        """
        values, free = self.straight.copy(), self.free.copy()
        around = self.margin
        if centres is not None and radii is not None:
            shade(values, free, self.corner, self.spacing, self.goal, centres, radii)
            around = max(around, float(radii.max(initial=0.0)))
        shortest_ways(values, free, self.shut, np.array(KNIGHT), self.flanks, self.spacing)
        reached = np.isfinite(values)
        return DistanceField(
            goal=self.goal,
            corner=self.corner,
            spacing=self.spacing,
            values=_filled(values, reached, self.spacing, self.corner, self.goal),
            free=free,
            open=reached,
            near=around + self.spacing,
        )


def ways_to_goal(
    obstacles: Obstacles,
    goal: VectorLike,
    *,
    margin: float,
    spacing: float = 0.1,
    reach: float = 3.0,
    cells: int = CELLS,
) -> Ways:
    """Lay out where ways to a goal may lead on a map.

    Args:
        obstacles: walls.
        goal: (2,) m, or (3,).
        margin: m, to be kept from walls.
        spacing: m between cells; coarser where the map has more than `cells` of them (see `COARSE`).
        reach: m, how far around the walls and the goal the raster goes.
        cells: about the largest number of cells.
    """
    target = np.asarray(goal, dtype=np.float64)[:2]
    x0, y0, x1, y1 = obstacles.bounds
    low = np.minimum((x0, y0), target) - reach
    high = np.maximum((x1, y1), target) + reach
    if coarse_enough(float(high[0] - low[0]), float(high[1] - low[1]), cells) > COARSE:
        low, high = np.maximum(low, target - FAR), np.minimum(high, target + FAR)
    places, spacing = _raster(low, high, spacing, cells)
    flat = places.reshape(-1, 2)
    margin = max(margin, 1e-3)
    free = obstacles.free(flat, margin)
    if not bool(obstacles.free(target, margin)) and free.any():
        target = flat[free][np.argmin(((flat[free] - target) ** 2).sum(axis=1))]
    shape = places.shape[:2]
    guarded = 0.6 * spacing < margin  # no place on a move is farther than this from its ends and its flanks
    long = [math.hypot(a, b) * spacing > margin for a, b in KNIGHT]  # such a move could jump a thin wall
    shut = np.zeros((0, 0, 0), dtype=np.bool_)
    if any(long) and not guarded:
        shut = _shut(obstacles, flat, free.reshape(shape), margin)
    return Ways(
        goal=frozen_array([*target, *np.asarray(goal, dtype=np.float64)[2:]]),
        corner=frozen_array(low),
        spacing=spacing,
        margin=margin,
        free=free.reshape(shape),
        straight=sealed(_in_sight(obstacles, flat, free, target, margin).reshape(shape)),
        flanks=np.array([pair if guarded and far else _STRAIGHT for pair, far in zip(FLANKS, long, strict=True)]),
        shut=shut,
    )


def open_ways(
    goal: VectorLike, low: VectorLike, high: VectorLike, *, spacing: float = 0.1, cells: int = 40_000
) -> Ways:
    """Lay out where ways to a goal may lead from `low` to `high`, (2,) m, where there are no walls; see `Ways`.

    Args:
        goal: (2,) m, anywhere.
        low: m, the corner with the least coordinates; high: m, the one with the greatest.
        spacing: m between cells; coarser where there were more than `cells` of them.
        cells: about the largest number of cells.
    """
    target = frozen_array(np.asarray(goal, dtype=np.float64))
    places, spacing = _raster(np.asarray(low), np.asarray(high), spacing, cells)
    return Ways(
        goal=target,
        corner=frozen_array(places[0, 0]),
        spacing=spacing,
        margin=0.0,
        free=np.ones(places.shape[:2], dtype=np.bool_),
        straight=sealed(np.sqrt(((places - target) ** 2).sum(axis=-1))),
        flanks=np.array([_STRAIGHT] * len(KNIGHT)),
        shut=np.zeros((0, 0, 0), dtype=np.bool_),
    )


def _raster(low: FloatArray, high: FloatArray, spacing: float, cells: int) -> tuple[FloatArray, float]:
    """(w, h, 2) m places of cells from `low` to `high`, and how far apart they are."""
    width, height = (high - low).tolist()
    spacing = max(spacing, coarse_enough(width, height, cells))
    shape = tuple(int(n) for n in np.ceil((high - low) / spacing) + 1)
    axes = (low[a] + spacing * np.arange(shape[a]) for a in (0, 1))
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1), spacing


def _in_sight(obstacles: Obstacles, places: FloatArray, free: BoolArray, goal: FloatArray, margin: float) -> FloatArray:
    """(M,) m from places (M, 2) m straight to the goal, inf where a wall is between, or it is far."""
    straight = np.sqrt(((places - goal) ** 2).sum(axis=1))
    close = np.flatnonzero(free & (straight < SIGHT))
    seen = close[obstacles.segment_free(places[close], np.broadcast_to(goal, places[close].shape), margin)]
    out = np.full(len(places), np.inf)
    out[seen] = straight[seen]
    return out


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


def _filled(values: FloatArray, known: BoolArray, spacing: float, corner: Vector, goal: Vector) -> FloatArray:
    """Values everywhere: where none is known, that of the nearest cell where one is, plus twice the way there."""
    from scipy.ndimage import distance_transform_edt

    if known.all():
        return values
    if not known.any():
        x, y = (corner[a] + spacing * np.arange(values.shape[a]) - goal[a] for a in (0, 1))
        return np.hypot(x[:, None], y)
    transform = distance_transform_edt(~known, return_indices=True)
    assert transform is not None
    apart, nearest = (np.asarray(part) for part in transform)
    return np.ascontiguousarray(values[tuple(nearest)] + 2.0 * spacing * apart)
