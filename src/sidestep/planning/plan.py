"""What planning returns: the motion, its certificate, its status. Knows no solver."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from sidestep.planning.settings import PlannerSettings
from sidestep.types import FloatArray, Path, RiskRule, Status, Vector, all_sealed, frozen_array

if TYPE_CHECKING:
    from sidestep.prediction.occupancy import Occupancy


@dataclass(frozen=True, kw_only=True, eq=False)
class PersonPlan:
    """What the plan assumes of one person.

    Attributes:
        belief: P(concerned), strictly between 0 and 1.
        foretell: returns `occupancy`; people who cannot come near are predicted only when somebody asks.
        collision_probability: (N,) P(first contact at k = 1..N) under this plan.
        goals: candidate goals as text → probability.
        randomness: ω used for this prediction.
        position: (d,) m, filtered; velocity: (d,) m/s, filtered.
        spread: (C,) weights and (N+1, C) m standard deviations of the Gaussians around every cell, by which density is
            read off `occupancy` at k = 0..N (steadiness, method §8); None: none.
    """

    belief: float
    foretell: Callable[[], Occupancy]
    collision_probability: FloatArray
    goals: Mapping[str, float]
    randomness: float
    position: Vector
    velocity: Vector
    spread: tuple[FloatArray, FloatArray] | None = None

    @cached_property
    def occupancy(self) -> Occupancy:
        """(N+1, cells…) probability over cells at k = 0..N, with `.lattice`."""
        return self.foretell()

    def __reduce__(self) -> tuple[Callable[..., PersonPlan], tuple[Any, ...]]:
        told = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "foretell"}
        return _person_plan, (told, self.occupancy)


def _person_plan(told: dict[str, Any], occupancy: Occupancy) -> PersonPlan:
    return PersonPlan(**all_sealed(told), foretell=lambda: occupancy)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plan:
    """A motion and what it was certified for.

    Attributes:
        time: s, for which the plan was made.
        time_step: s, ΔT between the positions.
        velocity: (d,) m/s, to be applied until the next call; where acceleration is limited, what to ramp to.
        command: what the robot's base takes: the velocity, or (v, ω) in m/s and rad/s for a differential drive.
        positions: (N+1, d) m, k = 0..N, of the point that planning moves (`robot.reference`).
        velocities: (N, d) m/s, means over each step.
        collision_probability: (N,) P_coll(k|t), k = 1..N, of a first contact with anybody (the sum is that of any),
            recomputed under the prediction that this plan induces.
        risk: (N,) what the risk rule limits, at k = 1..N ("mass": P(a person within clearance), mid-steps too;
            "trajectory": the same without mid-steps, whose sum is limited).
        risk_limit: P_th of the rule.
        status: "certified", "least_risk" or "stopped".
        reason: one line of plain words for the status.
        people: id → what was assumed of that person.
        horizon_used: steps actually planned (smaller than asked for only under a deadline).
        rounds: predictions made for this plan.
        cost: value of the objective (Eq. 9a) of this motion.
        duration: s, wall-clock time that planning took.
        signal: True when the robot should make itself noticed (off by default).
        risk_rule: what is limited; see `PlannerSettings`.
    """

    time: float
    time_step: float
    velocity: Vector
    command: Vector
    positions: Path
    velocities: FloatArray
    collision_probability: FloatArray
    risk: FloatArray
    risk_limit: float
    status: Status
    reason: str
    people: Mapping[str, PersonPlan]
    horizon_used: int
    rounds: int
    cost: float
    duration: float
    signal: bool = False
    risk_rule: RiskRule = "mass"

    @property
    def limited_risk(self) -> float:
        """What is held against `risk_limit`."""
        return float(limited_risk(self.risk, self.risk_rule))

    def __reduce__(self) -> tuple[Callable[..., Plan], tuple[Any, ...]]:
        told = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "people"}
        return _plan, (told, dict(self.people))


def limited_risk(risk: FloatArray, rule: RiskRule) -> FloatArray:
    """Return what the rule holds against its limit, (…) of `risk` (…, N): "trajectory" their sum, else the largest."""
    return risk.sum(axis=-1) if rule == "trajectory" else risk.max(axis=-1, initial=0.0)


def limited_name(rule: RiskRule) -> str:
    """What that is called."""
    return "summed risk" if rule == "trajectory" else "largest risk"


def _plan(told: dict[str, Any], people: dict[str, PersonPlan]) -> Plan:
    return Plan(**all_sealed(told), people=MappingProxyType(people))


def stopped_plan(
    *, time: float, here: Vector, inputs: int, settings: PlannerSettings, reason: str, duration: float
) -> Plan:
    """Return the last rung of the ladder: stand at `here` ((d,) m), command `inputs` zeros, and say why."""
    n, d = settings.horizon, here.size
    return Plan(
        time=time,
        time_step=settings.time_step,
        velocity=frozen_array(np.zeros(d)),
        command=frozen_array(np.zeros(inputs)),
        positions=frozen_array(np.repeat(here[None], n + 1, axis=0)),
        velocities=frozen_array(np.zeros((n, d))),
        collision_probability=frozen_array(np.zeros(n)),
        risk=frozen_array(np.zeros(n)),
        risk_limit=settings.risk_limit,
        risk_rule=settings.risk_rule,
        status="stopped",
        reason=reason,
        people=MappingProxyType({}),
        horizon_used=0,
        rounds=0,
        cost=math.inf,
        duration=duration,
    )
