"""The set U_H of velocities that a person may choose from (Eq. 2d)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np

from sidestep.checks import MOST_REACH, Checks
from sidestep.types import FloatArray, IntArray


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionSet:
    """{m·v : m in −reach..reach} per axis; the paper's U_H is reach = 2.

    Attributes:
        speed: m/s, v, the step between neighbouring actions (> 0).
        reach: largest multiple of v per axis (1 to 10).
        dimension: number of axes d (1, 2 or 3).
    """

    speed: float
    reach: int = 2
    dimension: int = 2

    def __post_init__(self) -> None:
        check = Checks(self, "actions")
        check.numbers("speed", above=0.0, unit="m/s")
        check.integers("reach", least=1, most=MOST_REACH)
        if self.dimension not in (1, 2, 3):
            raise check.wrong("dimension", "1, 2 or 3")

    def __len__(self) -> int:
        return (2 * self.reach + 1) ** self.dimension

    @property
    def multiples(self) -> IntArray:
        """(n, d) integer multiples of v, the last axis fastest: action a moves the person by multiples[a] cells."""
        return _multiples(self.reach, self.dimension)

    @property
    def velocities(self) -> FloatArray:
        """(n, d) m/s, in the lattice's own frame."""
        return self.multiples.astype(np.float64) * self.speed


@lru_cache(maxsize=16)
def _multiples(reach: int, dimension: int) -> IntArray:
    numbers = np.array(list(product(range(-reach, reach + 1), repeat=dimension)), dtype=np.int64)
    numbers.setflags(write=False)
    return numbers
