"""Every number of the planner that is not about the person or the robot, in one frozen value."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

from sidestep.errors import InvalidInput
from sidestep.types import RiskRule


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerSettings:
    """Settings of `sidestep.Planner`; the defaults serve real people.

    A limit per stage is not a limit per encounter: with `risk_limit` P_th at every stage, a trip past a person who
    keeps acting at random can still end in contact more often than P_th (prototypes: 7–14 % at P_th = 0.05 with the
    paper's rule). `first_step_limit` bounds what matters until the next call.

    Attributes:
        time_step: s, ΔT between planned positions (> 0).
        horizon: steps, N_R (≥ 1).
        risk_rule: "mass": P(a person within `clearance`) ≤ P_th at every step; "cells": stay `clearance` away from
            every cell with P ≥ P_th (the paper's Section IV); "trajectory": the sum over the horizon ≤ P_th.
        risk_limit: P_th in (0, 1].
        clearance: m between centres; None is robot radius + person radius + 0.10 m.
        goal_weight: θ5, one number or one per axis (≥ 0).
        goal_cost: "squared" is Eq. 9a; "distance" is θ5·‖x−g‖, whose pull does not grow with the distance.
        effort_weight: θ6, one number or one per axis (≥ 0).
        soft_risk_weight: λ, cost per unit of probability within clearance below the limit (≥ 0); 0 is the paper.
        midway: look between the samples too.
        first_step_limit: P(closer than contact + 0.05 m at any time until the next call) of the first action, or None.
        rounds: predictions under the own plan at most (≥ 1).
        polish: refine the lattice motion continuously.
        search_resolution: robot lattice cells per step at full speed, K; None chooses by horizon and dimension.
        timeout: s without any observation of people after which the planner stops.
        memory: s for which a person who is no longer seen is still predicted.
        deadline: s, wall clock, within which `step` returns; None: no deadline.
        signal_belief: P(concerned) below which a danger signal is asked for; None: never (method §7).

    """

    time_step: float = 0.5
    horizon: int = 8
    risk_rule: RiskRule = "mass"
    risk_limit: float = 0.02
    clearance: float | None = None
    goal_weight: float | tuple[float, ...] = 1.0
    goal_cost: Literal["squared", "distance"] = "distance"
    effort_weight: float | tuple[float, ...] = 0.02
    soft_risk_weight: float = 15.0
    midway: bool = True
    first_step_limit: float | None = 0.01
    rounds: int = 3
    polish: bool = True
    search_resolution: int | None = None
    timeout: float = 1.0
    memory: float = 1.0
    deadline: float | None = None
    signal_belief: float | None = None

    __pydantic_config__: ClassVar[dict[str, str]] = {"extra": "forbid"}

    def __post_init__(self) -> None:
        for name in ("time_step", "timeout"):
            _check(name, getattr(self, name), lambda v: math.isfinite(v) and v > 0, "a finite number > 0 (s)")
        for name in ("horizon", "rounds"):
            _check(name, getattr(self, name), lambda v: v >= 1, "an integer ≥ 1")
        _check("risk_rule", self.risk_rule, lambda v: v in ("cells", "mass", "trajectory"), "cells, mass or trajectory")
        _check("risk_limit", self.risk_limit, lambda v: 0 < v <= 1, "a probability in (0, 1]")
        _check("goal_cost", self.goal_cost, lambda v: v in ("squared", "distance"), "squared or distance")
        for name in ("goal_weight", "effort_weight"):
            weight = getattr(self, name)
            for w in weight if isinstance(weight, tuple) else (weight,):
                _check(name, w, lambda v: math.isfinite(v) and v >= 0, "a finite number ≥ 0")
        for name in ("soft_risk_weight", "memory"):
            _check(name, getattr(self, name), lambda v: math.isfinite(v) and v >= 0, "a finite number ≥ 0")
        for name in ("clearance", "deadline"):
            _check(
                name, getattr(self, name), lambda v: v is None or (math.isfinite(v) and v > 0), "a number > 0, or none"
            )
        for name in ("first_step_limit", "signal_belief"):
            _check(name, getattr(self, name), lambda v: v is None or 0 < v <= 1, "a probability in (0, 1], or none")
        _check("search_resolution", self.search_resolution, lambda v: v is None or v >= 1, "an integer ≥ 1, or none")


def _check(name: str, value: object, allowed: object, words: str) -> None:
    try:
        good = bool(allowed(value))  # type: ignore[operator]
    except TypeError:
        good = False
    if not good:
        raise InvalidInput(f"planner.{name}", value, words)
