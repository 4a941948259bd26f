"""Numbers from a `Record` alone."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from sidestep.simulation.approach import among_robots, closest_within_steps, contacts, lengths
from sidestep.simulation.record import Record
from sidestep.types import FloatArray

_TURN = 1e-4  # m, displacements shorter than this have no direction


@dataclass(frozen=True, slots=True, kw_only=True)
class Metrics:
    """One run in numbers. A value that cannot be had (no people, goal not reached) is NaN.

    Attributes:
        steps: control steps; duration: s.
        finished: the goal was reached or the time was up; False for an interrupted run.
        reached_goal, time_to_goal: whether, and when first (s, at a recorded instant).
        min_distance: m, between centres, between the samples too; sampled_min_distance: m, at the samples.
        clearance_violations: control steps during which someone came closer than the clearance.
        contacts_moving: contacts (bodies overlap) that began while the robot moved, or in which it moved on toward the
            person; contacts_standing: the others, where a person walked into a parked robot.
        robot_contacts: contacts with other robots; robot_min_distance: m, between the centres.
        max_collision_probability: largest P_coll(k|t) of any plan.
        predicted_violations: sum over the planning steps of the risk that the plan saw in its first step;
            realised_violations: planning steps after which someone was within the clearance one time step later (where
            the record holds that instant). For rule "mass" the first is meant to bound the second on average.
        PI_R, PI_H: Σ_t ‖x(t) − g‖² of the robot, and of the people with a goal together, as printed in Section IV-B,
            at instants one planner time step apart; PI_T: their sum.
        PI_R_lateral, PI_H_lateral, PI_T_lateral: the same with the absolute distance (m) from the straight line from
            start to goal, as in the authors' recorded series.
        path_length: m, the robot's; human_path_length: m, of all people together.
        turning: rad, sum of the absolute changes of direction of the robot; human_turning: of all people together.
        status_counts: control steps under each status.
        plan_median, plan_p95, plan_max: ms of wall clock per planning step.
    """

    steps: int
    duration: float
    finished: bool
    reached_goal: bool
    time_to_goal: float
    min_distance: float
    sampled_min_distance: float
    clearance_violations: int
    contacts_moving: int
    contacts_standing: int
    robot_contacts: int
    robot_min_distance: float
    max_collision_probability: float
    predicted_violations: float
    realised_violations: int
    PI_R: float
    PI_H: float
    PI_T: float
    PI_R_lateral: float
    PI_H_lateral: float
    PI_T_lateral: float
    path_length: float
    human_path_length: float
    turning: float
    human_turning: float
    status_counts: dict[str, int]
    plan_median: float
    plan_p95: float
    plan_max: float

    def as_dict(self) -> dict[str, Any]:
        """As a dictionary."""
        return asdict(self)


def measure(record: Record) -> Metrics:
    """Return the numbers of a run."""
    people = record.people_positions
    gaps = closest_within_steps(record.robot_positions, people)  # (T, P) m
    sampled = lengths(people - record.robot_positions[:, None])  # (T+1, P) m
    moving, standing = contacts(record, gaps)
    predicted, realised = _violations(record, sampled)
    robot_contacts, robot_gap = among_robots(record)
    pi_r, pi_h, lateral_r, lateral_h = _indices(record)
    planning = 1e3 * record.planning_time[record.plan_age <= 1e-9]
    median, p95, most = np.quantile(planning, (0.5, 0.95, 1.0)).tolist() if len(planning) else (math.nan,) * 3
    return Metrics(
        steps=len(record.status),
        duration=float(record.time[-1] - record.time[0]),
        finished=_finished(record),
        reached_goal=record.reached_goal,
        time_to_goal=arrival(record),
        min_distance=_least(gaps),
        sampled_min_distance=_least(sampled),
        clearance_violations=int((gaps < record.clearance).any(axis=1).sum()),
        contacts_moving=moving,
        contacts_standing=standing,
        robot_contacts=robot_contacts,
        robot_min_distance=robot_gap,
        max_collision_probability=_most(record.collision_probability),
        predicted_violations=predicted,
        realised_violations=realised,
        PI_R=pi_r,
        PI_H=pi_h,
        PI_T=pi_r + pi_h,
        PI_R_lateral=lateral_r,
        PI_H_lateral=lateral_h,
        PI_T_lateral=lateral_r + lateral_h,
        path_length=_length(record.robot_positions),
        human_path_length=sum(_length(people[:, i]) for i in range(people.shape[1])),
        turning=_turning(record.robot_positions),
        human_turning=sum(_turning(people[:, i]) for i in range(people.shape[1])),
        status_counts={"certified": 0, "least_risk": 0, "stopped": 0} | Counter(record.status),
        plan_median=median,
        plan_p95=p95,
        plan_max=most,
    )


def _finished(record: Record) -> bool:
    planned = float(record.settings.get("duration", record.time[-1]))
    return record.reached_goal or bool(record.time[-1] > planned - record.control_step)


def arrival(record: Record) -> float:
    """Return the first recorded instant (s) within the goal tolerance; NaN where there is none."""
    if not record.reached_goal:
        return math.nan
    tolerance = float(record.settings.get("robot", {}).get("goal_tolerance", 0.0))
    gap = lengths(record.robot_positions[1:] - record.robot_goal)
    inside = np.flatnonzero(gap <= tolerance + 1e-12)
    return float(record.time[1 + inside[0]]) if len(inside) else float(record.time[-1])


def _violations(record: Record, sampled: FloatArray) -> tuple[float, int]:
    """Expected and realised count of being within the clearance one time step after a plan was made."""
    ahead = round(record.time_step / record.control_step)
    whole = ahead >= 1 and abs(record.time_step / record.control_step - ahead) < 1e-6
    planned = np.flatnonzero(record.plan_age <= 1e-9)
    planned = planned[planned + ahead < len(record.time)] if whole else planned[:0]
    if not len(planned) or record.risk.shape[1] == 0:
        return 0.0, 0
    inside = (sampled[planned + ahead] < record.clearance).any(axis=1)
    risk: FloatArray = record.risk[planned, 0]
    known = np.isfinite(risk)
    return float(risk[known].sum()), int((inside & known).sum())


def _indices(record: Record) -> tuple[float, float, float, float]:
    """PI_R, PI_H, and both with the lateral offset, at instants one time step apart: a finer record sums no more."""
    ratio = record.time_step / record.control_step
    whole = ratio >= 1 and abs(ratio - round(ratio)) < 1e-6
    every, share = (round(ratio), 1.0) if whole else (1, 1 / ratio)
    robot, people, goals = record.robot_positions[::every], record.people_positions[::every], record.people_goals
    known = np.flatnonzero(np.isfinite(goals).all(axis=-1)).tolist()
    return (
        share * _squares(robot, record.robot_goal),
        share * sum(_squares(people[:, i], goals[i]) for i in known),
        share * _lateral(robot, record.robot_goal),
        share * sum(_lateral(people[:, i], goals[i]) for i in known),
    )


def _squares(path: FloatArray, goal: FloatArray) -> float:
    return _total((path - goal) ** 2)


def _lateral(path: FloatArray, goal: FloatArray) -> float:
    """Sum (m) of the distances from the straight line through the first position and the goal; 0 in 1-D."""
    path = path[np.isfinite(path).all(axis=-1)]
    if len(path) == 0:
        return 0.0
    way = goal - path[0]
    length = math.sqrt(way.dot(way))
    offset = path - path[0]
    unit = way / length if length > 0 else way
    return float(lengths(offset - (offset @ unit)[:, None] * unit).sum())


def _length(path: FloatArray) -> float:
    return _total(lengths(path[1:] - path[:-1]))


def _total(values: FloatArray) -> float:
    """Sum of what is known."""
    total = float(values.sum())
    return float(np.nansum(values)) if math.isnan(total) else total


def _turning(path: FloatArray) -> float:
    """Sum (rad) of the angles between successive displacements; pauses do not count."""
    moves = path[1:] - path[:-1]
    strides = lengths(moves)
    turning = strides > _TURN
    moves = moves[turning] / strides[turning][:, None]
    if len(moves) < 2:
        return 0.0
    chords = lengths(moves[1:] - moves[:-1])  # exact for small angles, where arccos is not
    return float((2 * np.arcsin(np.minimum(chords / 2, 1.0))).sum())


def _least(values: FloatArray) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.min()) if finite.size else math.nan


def _most(values: FloatArray) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.max()) if finite.size else math.nan
