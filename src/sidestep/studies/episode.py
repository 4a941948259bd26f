"""One episode: a scenario, a navigator, and what came of it, in the names of Francis et al. (2023)."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from sidestep.simulation.approach import STANDING, closest_within_steps
from sidestep.simulation.assembly import obstacles_of
from sidestep.simulation.crowd_people import crowd_kinds
from sidestep.simulation.loop import simulate
from sidestep.simulation.metrics import measure
from sidestep.simulation.record import Record
from sidestep.simulation.recordings import Recording
from sidestep.simulation.scenario import Scenario
from sidestep.studies.opponents import Contestant
from sidestep.types import FloatArray

INTIMATE, PERSONAL = 0.45, 1.2  # m between bodies (Hall, 1966)
IDENTIFIED = 0.8  # probability of what is true, from which on somebody counts as identified
NEAR = 6.0  # m, within which the belief about somebody is scored
BINS_PER_DECADE, DECADES = 40, (-3, 5)
"""Histogram of planning times: powers of ten of ms."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """One episode in numbers; NaN where there is no such thing.

    Attributes:
        success: the goal was reached in time, without contact while the robot moved.
        collision_moving: bodies touched, and the robot had a part in it; collision_standing: somebody walked into the
            standing robot.
        timeout: the goal was not reached in time.
        time_to_goal: s; path_length: m; spl: success weighted by path length.
        shortest_time: s, straight at full speed; to be compared with.
        min_distance: m between centres, between the samples too.
        time_intimate, time_personal: s with somebody within 0.45 m, 1.2 m between bodies.
        speed: m/s; acceleration: m/s²; jerk: m/s³; means over the trip.
        below_clearance: share of the steps with somebody within the clearance.
        predicted_violations, realised_violations: expected and real planning steps with somebody within the clearance
            one time step later.
        belief_accuracy: share of (step, person) at which the belief was on the true side; belief_brier: its squared
            error; time_to_identify: s until the belief in what is true first passed 0.8, mean over people.
        certified: share of the steps under a certified plan.
    """

    success: float
    collision_moving: float
    collision_standing: float
    timeout: float
    time_to_goal: float
    path_length: float
    spl: float
    shortest_time: float
    min_distance: float
    time_intimate: float
    time_personal: float
    speed: float
    acceleration: float
    jerk: float
    below_clearance: float
    predicted_violations: float
    realised_violations: float
    belief_accuracy: float
    belief_brier: float
    time_to_identify: float
    certified: float

    def row(self) -> list[float]:
        """Return the values in the order of `columns`."""
        return list(asdict(self).values())


def columns() -> tuple[str, ...]:
    """Return the names of the numbers of an outcome."""
    return tuple(f.name for f in fields(Outcome))


def run_episode(
    scenario: Scenario, contestant: Contestant, recording: Recording | None = None
) -> tuple[Outcome, FloatArray]:
    """Return the outcome and the planning times (K,) ms of one episode."""
    obstacles = obstacles_of(scenario)
    record = simulate(
        scenario,
        navigator=contestant.build(scenario, obstacles),
        recording=recording,
        obstacles=obstacles,
        kinds=crowd_kinds(),
        snapshots=0,
    )
    return outcome_of(record), 1e3 * record.planning_time[record.plan_age <= 1e-9]


def outcome_of(record: Record) -> Outcome:
    """Return the numbers of a run."""
    m = measure(record)
    gaps = closest_within_steps(record.robot_positions, record.people_positions)  # (T, P) m
    between = gaps - record.robot_radius - record.people_radii
    robot: dict[str, Any] = dict(record.settings.get("robot", {}))
    straight = float(np.linalg.norm(record.robot_goal - record.robot_positions[0]))
    shortest = max(straight - float(robot.get("goal_tolerance", 0.0)), 1e-9)
    reached = m.reached_goal
    success = reached and m.contacts_moving == 0
    velocity = record.robot_velocities
    accuracy, brier, identified = _belief(record)
    return Outcome(
        success=float(success),
        collision_moving=float(m.contacts_moving > 0),
        collision_standing=float(m.contacts_standing > 0),
        timeout=float(not reached),
        time_to_goal=m.time_to_goal,
        path_length=m.path_length,
        spl=float(success) * shortest / max(m.path_length, shortest),
        shortest_time=shortest / float(robot.get("max_speed", 1.0)),
        min_distance=m.min_distance,
        time_intimate=_time_within(between, INTIMATE, record.control_step),
        time_personal=_time_within(between, PERSONAL, record.control_step),
        speed=_mean_norm(velocity),
        acceleration=_mean_norm(np.diff(velocity, axis=0) / record.control_step),
        jerk=_mean_norm(np.diff(velocity, n=2, axis=0) / record.control_step**2),
        below_clearance=m.clearance_violations / max(m.steps, 1),
        predicted_violations=m.predicted_violations,
        realised_violations=float(m.realised_violations),
        belief_accuracy=accuracy,
        belief_brier=brier,
        time_to_identify=identified,
        certified=m.status_counts.get("certified", 0) / max(m.steps, 1),
    )


def moving_share(record: Record) -> float:
    """Return the share of the steps during which the robot moved."""
    return float((np.linalg.norm(record.robot_velocities, axis=1) > STANDING).mean())


def histogram(times: FloatArray) -> FloatArray:
    """Return how many of `times` (ms) fall into each logarithmic bin; the outer bins hold what lies beyond."""
    low, high = DECADES
    count = (high - low) * BINS_PER_DECADE
    index = np.floor((np.log10(np.maximum(times, 10.0**low)) - low) * BINS_PER_DECADE).astype(np.int64)
    return np.bincount(np.clip(index, 0, count - 1), minlength=count).astype(np.float64)


def quantile(counts: FloatArray, share: float) -> float:
    """Return the ms below which `share` of a histogram lies (upper edge of the bin); NaN when it is empty."""
    total = counts.sum()
    if total == 0:
        return math.nan
    bin_ = int(np.searchsorted(np.cumsum(counts), share * total))
    return float(10.0 ** (DECADES[0] + (min(bin_, len(counts) - 1) + 1) / BINS_PER_DECADE))


def _belief(record: Record) -> tuple[float, float, float]:
    truth = record.people_awareness[: len(record.status)]
    believed = record.beliefs
    away = np.linalg.norm(record.people_positions[:-1] - record.robot_positions[:-1, None], axis=-1)
    known = np.isfinite(believed) & np.isfinite(truth)
    scored = known & (away <= NEAR)
    if not scored.any():
        return math.nan, math.nan, math.nan
    of_truth = np.where(truth > 0.5, believed, 1.0 - believed)
    times: list[float] = []
    for person in np.flatnonzero(scored.any(axis=0)):
        sure = np.flatnonzero(scored[:, person] & (of_truth[:, person] >= IDENTIFIED))
        first = np.flatnonzero(scored[:, person])[0]
        times.append((sure[0] - first) * record.control_step if len(sure) else math.nan)
    identified = float(np.nanmean(times)) if np.isfinite(times).any() else math.nan
    return float((of_truth[scored] > 0.5).mean()), float(((1.0 - of_truth[scored]) ** 2).mean()), identified


def _time_within(between: FloatArray, distance: float, step: float) -> float:
    return float((between < distance).any(axis=1).sum() * step) if between.shape[1] else 0.0


def _mean_norm(values: FloatArray) -> float:
    return float(np.linalg.norm(values, axis=1).mean()) if len(values) else math.nan
