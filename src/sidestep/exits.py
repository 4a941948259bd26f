"""The ways out of a map: gaps in its outer boundary, where people may be heading who do not say where they go.

    walls = Obstacles(polygons=[…])                # a corridor, open at both ends
    exits(walls, radius=0.3)                       # ((-10.0, 0.0), (10.0, 0.0)): a metre outside each end

The boundary is the smallest box around all walls (in the map's own axes, where there is a map). An exit is a stretch
of it that a person can walk straight through, from a metre inside to a metre outside. Where unknown cells of a map
count as walls, a door that nobody has looked through is none.
"""

from __future__ import annotations

import math

import numpy as np

from sidestep.obstacles import Obstacles, OccupancyGrid
from sidestep.types import BoolArray, FloatArray

DEPTH = 1.0
"""m, how far inside a person must be able to begin, and how far outside the exit lies: who leaves goes on."""
WIDEST = 4.0
"""m; a wider gap is several exits, side by side."""
_STEP = 0.05  # m, between the places of the boundary that are tried


def exits(obstacles: Obstacles, radius: float) -> tuple[tuple[float, float], ...]:
    """Return the exits, each (x, y) m, one metre outside the middle of its gap; () where the boundary has no gap.

    Args:
        obstacles: the map.
        radius: m, of a person, who has to fit through.
    """
    yaw = 0.0 if obstacles.grid is None else obstacles.grid.yaw
    axes = np.array([[math.cos(yaw), math.sin(yaw)], [-math.sin(yaw), math.cos(yaw)]])  # rows: the map's x and y
    corners = _corners(obstacles) @ axes.T
    if len(corners) == 0:
        return ()
    low, high = corners.min(axis=0), corners.max(axis=0)
    found: list[FloatArray] = []
    for axis in (0, 1):
        for face, outward in ((low, -1.0), (high, 1.0)):
            side = low[1 - axis], high[1 - axis]
            along = np.linspace(*side, 1 + max(round((side[1] - side[0]) / _STEP), 1))
            places = np.empty((len(along), 2))
            places[:, axis], places[:, 1 - axis] = face[axis], along
            out = outward * DEPTH * np.eye(2)[axis]
            through = obstacles.segment_free((places - out) @ axes, (places + out) @ axes, margin=radius)
            found += [(place + out) @ axes for gap in _runs(through) for place in _middles(places[gap])]
    return tuple((float(x), float(y)) for x, y in np.round(found, 3) + 0.0)


def _corners(obstacles: Obstacles) -> FloatArray:
    """(K, 2) m, points whose box holds all walls."""
    parts = [*obstacles.polygons, *([] if obstacles.grid is None else [_cell_corners(obstacles.grid)])]
    return np.concatenate(parts) if parts else np.zeros((0, 2))


def _cell_corners(grid: OccupancyGrid) -> FloatArray:
    """(4, 2) m, corners of the smallest box of cells that holds every occupied one; (0, 2) where none is."""
    i, j = np.nonzero(grid.occupied)
    if i.size == 0:
        return np.zeros((0, 2))
    return grid.placed([(x, y) for x in (i.min(), i.max() + 1) for y in (j.min(), j.max() + 1)])


def _runs(through: BoolArray) -> list[slice]:
    """Stretches of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], through.astype(np.int8), [0]])))
    return [slice(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def _middles(gap: FloatArray) -> FloatArray:
    """(n, 2) m, middles of the parts of a gap ((K, 2) m, in order), none of them wider than `WIDEST`."""
    width = float(np.linalg.norm(gap[-1] - gap[0]))
    parts = max(math.ceil(width / WIDEST), 1)
    shares = ((np.arange(parts) + 0.5) / parts)[:, None]
    return gap[0] + shares * (gap[-1] - gap[0])
