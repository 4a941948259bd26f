"""The predicted occupancy as a picture: for every place, how probable it is that somebody's body covers it."""

from __future__ import annotations

import numpy as np

from sidestep.planning.plan import Plan
from sidestep.prediction.collision import PersonMass, RiskField
from sidestep.types import FloatArray, Vector


def occupancy_raster(plan: Plan, corner: Vector, resolution: float, cells: int, *, radius: float) -> FloatArray:
    """Return the largest probability over the planned instants that somebody's body covers a cell's middle.

    Args:
        plan: with people.
        corner: (2,) m, outer corner of cell [0, 0].
        resolution: m per cell.
        cells: per axis.
        radius: m, of a person's body.

    Returns:
        (rows, columns), rows along y.
    """
    found = np.zeros((cells, cells))
    people = [PersonMass.of(lattice=p.occupancy.lattice, steps=p.occupancy.probability) for p in plan.people.values()]
    if not people:
        return found
    field = RiskField(people=people, distances=np.full(len(people), radius), midway=False)
    half = cells // 2 + 1
    middle = corner + resolution * (half + 0.5)
    for step in range(len(plan.positions)):
        seen = field.raster(2 * step, middle, resolution, half)
        np.maximum(found, seen[:cells, :cells], out=found)
    return found.T
