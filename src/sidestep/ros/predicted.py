"""The predicted occupancy as a picture: for every place, how probable it is that somebody's body covers it."""

from __future__ import annotations

import numpy as np

from sidestep.planning.plan import PersonPlan, Plan
from sidestep.prediction.collision import PersonMass, RiskField
from sidestep.types import FloatArray, Vector

_NOTHING = 0.002
_DOUBT = 1.3  # the planner's rough maps are off by a seventh at most where habits spread the prediction


def occupancy_raster(plan: Plan, corner: Vector, resolution: float, cells: int, *, radius: float) -> FloatArray:
    """Return the largest probability over the planned instants that somebody's body covers a cell's middle.

    Less than 1 % may be left out.

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
    if not plan.people:
        return found
    people = [mass_of(person) for person in plan.people.values()]
    field = RiskField(people=people, distances=np.full(len(people), radius), midway=False)
    half = cells // 2 + 1
    middle = corner + resolution * (half + 0.5)
    for step in range(plan.horizon_used + 1):
        rough = field.raster(2 * step, middle, resolution, half, limit=plan.risk_limit)[:cells, :cells]
        higher = np.argwhere((rough > _NOTHING) & (_DOUBT * rough > found))  # only where it may raise the picture
        if len(higher):
            exact = field.at(2 * step, corner + resolution * (higher + 0.5))
            found[tuple(higher.T)] = np.maximum(found[tuple(higher.T)], exact)
    return found.T


def mass_of(person: PersonPlan) -> PersonMass:
    """Return where one person may be at the steps, spread included; the half instants between them are left out."""
    if person.spread is None:
        return PersonMass.of(lattice=person.occupancy.lattice, steps=person.occupancy.probability)
    weights, sigmas = person.spread
    halves = np.repeat(sigmas, 2, axis=0)[:-1]
    return PersonMass.of(
        lattice=person.occupancy.lattice, steps=person.occupancy.probability, weights=weights, sigmas=halves
    )
