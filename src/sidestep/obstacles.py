"""Static maps: the places X_R that a robot, and X_H that a person may be in.

    walls = Obstacles(polygons=[[(0, 0), (4, 0), (4, 0.2), (0, 0.2)]])
    walls.free((2.0, 1.0), margin=0.3)            # True: at least 0.3 m from every wall
    walls.distance((2.0, 0.1))                    # −0.1 m: inside a wall
    walls.segment_free((2, 1), (2, -1), margin=0) # False: the way crosses a wall

Walls are flat and reach to the sky: in 3-D the first two coordinates count, and there is neither floor nor ceiling.
On a line there are none.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sidestep._kernels.walls import PAD, free_points, free_segments, wall_distances
from sidestep.checks import Checks, measured_number, of_kind
from sidestep.errors import InvalidInput
from sidestep.lattice import Lattice
from sidestep.types import BoolArray, FloatArray, VectorLike, frozen_array

SEGMENT_STEP = 0.005
"""m, finest step along a segment; a wall may intrude into the margin by at most half of it unseen."""
_ROUGH = 0.025  # m, between what is looked at on a way out of a wall; the wall's cells make its depth as uneven


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OccupancyGrid:
    """A map of square cells.

    Attributes:
        occupied: (w, h) True where there is a wall, [i, j] i cells along x and j along y.
        resolution: m per cell (> 0).
        origin: (2,) m, the outer corner of cell (0, 0); yaw: rad, of the map's x axis.
    """

    occupied: BoolArray
    resolution: float
    origin: tuple[float, float] = (0.0, 0.0)
    yaw: float = 0.0

    def __post_init__(self) -> None:
        check = Checks(self, "obstacles.grid")
        try:
            occupied = np.array(self.occupied, dtype=np.bool_, order="C")
        except (TypeError, ValueError):
            occupied = np.zeros(0, dtype=np.bool_)
        if occupied.ndim != 2 or occupied.size == 0 or np.ma.is_masked(self.occupied):
            raise check.wrong("occupied", "a non-empty 2-D array of true and false, none of them masked")
        occupied.setflags(write=False)
        object.__setattr__(self, "occupied", occupied)
        check.numbers("resolution", above=0.0, unit="m")
        check.listed("origin", count=2)
        check.numbers("yaw", unit="rad")

    def corners(self) -> FloatArray:
        """Return the (4, 2) m outer corners."""
        w, h = self.occupied.shape
        return self.placed([(0, 0), (w, 0), (w, h), (0, h)])

    def placed(self, cells: Sequence[tuple[float, float]]) -> FloatArray:
        """Return where the corners (K, 2) of cells, counted from that of cell (0, 0), are in the world, (K, 2) m."""
        turn = np.array([[math.cos(self.yaw), -math.sin(self.yaw)], [math.sin(self.yaw), math.cos(self.yaw)]])
        return (self.resolution * np.array(cells)) @ turn.T + np.asarray(self.origin)


class Obstacles:
    """Walls: closed polygons (filled), a map, or both. Immutable.

    Args:
        polygons: each (V, 2) m, V ≥ 2 corners (2: a thin wall); the last corner is joined to the first.
        grid: a map, or None.

    Raises:
        InvalidInput: corners that are not finite numbers (V, 2).
    """

    def __init__(
        self, *, polygons: Sequence[FloatArray | Sequence[VectorLike]] = (), grid: OccupancyGrid | None = None
    ) -> None:
        of_kind("obstacles.grid", grid, OccupancyGrid, optional=True)
        try:
            listed = list(polygons)
        except TypeError:
            raise InvalidInput("obstacles.polygons", polygons, "a list of polygons, each (V, 2) m") from None
        self.polygons = tuple(_polygon(p, i) for i, p in enumerate(listed))
        self.grid = grid

    def __bool__(self) -> bool:
        """Whether there is any wall."""
        return bool(self.polygons) or (self.grid is not None and bool(self.grid.occupied.any()))

    def distance(self, points: FloatArray | VectorLike) -> FloatArray:
        """Return (…,) m from `points` (…, d) m to the nearest wall: negative inside walls, inf without walls.

        NaN from where nobody knows, which is neither `free` nor on a way that is.
        """
        flat, shape = _flat(points)
        found = wall_distances(flat, *self._shapes)
        unknown = np.isnan(flat)
        if unknown.any():
            found[unknown.any(axis=1)] = np.nan
        return found.reshape(shape)

    def free(self, points: FloatArray | VectorLike, margin: float = 0.0) -> BoolArray:
        """Return (…,) whether `points` (…, d) m keep at least `margin` m from every wall."""
        flat, shape = _flat(points)
        found = free_points(flat, measured_number("margin", margin), *self._shapes, *self._samples)
        unknown = np.isnan(flat)
        if unknown.any():
            found[unknown.any(axis=1)] = False
        return found.reshape(shape)

    def segment_free(
        self, starts: FloatArray | VectorLike, ends: FloatArray | VectorLike, margin: float = 0.0
    ) -> BoolArray:
        """Return (…,) whether the way from `starts` to `ends`, (…, d) m, keeps `margin` m (see `SEGMENT_STEP`)."""
        a, shape = _flat(starts)
        b, other = _flat(ends)
        if shape != other:
            raise InvalidInput("ends", other, f"as many as starts: {shape}")
        kept = measured_number("margin", margin)
        known = np.isfinite(a + b)  # other ways have no end
        if known.all():
            return free_segments(a, b, kept, SEGMENT_STEP, *self._shapes, *self._samples).reshape(shape)
        whole = known.all(axis=1)
        found = np.zeros(whole.shape, dtype=np.bool_)
        found[whole] = free_segments(a[whole], b[whole], kept, SEGMENT_STEP, *self._shapes, *self._samples)
        return found.reshape(shape)

    def come_out(self, starts: FloatArray, ends: FloatArray, margin: float) -> BoolArray:
        """Return (M,) whether ways (M, d) m from inside a wall lead out of it, and neither back nor into another.

        They come nowhere nearer to a wall, by `_ROUGH` and more, than they were before, unless they keep `margin` m.
        """
        a, b = _flat(starts)[0], _flat(ends)[0]
        longest = float(np.sqrt(np.square(b - a).sum(axis=1)).max(initial=0.0))
        shares = np.linspace(0.0, 1.0, 2 + math.ceil(longest / _ROUGH))[:, None, None]
        gaps = self.distance(a + shares * (b - a))
        nearer: BoolArray = gaps < np.minimum(np.maximum.accumulate(gaps), margin) - _ROUGH
        return np.asarray(~nearer.any(axis=0))

    def free_cells(self, lattice: Lattice, margin: float = 0.0) -> BoolArray:
        """Return (cells…) whether each cell of `lattice` keeps `margin` m from every wall."""
        return self.free(lattice.positions(), margin)

    @property
    def shapes(self) -> tuple[FloatArray, BoolArray, FloatArray, FloatArray, FloatArray, FloatArray]:
        """What `_kernels.walls.free_points` reads after the points and the margin."""
        return *self._shapes, *self._samples

    @cached_property
    def bounds(self) -> tuple[float, float, float, float]:
        """x_min, y_min, x_max, y_max in m around all walls; zeros without walls."""
        corners = [*self.polygons, *([self.grid.corners()] if self.grid is not None else [])]
        if not corners:
            return (0.0, 0.0, 0.0, 0.0)
        places = np.concatenate(corners)
        low, high = places.min(axis=0), places.max(axis=0)
        return float(low[0]), float(low[1]), float(high[0]), float(high[1])

    @cached_property
    def _shapes(self) -> tuple[FloatArray, BoolArray, FloatArray, FloatArray]:
        """What the kernels read: segments, cells, the cells' frame, and bounds on their distances."""
        rows = [
            np.column_stack([p, np.roll(p, -1, axis=0), np.tile([len(p), *p.min(axis=0), *p.max(axis=0)], (len(p), 1))])
            for p in self.polygons
        ]
        segments = np.concatenate(rows) if rows else np.zeros((0, 9))
        if self.grid is None:
            return segments, np.zeros((0, 0), dtype=np.bool_), np.zeros(5), np.zeros((0, 0))
        from scipy.ndimage import distance_transform_edt

        cells = self.grid.occupied
        sizes = np.full(cells.shape, float(sum(cells.shape)))
        if cells.any():
            outside = np.asarray(distance_transform_edt(~cells))
            inside = np.asarray(distance_transform_edt(cells)) if not cells.all() else sizes
            sizes = np.where(cells, inside, outside)
        x, y = self.grid.origin
        frame = np.array([x, y, math.cos(self.grid.yaw), math.sin(self.grid.yaw), self.grid.resolution])
        return segments, cells, frame, np.ascontiguousarray(sizes, dtype=np.float64)

    @cached_property
    def _samples(self) -> tuple[FloatArray, FloatArray]:
        """Signed distances on a coarse raster around the walls, (w, h), and its (x, y, spacing)."""
        x0, y0, x1, y1 = self.bounds
        if not self.polygons and self.grid is None:
            return np.zeros((0, 0)), np.array([0.0, 0.0, 1.0])
        spacing = max(0.05, coarse_enough(x1 - x0 + 2 * PAD, y1 - y0 + 2 * PAD, 200_000))
        xs = np.arange(x0 - PAD, x1 + PAD + spacing, spacing)
        ys = np.arange(y0 - PAD, y1 + PAD + spacing, spacing)
        places = np.stack(np.meshgrid(xs, ys, indexing="ij"), axis=-1).reshape(-1, 2)
        values = wall_distances(places, *self._shapes).reshape(xs.size, ys.size)
        return values, np.array([x0 - PAD, y0 - PAD, spacing])


def coarse_enough(width: float, height: float, cells: int) -> float:
    """Return m between about so many `cells` of a raster of this size (m), at least two of them wide and high."""
    return max(math.sqrt(width * height / cells), 2.0 * max(width, height) / cells)


def _polygon(corners: FloatArray | Sequence[VectorLike], index: int) -> FloatArray:
    try:
        array = frozen_array(corners)
    except (TypeError, ValueError, OverflowError):
        array = np.zeros((0, 2))
    if array.ndim != 2 or array.shape[1] != 2 or len(array) < 2 or not np.isfinite(array).all():
        raise InvalidInput(f"obstacles.polygons[{index}]", corners, "at least 2 finite corners (V, 2) m")
    return array


def _flat(points: FloatArray | VectorLike) -> tuple[FloatArray, tuple[int, ...]]:
    try:
        array = np.asarray(points, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise InvalidInput("points", points, "(…, 2) or (…, 3) numbers (m)") from None
    if array.ndim == 0 or array.shape[-1] not in (2, 3):
        raise InvalidInput("points", array.shape, "(…, 2) or (…, 3) m")
    return np.ascontiguousarray(array[..., :2].reshape(-1, 2)), array.shape[:-1]
