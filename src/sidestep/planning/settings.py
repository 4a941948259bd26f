"""Every number of the planner that is not about the person or the robot, in one frozen value."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from sidestep.checks import FARTHEST, WIDEST, Checks
from sidestep.types import GoalCost, RiskRule

CLEARANCE_MARGIN = 0.10
"""m beyond contact that plans keep from anybody, where `clearance` is left open (method §8), and from other robots."""
FIRST_STEP_MARGIN = 0.05
"""m beyond contact that the first action must keep until the next call."""
LONGEST_LOOK = 100.0
"""s, of a step or a way to a stop at most: both are looked at in slices of 0.05 s."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerSettings:
    """Settings of `sidestep.Planner`; the defaults serve real people.

    A limit per stage is not a limit per encounter: with `risk_limit` P_th at every stage, a trip past a person who
    keeps acting at random can still end in contact more often than P_th (prototypes: 7–14 % at P_th = 0.05 with the
    paper's rule). `first_step_limit` bounds what matters until the next call.

    Attributes:
        time_step: s, ΔT between planned positions (> 0, ≤ 100).
        horizon: steps, N_R, from 1 to 100 (in the plane; then a step takes seconds, and a gigabyte).
        risk_rule: "mass": P(a person within `clearance`) ≤ P_th at every step; "cells": stay `clearance` away from
            every cell with P ≥ P_th (the paper's Section IV); "trajectory": the sum over the horizon ≤ P_th.
        risk_limit: P_th in (0, 1].
        clearance: m between centres (≤ 100); None is robot radius + person radius + 0.10 m.
        goal_weight: θ5, one number or one per axis (≥ 0).
        goal_cost: "squared" is Eq. 9a; "distance" is θ5·‖x−g‖, whose pull does not grow with the distance.
        terminal_weight: among three people and more, or anybody between walls, how much of the way that is left after
            the horizon counts (≥ 0): 1 is what it costs to go on at full speed, for as long again at most; 0 is Eq. 9a,
            which does not look so far.
        effort_weight: θ6, one number or one per axis (≥ 0).
        acceleration_weight: cost of the acceleration until the next call, ∫‖a‖² dt in m²/s³ (≥ 0), so that a plan made
            ten times a second is followed and not shaken; 0 is the paper.
        soft_risk_weight: λ, cost per unit of probability within clearance below the limit (≥ 0); 0 is the paper.
        midway: look between the samples too.
        first_step_limit: P(closer than contact + 0.05 m at any time until the next call) of the first action, or None.
        least_randomness: ω in [0, 1] that is planned for at least where ω is learned online: somebody who has walked
            steadily so far may still do anything (method §8); what is learned stays as it is.
        recourse: s until which a motion must keep the limits where every motion that keeps them to the end gives up the
            way to the goal; what exceeds them later is charged, since it is judged again before. None: no such way out
            (the paper). Rule "mass" only; such a plan has the status "least_risk".
        detour_after: s for which somebody stands before the way to the goal is laid around them, too (in the plane, and
            with one `goal_weight` for both axes); None: people never change the way.
        rounds: predictions under the own plan at most (≥ 1).
        polish: refine the lattice motion continuously.
        search_resolution: robot lattice cells per step at full speed, K; None chooses by horizon and dimension.
        timeout: s without any observation of people after which the planner stops.
        memory: s for which a person who is no longer seen is still predicted.
        deadline: s, wall clock, within which `step` returns; None: no deadline. With one, `Planner.warm_up` is called
            when the planner is made.
        threads: that predict people side by side (≥ 1); the predictions are the same for any number. One by default:
            what else runs on a robot wants the other cores.
        signal_belief: P(concerned) below which a danger signal is asked for; None: never (method §7).

    """

    time_step: float = 0.5
    horizon: int = 8
    risk_rule: RiskRule = "mass"
    risk_limit: float = 0.05
    clearance: float | None = None
    goal_weight: float | tuple[float, ...] = 1.0
    goal_cost: GoalCost = "distance"
    terminal_weight: float = 1.0
    effort_weight: float | tuple[float, ...] = 0.02
    acceleration_weight: float = 0.05
    soft_risk_weight: float = 6.0
    midway: bool = True
    first_step_limit: float | None = 0.01
    least_randomness: float = 0.09
    recourse: float | None = 1.0
    detour_after: float | None = 2.0
    rounds: int = 3
    polish: bool = True
    search_resolution: int | None = None
    timeout: float = 1.0
    memory: float = 1.0
    deadline: float | None = None
    threads: int = 1
    signal_belief: float | None = None

    __pydantic_config__: ClassVar[dict[str, str]] = {"extra": "forbid"}

    def __post_init__(self) -> None:
        check = Checks(self, "planner")
        check.numbers("time_step", above=0.0, most=LONGEST_LOOK, unit="s")
        check.numbers("timeout", above=0.0, unit="s")
        check.integers("horizon", least=1, most=FARTHEST)
        check.integers("rounds", least=1, most=100)
        check.integers("threads", least=1, most=256)
        check.words("risk_rule", RiskRule)
        check.numbers("risk_limit", above=0.0, most=1.0)
        check.words("goal_cost", GoalCost)
        check.weights("goal_weight", "effort_weight")
        check.numbers("terminal_weight", "acceleration_weight", "soft_risk_weight", least=0.0)
        check.numbers("memory", least=0.0, unit="s")
        check.numbers("least_randomness", least=0.0, most=1.0)
        check.numbers("clearance", above=0.0, most=WIDEST, unit="m", optional=True)
        check.numbers("deadline", "recourse", "detour_after", above=0.0, unit="s", optional=True)
        check.numbers("first_step_limit", "signal_belief", above=0.0, most=1.0, optional=True)
        check.integers("search_resolution", least=1, most=100, optional=True)
        check.flags("midway", "polish")
