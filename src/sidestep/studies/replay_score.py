"""Predicted against actual positions: how far off, how probable, and how a straight line at constant speed does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sidestep.planning.plan import PersonPlan, Plan
from sidestep.prediction.collision import RiskField
from sidestep.ros.predicted import mass_of
from sidestep.types import FloatArray

NEARBY = 0.5
"""m: "near where they were" in the scores."""
_LONGEST_GAP = 1.0  # s between two sightings, over which a position may be interpolated


class Track:
    """Where one person was seen.

    Args:
        rows: (M, 3) s, m, m.
    """

    def __init__(self, rows: FloatArray) -> None:
        _, first = np.unique(rows[:, 0], return_index=True)
        self.times = rows[first, 0]
        self.positions = rows[first, 1:]

    def at(self, times: FloatArray) -> FloatArray:
        """Return (K, 2) m at `times` (K,) s, NaN where the person was not seen around that time."""
        after = np.searchsorted(self.times, times, side="left").clip(1, max(len(self.times) - 1, 1))
        found = np.stack([np.interp(times, self.times, self.positions[:, axis]) for axis in (0, 1)], axis=1)
        if len(self.times) > 1:
            known = self.times[after] - self.times[after - 1] <= _LONGEST_GAP
        else:
            known = np.ones(len(times), dtype=np.bool_)
        outside = (times < self.times[0] - 1e-6) | (times > self.times[-1] + 1e-6)
        found[outside | ~known] = np.nan
        return found


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Forecast:
    """One prediction of one person, and what happened. N steps.

    Attributes:
        person: id; time: s.
        predicted: (N+1, 2) m, mean of the prediction.
        straight: (N+1, 2) m, at constant velocity.
        actual: (N+1, 2) m, NaN where not seen.
        nearby: (N,) predicted probability of being within 0.5 m of where the person then was; NaN where not seen.
    """

    person: str
    time: float
    predicted: FloatArray
    straight: FloatArray
    actual: FloatArray
    nearby: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Score:
    """Forecasts against what happened, by lead time. N steps.

    Attributes:
        lead: (N,) s ahead.
        count: (N,) predictions that could be compared.
        error: (N,) m, mean distance of the predicted mean from the actual position.
        straight: (N,) m, the same for constant velocity.
        nearby: (N,) mean predicted probability within 0.5 m of the actual position.
    """

    lead: FloatArray
    count: FloatArray
    error: FloatArray
    straight: FloatArray
    nearby: FloatArray


def forecasts_of(plan: Plan, tracks: Mapping[str, Track]) -> list[Forecast]:
    """Return what `plan` predicted of everybody whose next instant was still seen."""
    found: list[Forecast] = []
    for name, person in plan.people.items():
        if name not in tracks:
            continue
        times = plan.time + plan.time_step * np.arange(len(person.occupancy), dtype=np.float64)
        actual = tracks[name].at(times)
        if np.isfinite(actual[1]).all():
            found.append(_forecast(name, plan, person, times, actual))
    return found


def score(forecasts: Sequence[Forecast], time_step: float) -> Score:
    """Return the scores by lead time; NaN where nothing could be compared."""
    steps = max((len(f.actual) - 1 for f in forecasts), default=0)
    table = np.full((3, len(forecasts), steps), np.nan)
    for row, f in enumerate(forecasts):
        n = len(f.actual) - 1
        table[0, row, :n] = np.linalg.norm(f.predicted - f.actual, axis=1)[1:]
        table[1, row, :n] = np.linalg.norm(f.straight - f.actual, axis=1)[1:]
        table[2, row, :n] = f.nearby
    known = np.isfinite(table)
    count = known[0].sum(axis=0).astype(np.float64)
    with np.errstate(invalid="ignore"):
        means = np.where(known, table, 0.0).sum(axis=1) / np.where(count > 0, count, np.nan)
    return Score(
        lead=time_step * np.arange(1, steps + 1, dtype=np.float64),
        count=count,
        error=means[0],
        straight=means[1],
        nearby=means[2],
    )


def _forecast(name: str, plan: Plan, person: PersonPlan, times: FloatArray, actual: FloatArray) -> Forecast:
    cells = person.occupancy.lattice.positions().reshape(-1, 2)
    mass = person.occupancy.probability.reshape(len(times), -1)
    nearby = np.full(len(times) - 1, np.nan)
    seen = np.flatnonzero(np.isfinite(actual[1:]).all(axis=1)) + 1
    field = RiskField(people=[mass_of(person)], distances=np.array([NEARBY]), midway=False)
    nearby[seen - 1] = field.per_person(2 * seen, actual[seen])[0]
    return Forecast(
        person=name,
        time=plan.time,
        predicted=mass @ cells,
        straight=person.position + (times - plan.time)[:, None] * person.velocity,
        actual=actual,
        nearby=nearby,
    )
