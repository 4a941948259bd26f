"""What happened: immutable arrays over time. Figures and metrics are made from a Record alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sidestep.planning.plan import limited_risk
from sidestep.types import FloatArray, IntArray, RiskRule, frozen_array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Snapshot:
    """The predicted occupancy of one person at one recorded step.

    Attributes:
        step: index into `Record.time`.
        person: index into `Record.people`.
        origin: (d,) m; spacing: m; rotation: (d, d); the lattice (see `sidestep.lattice.Lattice`).
        probability: (K, cells…) probability over cells at the prediction instants `instants`.
        instants: (K,) steps ahead.
        weights: (C,), sigmas: (K, C) m, of the Gaussians around every cell by which density is read off `probability`
            (see `PersonPlan.spread`); empty: none.
    """

    step: int
    person: int
    origin: FloatArray
    spacing: float
    rotation: FloatArray
    probability: FloatArray
    instants: IntArray
    weights: FloatArray = field(default_factory=lambda: frozen_array([]))
    sigmas: FloatArray = field(default_factory=lambda: frozen_array([]))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Record:
    """One run. T control steps, P people, d dimensions, N horizon; NaN where a person is absent or a value unknown.

    Attributes:
        scenario: name.
        settings: every number of the run, JSON-able, seed included; reading it back gives the same run.
        seed: of the random generator.
        time: (T+1,) s.
        robot_positions: (T+1, d) m.
        robot_headings: (T+1,) rad, NaN for holonomic robots.
        robot_velocities: (T, d) m/s, executed in each control interval.
        robot_goal: (d,) m; robot_radius: m.
        people: ids; people_radii: (P,) m; people_goals: (P, d) m, NaN where unknown.
        people_positions: (T+1, P, d) m, true positions.
        people_awareness: (T+1, P) true β: 1, 0, or NaN where there is no such thing (recorded people).
        beliefs: (T, P) P(concerned) after each planning step.
        status: (T,) strings, one of Plan.status.
        collision_probability: (T, N) P_coll(k|t); risk: (T, N) what the rule limits.
        plans: (T, N+1, d) m, planned positions.
        planning_time: (T,) s, wall clock; 0 where the step reused the plan between two planning instants.
        plan_age: (T,) s since the plan in force was made (0 at planning instants).
        risk_limit: P_th of the rule.
        clearance: m between centres.
        time_step: s, between the positions of a plan.
        control_step: s, between the instants of the record.
        snapshots: predicted occupancies at chosen steps.
        walls: closed polygons, each (V, 2) m.
        reached_goal: the robot came within its goal tolerance.
        other_robots: (T+1, R, d) m, positions of other robots in the same run; other_radii: (R,) m; other_goals: (R, d)
            m; empty where the robot is the only one.
    """

    scenario: str
    settings: Mapping[str, Any]
    seed: int
    time: FloatArray
    robot_positions: FloatArray
    robot_headings: FloatArray
    robot_velocities: FloatArray
    robot_goal: FloatArray
    robot_radius: float
    people: tuple[str, ...]
    people_radii: FloatArray
    people_goals: FloatArray
    people_positions: FloatArray
    people_awareness: FloatArray
    beliefs: FloatArray
    status: tuple[str, ...]
    collision_probability: FloatArray
    risk: FloatArray
    plans: FloatArray
    planning_time: FloatArray
    plan_age: FloatArray
    risk_limit: float
    clearance: float
    time_step: float
    control_step: float
    snapshots: tuple[Snapshot, ...]
    walls: tuple[FloatArray, ...]
    reached_goal: bool
    other_robots: FloatArray = field(default_factory=lambda: frozen_array([]))
    other_radii: FloatArray = field(default_factory=lambda: frozen_array([]))
    other_goals: FloatArray = field(default_factory=lambda: frozen_array([]))

    @property
    def risk_rule(self) -> RiskRule:
        """The rule that planned."""
        return self.settings.get("planner", {}).get("risk_rule", "mass")

    @property
    def limited_risk(self) -> FloatArray:
        """(T,) what the rule held against `risk_limit`; NaN where it is unknown."""
        known = np.isfinite(self.risk)
        held = limited_risk(np.where(known, self.risk, 0.0), self.risk_rule)
        return np.where(known.any(axis=1), held, np.nan)
