"""A record as one JSON object, and as the table that ends a run."""

from __future__ import annotations

from typing import Any

import numpy as np

from sidestep.simulation.metrics import Metrics, measure
from sidestep.simulation.record import Record


def summary(record: Record, metrics: Metrics | None = None) -> dict[str, Any]:
    """Return the numbers and series of a run.

    `human_positions` and `belief` are series where there is one person, and objects from id to series where there are
    several; `people` has the same form for any number.
    """
    m = metrics or measure(record)
    people = {
        name: {
            "positions": record.people_positions[:, i],
            "belief": record.beliefs[:, i],
            "concerned": record.people_awareness[:, i],
            "goal": record.people_goals[i],
        }
        for i, name in enumerate(record.people)
    }
    only = next(iter(people.values())) if len(people) == 1 else None
    numbers = m.as_dict()
    plan_ms = {"median": m.plan_median, "p95": m.plan_p95, "max": m.plan_max}
    for name in ("plan_median", "plan_p95", "plan_max"):
        del numbers[name]
    return {
        "scenario": record.scenario,
        "seed": record.seed,
        **numbers,
        "plan_ms": plan_ms,
        "risk_limit": record.risk_limit,
        "clearance": record.clearance,
        "time": record.time,
        "robot_positions": record.robot_positions,
        "human_positions": only["positions"] if only else {name: p["positions"] for name, p in people.items()},
        "belief": only["belief"] if only else {name: p["belief"] for name, p in people.items()},
        "collision_probability": np.fmax.reduce(record.collision_probability, axis=1, initial=0.0),
        "status": record.status,
        "people": people,
    }


def rows(record: Record, m: Metrics) -> list[tuple[str, str]]:
    """Return the lines of the table that ends a run."""
    reached = f"after {m.time_to_goal:.1f} s" if m.reached_goal else f"not reached in {m.duration:.1f} s"
    status = ", ".join(f"{name.replace('_', ' ')} {count}" for name, count in m.status_counts.items() if count)
    lines = [
        ("goal", reached),
        ("minimum distance", f"{_number(m.min_distance, 2)} m (clearance {record.clearance:.2f} m)"),
        ("clearance violations", f"{m.clearance_violations} of {m.steps} steps"),
        ("contacts", f"{m.contacts_moving} while moving, {m.contacts_standing} while standing"),
        *_other_robots(record, m),
        ("collision probability", f"largest {_number(m.max_collision_probability, 4)}, {_expected(m)}"),
        ("status", status),
        ("path", f"{m.path_length:.2f} m, turning {m.turning:.2f} rad"),
        ("PI_R, PI_H, PI_T", f"{m.PI_R:.1f}, {m.PI_H:.1f}, {m.PI_T:.1f} m²"),
        ("planning", f"median {m.plan_median:.2f} ms, p95 {m.plan_p95:.2f} ms, largest {m.plan_max:.1f} ms"),
    ]
    seen = np.flatnonzero(np.isfinite(record.beliefs).any(axis=0))
    if 0 < len(seen) <= 6:
        last = ", ".join(f"{record.people[i]} {_last(record.beliefs[:, i]):.3f}" for i in seen)
        lines.insert(1, ("P(concerned), at last", last))
    elif len(seen):
        lines.insert(1, ("people seen", str(len(seen))))
    return lines


def _other_robots(record: Record, m: Metrics) -> list[tuple[str, str]]:
    if not record.other_robots.size:
        return []
    return [("other robots", f"{m.robot_contacts} contacts, minimum distance {m.robot_min_distance:.2f} m")]


def _expected(m: Metrics) -> str:
    return f"{m.realised_violations} violations one step ahead where {m.predicted_violations:.2f} were predicted"


def _last(series: Any) -> float:
    known = series[np.isfinite(series)]
    return float(known[-1])


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if np.isfinite(value) else "–"
