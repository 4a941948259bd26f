"""Named array shapes.

Every array of the public interface is `float64`, in SI units (m, s, m/s, rad), and read-only once it sits in a result.
Letters in shapes: d dimensions (1, 2 or 3), N horizon in steps, T recorded steps, P people, n actions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
"""Any shape; the comment beside each use says which."""
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]

Vector = NDArray[np.float64]
"""(d,) one point or velocity."""
Path = NDArray[np.float64]
"""(K+1, d) positions at consecutive instants."""
VectorLike = Sequence[float] | NDArray[np.float64]
"""What callers may pass where a `Vector` is stored."""

Frame = Literal["world", "heading"]
GoalCost = Literal["squared", "distance"]
DangerDecay = Literal["distance", "squared_distance"]
Evidence = Literal["action", "clearance"]
AwarenessOverHorizon = Literal["persistent", "resampled"]
RiskRule = Literal["cells", "mass", "trajectory"]
Shape = Literal["box", "disc"]
Status = Literal["certified", "least_risk", "stopped"]


def frozen_array(values: VectorLike | FloatArray | Sequence[VectorLike]) -> FloatArray:
    """Return a read-only, contiguous float64 copy of `values` (shape kept); what is masked is NaN."""
    if isinstance(values, np.ndarray) and type(values) is not np.ndarray:  # else `np.ma` is not worth importing
        values = np.ma.filled(values.astype(np.float64), np.nan)
    array = np.array(values, dtype=np.float64, order="C")
    array.setflags(write=False)
    return array


def settled(values: VectorLike | FloatArray) -> FloatArray:
    """Return `values` as `frozen_array` does, without a copy where nobody can change them any more."""
    if type(values) is np.ndarray:
        flags = values.flags
        if not flags.writeable and flags.c_contiguous and values.base is None and values.dtype == np.float64:
            return values
    return frozen_array(values)


def finite(values: FloatArray) -> bool:
    """Return whether all of a few numbers (n,) are finite; for a few, sooner than an array operation does."""
    return all(map(math.isfinite, values.tolist()))


INSTANT = 1e-6
"""s, within which two times are the same, and two measurements one."""
LARGEST = 1e9
"""No coordinate (m), velocity (m/s) or setting is larger: differences would be lost, squares overflow."""


def plausible(values: Vector) -> bool:
    """Return whether (d,) m or m/s can be a place or a velocity: finite, and within `LARGEST`."""
    return all(-LARGEST <= x <= LARGEST for x in values.tolist())


def sealed(array: FloatArray) -> FloatArray:
    """Make an array that nobody else holds read-only, and return it."""
    array.setflags(write=False)
    return array


def all_sealed(fields: dict[str, Any]) -> dict[str, Any]:
    """Make every array among the fields of a value read-only again, which a copy or a pickle has forgotten."""
    for value in fields.values():
        if isinstance(value, np.ndarray):
            value.setflags(write=False)
    return fields
