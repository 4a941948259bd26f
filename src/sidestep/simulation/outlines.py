"""The walls of a run as polygons, for records and figures: a map becomes a few rectangles."""

from __future__ import annotations

import math

import numpy as np

from sidestep.obstacles import Obstacles, OccupancyGrid
from sidestep.types import FloatArray


def outlines(obstacles: Obstacles | None) -> tuple[FloatArray, ...]:
    """Return closed polygons (V, 2) m that cover the walls exactly."""
    if obstacles is None:
        return ()
    boxes = () if obstacles.grid is None else rectangles(obstacles.grid)
    return (*obstacles.polygons, *boxes)


def rectangles(grid: OccupancyGrid) -> tuple[FloatArray, ...]:
    """Return rectangles, each (4, 2) m, that together cover the occupied cells of a map and nothing else.

    Runs of occupied cells along y that are the same in neighbouring columns are joined.
    """
    turn = np.array([[math.cos(grid.yaw), -math.sin(grid.yaw)], [math.sin(grid.yaw), math.cos(grid.yaw)]])
    boxes: list[FloatArray] = []
    open_runs: dict[tuple[int, int], int] = {}  # (first, last + 1) along y → first column
    for column in range(len(grid.occupied) + 1):
        runs = _runs(grid, column)
        for run in [run for run in open_runs if run not in runs]:
            first = open_runs.pop(run)
            corners = [(first, run[0]), (column, run[0]), (column, run[1]), (first, run[1])]
            boxes.append(grid.resolution * np.array(corners, dtype=np.float64) @ turn.T + np.asarray(grid.origin))
        for run in runs:
            open_runs.setdefault(run, column)
    return tuple(boxes)


def _runs(grid: OccupancyGrid, column: int) -> set[tuple[int, int]]:
    if column == len(grid.occupied):
        return set()
    edges = np.flatnonzero(np.diff(np.concatenate(([0], grid.occupied[column].astype(np.int8), [0]))))
    return {(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)}
