"""Where a person will be (Eqs. 4, 6, 7)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from sidestep.lattice import Lattice
from sidestep.types import FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Occupancy:
    """Probability over cells at k = 0..N.

    Attributes:
        lattice: the cells; radius reach·N.
        probability: (N+1, cells…), each instant sums to 1.
        time_step: s, between the instants.
    """

    lattice: Lattice
    probability: FloatArray
    time_step: float

    @property
    def shape(self) -> tuple[int, ...]:
        """(N+1, cells…)."""
        return self.probability.shape

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> FloatArray:
        return np.array(self.probability, dtype=dtype) if copy or dtype else self.probability

    def __getitem__(self, key: Any) -> Any:
        return self.probability[key]

    def __len__(self) -> int:
        return len(self.probability)
