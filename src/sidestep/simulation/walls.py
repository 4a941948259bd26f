"""The nearest wall, for navigators and people that steer by it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sidestep.types import FloatArray


class WallEdges:
    """The edges of closed polygons, each (V, 2) m."""

    def __init__(self, walls: Sequence[FloatArray]) -> None:
        starts = [np.asarray(w, dtype=np.float64) for w in walls]
        self.starts = np.concatenate(starts) if starts else np.zeros((0, 2))  # (E, 2) m
        ends = [np.roll(s, -1, axis=0) for s in starts]
        self.ends = np.concatenate(ends) if ends else np.zeros((0, 2))  # (E, 2) m

    def __len__(self) -> int:
        return len(self.starts)

    def nearest(self, points: FloatArray) -> FloatArray:
        """Return (…, 2) m, the nearest place on any wall to each of `points` (…, 2); infinitely far without walls."""
        if not len(self.starts):
            return np.full_like(points, np.inf)
        along = self.ends - self.starts
        offset = points[..., None, :] - self.starts  # (…, E, 2)
        share = np.clip((offset * along).sum(axis=-1) / np.maximum((along**2).sum(axis=-1), 1e-12), 0.0, 1.0)
        feet = self.starts + share[..., None] * along
        square = ((points[..., None, :] - feet) ** 2).sum(axis=-1)
        best = square.argmin(axis=-1)
        return np.take_along_axis(feet, best[..., None, None], axis=-2)[..., 0, :]

    def distance(self, points: FloatArray) -> FloatArray:
        """Return (…,) m to the nearest edge; infinite without walls."""
        if not len(self.starts):
            return np.full(points.shape[:-1], np.inf)
        return np.linalg.norm(points - self.nearest(points), axis=-1)
