"""What stands in a simulated room: walls and furniture, as polygons and upright cylinders."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sidestep.types import FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scene:
    """Things that do not move, at the height of the scanner.

    Attributes:
        polygons: closed outlines, each (V, 2) m; the last corner joins the first.
        cylinders: (K, 3) x, y, radius in m.
    """

    polygons: tuple[FloatArray, ...] = ()
    cylinders: FloatArray

    def segments(self) -> FloatArray:
        """Return the (S, 4) m sides of all polygons."""
        sides = [np.concatenate((p, np.roll(p, -1, axis=0)), axis=1) for p in self.polygons]
        return np.concatenate(sides) if sides else np.zeros((0, 4))

    def discs(self) -> FloatArray:
        """Return the cylinders as (K, 5) discs at rest: x, y, radius, 0, 0."""
        return np.pad(self.cylinders.reshape(-1, 3), ((0, 0), (0, 2)))


def rectangle(centre: tuple[float, float], size: tuple[float, float], angle: float = 0.0) -> FloatArray:
    """Return the (4, 2) m corners of a rectangle, counter-clockwise, turned by `angle` (rad)."""
    half = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * np.asarray(size) / 2
    c, s = np.cos(angle), np.sin(angle)
    return half @ np.array([[c, s], [-s, c]]) + np.asarray(centre)
