"""P(nearer than a radius | distance to the cell) of people whose position is spread around it, tabulated.

A profile is (samples, grids), see `_kernels.risk_profile.profile_value`: one line of samples for each instant.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from sidestep._kernels.risk_profile import blob_table, class_profiles, mixed_profiles
from sidestep.types import FloatArray

Profile = tuple[FloatArray, FloatArray]
KEPT = 256
"""Largest number of σ whose tables are kept: N = 20. Beyond, they are a hundredth of a step, and megabytes."""
GRAIN = 5
"""Decimals of a metre to which σ counts in tables that are kept: a filter that settles never does to the last digit."""


def profile_of(radius: float, weights: FloatArray, sigmas: FloatArray, dimension: int) -> Profile:
    """Tabulate the mixture of one person.

    Args:
        radius: m, nearer than which counts.
        weights: (C,) of the spread classes.
        sigmas: (B, C) m, at B instants.
        dimension: of space.
    """
    if sigmas.size > KEPT:
        samples, grids = class_profiles(radius, sigmas, blob_table(dimension))
    else:
        samples, grids = _known(radius, np.round(sigmas, GRAIN).tobytes(), weights.size, dimension)
    return mixed_profiles(weights, samples), grids


@lru_cache(maxsize=32)  # seconds after first being seen, walking or standing: σ depends on little else
def _known(radius: float, sigmas: bytes, classes: int, dimension: int) -> Profile:
    """Each class by itself (C, B, ·): σ at an instant rarely changes, only the weights are learned."""
    apart = np.frombuffer(sigmas).reshape(-1, classes).copy()
    return class_profiles(radius, apart, blob_table(dimension))
