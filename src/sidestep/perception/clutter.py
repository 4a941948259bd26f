"""What stands still around the scanner: a local map that tells furniture from people, with time."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from sidestep._kernels.carve import traversed
from sidestep.types import BoolArray, FloatArray, IntArray

_SPACING = 0.1  # m
_CELLS = 240  # per axis: 24 m, scanner near the middle
_LIMIT = 2.0  # how sure a cell can become, either way
_FILL_TIME = 3.0  # s of being hit until an unknown cell counts as standing
_CLEAR_TIME = 1.0  # s of being looked through until an unknown cell counts as free
_SHORT = 0.15  # m; beams clear the way up to this far before what they hit


@dataclass(slots=True)
class ClutterMap:
    """Per cell, how long something has been there (positive) or nothing (negative); follows the scanner.

    Attributes:
        value: (240, 240) from −2, free for long, over 0, unknown, to 2, occupied for long.
    """

    value: FloatArray = field(default_factory=lambda: np.zeros((_CELLS, _CELLS)))
    _corner: IntArray | None = None  # (2,) cells of the fixed frame: where cell (0, 0) lies

    def clear(self) -> None:
        """Forget everything."""
        self.value[:] = 0.0
        self._corner = None

    def update(self, origin: FloatArray, hits: FloatArray, moving: BoolArray, duration: float) -> None:
        """Take one scan.

        Args:
            origin: (2,) m, the scanner, in the fixed frame.
            hits: (V, 2) m, all returns.
            moving: (V,) returns from people who are being tracked: they leave no trace.
            duration: s since the last scan.
        """
        self._follow(origin)
        assert self._corner is not None
        away = hits - origin
        distance = np.maximum(np.hypot(*away.T), 1e-9)
        ends = origin + away * np.maximum(1.0 - _SHORT / distance, 0.0)[:, None]
        corner = (self._corner * _SPACING).astype(np.float64)
        free = traversed(origin, ends, corner, _SPACING, (_CELLS, _CELLS))
        cells, inside = self._cells(hits)
        occupied = np.zeros_like(free)
        kept = inside & ~moving
        occupied[cells[kept, 0], cells[kept, 1]] = True
        spared = np.zeros_like(free)
        spared[cells[inside, 0], cells[inside, 1]] = True
        self.value[free & ~spared] -= duration / _CLEAR_TIME
        self.value[occupied] += duration / _FILL_TIME
        np.clip(self.value, -_LIMIT, _LIMIT, out=self.value)

    def standing(self, points: FloatArray) -> FloatArray:
        """Return for points (K, 2) m how long something has stood there: the most occupied of the nine cells around.

        From −2 (all of them free for long) to 2 (one of them occupied for long); 0 where the map does not reach.
        """
        if self._corner is None or points.shape[0] == 0:
            return np.zeros(points.shape[0])
        cells, inside = self._cells(points)
        cells = np.where(inside[:, None], cells, 1)
        rows = cells[:, 0, None, None] + np.arange(-1, 2)[:, None]
        columns = cells[:, 1, None, None] + np.arange(-1, 2)
        return np.where(inside, self.value[rows, columns].max(axis=(1, 2)), 0.0)

    def _cells(self, points: FloatArray) -> tuple[IntArray, BoolArray]:
        assert self._corner is not None
        cells = np.floor(points / _SPACING).astype(np.int64) - self._corner
        return cells, np.all((cells >= 1) & (cells < _CELLS - 1), axis=1)

    def _follow(self, origin: FloatArray) -> None:
        """Shift the map so that the scanner stays within a quarter of its middle."""
        here = np.floor(origin / _SPACING).astype(np.int64)
        wanted = here - _CELLS // 2
        if self._corner is None:
            self._corner = wanted
        shift = wanted - self._corner
        if np.max(np.abs(shift)) <= _CELLS // 8:
            return
        moved = np.zeros_like(self.value)
        source = tuple(slice(max(s, 0), min(_CELLS + s, _CELLS)) for s in shift)
        target = tuple(slice(max(-s, 0), min(_CELLS - s, _CELLS)) for s in shift)
        if np.max(np.abs(shift)) < _CELLS:
            moved[target] = self.value[source]
        self.value, self._corner = moved, wanted
