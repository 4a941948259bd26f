"""What a record as a whole tells: its charts, its paths, what came of it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sidestep.simulation.metrics import measure
from sidestep.simulation.record import Record
from sidestep.types import FloatArray
from sidestep.viewer.live.wire import numbers

MOST_POINTS = 2000  # of a path


def flat(positions: FloatArray) -> FloatArray:
    """(…, d) → (…, 2): a line lies along x, height is dropped."""
    if positions.shape[-1] == 1:
        return np.concatenate([positions, np.zeros_like(positions)], axis=-1)
    return positions[..., :2]


def samples(record: Record) -> list[dict[str, Any]]:
    """Return what the charts show, one sample per planning step."""
    r = record
    gaps = np.linalg.norm(r.people_positions - r.robot_positions[:, np.newaxis], axis=2)  # (T+1, P) m
    nearest = np.where(np.isfinite(gaps), gaps, np.inf).min(axis=1, initial=np.inf)
    risk, result = r.limited_risk, list[dict[str, Any]]()
    for i in np.flatnonzero(r.plan_age <= 1e-9):
        beliefs = r.beliefs[i][np.isfinite(r.beliefs[i])]
        result.append(
            {
                "time": round(float(r.time[i] - r.time[0]), 3),
                "belief": round(float(beliefs[0]), 4) if beliefs.size else None,
                "risk": _finite(float(risk[i])),
                "distance": _finite(float(nearest[i])),
                "ms": round(1000 * float(r.planning_time[i]), 2),
            }
        )
    return result


def paths(record: Record) -> dict[str, Any]:
    """Return where everybody was: (time, x, y) of the robot and of each person."""
    chosen = np.unique(np.linspace(0, len(record.time) - 1, min(len(record.time), MOST_POINTS)).astype(int))
    time = (record.time - record.time[0])[chosen, np.newaxis]
    robot = np.concatenate([time, flat(record.robot_positions)[chosen]], axis=1)
    people = flat(record.people_positions)[chosen]
    return {
        "robot": numbers(robot),
        "people": [numbers(np.concatenate([time, people[:, p]], axis=1)) for p in range(people.shape[1])],
    }


def outcome(record: Record) -> list[tuple[str, str]]:
    """Return what came of the run, in a few named numbers."""
    if not record.status:
        return []
    m = measure(record)
    arrived = f"after {m.time_to_goal:.1f} s" if m.reached_goal else "not reached"
    rows = [("Goal", arrived)]
    if math.isfinite(m.min_distance):
        rows.append(("Distance to keep", f"{record.clearance:.2f} m"))
        rows.append(("Closest to anybody", f"{m.min_distance:.2f} m"))
        rows.append(("Contacts, robot moving", str(m.contacts_moving)))
        rows.append(("Contacts, robot standing", str(m.contacts_standing)))
    if math.isfinite(m.max_collision_probability):
        rows.append(("Largest planned risk of contact", f"{100 * m.max_collision_probability:.2f} %"))
    rows.append(("Way of the robot", f"{m.path_length:.1f} m"))
    rows.append(("Planning time, median", f"{m.plan_median:.1f} ms"))
    names = {"certified": "Plans within the limit", "least_risk": "Plans of least risk", "stopped": "Stops"}
    for name, count in m.status_counts.items():
        if count:
            rows.append((names.get(name, name), f"{100 * count / max(m.steps, 1):.0f} %"))
    return rows


def _finite(value: float) -> float | None:
    return round(value, 5) if math.isfinite(value) else None
