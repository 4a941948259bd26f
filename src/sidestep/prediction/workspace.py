"""Arrays that predictions of one size share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from sidestep._kernels.sweep_choices import Choices, ValueScratch
from sidestep._kernels.sweep_near import NearScratch
from sidestep.human.cost import CostGrid, row_shape
from sidestep.human.policy import boxes, near_scratch, value_scratch, words_of
from sidestep.types import FloatArray, IntArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Results:
    """What hypotheses add to: flat blocks of mass (or size 0) and contact (N,)."""

    blocks: FloatArray
    contact: FloatArray


class Workspace:
    """Scratch arrays that `predict` may reuse from call to call (one per thread); results never live in it."""

    def __init__(self) -> None:
        self._kept: dict[str, tuple[object, Any]] = {}

    def values(self, grid: CostGrid) -> ValueScratch:
        """Return arrays for sweeps on `grid`."""
        return self._keep("values", (grid.shape, grid.dimension, grid.dtype), lambda: value_scratch(grid))

    def near(self, grid: CostGrid, horizon: int, words: int) -> NearScratch:
        """Return arrays for sweeps on `grid` where the robot makes a difference."""
        key = (grid.shape, grid.dtype, horizon, words)
        return self._keep("near", key, lambda: near_scratch(grid, self.values(grid), horizon, words))

    def choices(self, radii: list[int], dimension: int, words: int, layers: int) -> Choices:
        """Return choices for boxes of these radii."""
        key = (radii, dimension, words, layers)
        return self._keep("choices", key, lambda: boxes(radii, dimension, words, layers * words))

    def constants(self, reach: int, horizon: int, dimension: int) -> Constants:
        """Return what depends on sizes alone."""
        return self._keep("constants", (reach, horizon, dimension), lambda: _constants(reach, horizon, dimension))

    def _keep(self, name: str, key: object, make: Callable[[], Any]) -> Any:
        if name not in self._kept or self._kept[name][0] != key:
            self._kept[name] = (key, make())
        return self._kept[name][1]


@dataclass(frozen=True, slots=True, kw_only=True)
class Constants:
    """What depends on sizes alone: scratch (see `propagate`; contact shares; nobody reads `nowhere`) and constants.

    The mass at half instants 0..2N makes up blocks, flat, of `radii` cells from the anchor; they begin at `offsets`,
    or at `step_offsets` where those of mid-steps are empty.
    """

    field: FloatArray
    scratch: FloatArray
    line: FloatArray
    lost: IntArray
    nowhere: Results
    shares: FloatArray
    offsets: IntArray
    step_offsets: IntArray
    radii: IntArray
    nobody: Choices


def _constants(reach: int, horizon: int, dimension: int) -> Constants:
    rows, columns = row_shape(2 * reach * horizon + 1, dimension)
    few, wide = 2 * reach * (horizon - 1) + 1, 2 * reach * (2 * horizon - 1) + 1
    room = max(rows * columns, few ** min(dimension - 1, 1) * wide ** max(dimension - 1, 1))
    radii = [reach * (b if b % 2 else b // 2) for b in range(2 * horizon + 1)]
    sizes = [(2 * r + 1) ** dimension for r in radii]
    return Constants(
        field=np.zeros((4 * rows, columns)),
        scratch=np.zeros((2, room)),
        line=np.zeros(columns + 4 * reach),
        lost=np.zeros(6, np.int64),
        nowhere=Results(blocks=np.zeros(0), contact=np.zeros(1)),
        shares=np.empty(sum((2 * reach * k + 1) ** dimension for k in range(1, horizon + 1))),
        offsets=np.cumsum(np.array([0, *sizes]), dtype=np.int64),
        step_offsets=np.cumsum(np.array([0, *(0 if b % 2 else size for b, size in enumerate(sizes))]), dtype=np.int64),
        radii=np.array(radii, dtype=np.int64),
        nobody=boxes([0] * horizon, dimension, words_of(reach, dimension), 0),
    )
