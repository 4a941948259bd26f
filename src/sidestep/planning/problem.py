"""Eq. 9 as frozen data: what the robot minimises, and under which limits.

people = RiskField(people=[PersonMass.of_prediction(p) for p in predictions], distances=np.array([0.7, …]))
problem = PlanningProblem(start=x, goal=g, time_step=0.5, horizon=8, max_speed=1.0, people=people)
found = search(problem)                                                # exact on the lattice
if not found.feasible:
    found = search(replace(problem, graded=True), found.maps)         # least risk; the maps are used again
refined = polish(problem, found)                                       # .path, .cost, .risk
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from sidestep._kernels.path_costs import goal_costs, motion_cost, straight_motion_cost, top_speed
from sidestep._kernels.risk_sweep import forbid_changes
from sidestep.human.cost import per_axis
from sidestep.lazily import lazy
from sidestep.obstacles import Obstacles
from sidestep.planning.body import Body
from sidestep.planning.geodesic import DistanceField, way_to
from sidestep.planning.stopping import Inertia
from sidestep.prediction.collision import RiskField
from sidestep.prediction.first_step import FirstStep
from sidestep.robots.holonomic import diagonal
from sidestep.types import BoolArray, FloatArray, GoalCost, Path, RiskRule, Shape, Vector, sealed

STANDING_SHARE = 1.0 / 3.0
"""Part of the risk's cost that standing still is charged: who walks into a robot that stands is not run over by it."""

_BESIDE = 0.1  # m beyond what the lattice needs


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanningProblem:
    """Minimise Σ_{k=1..N} goal(x_k) + ‖u_{k−1}‖²_θ6 + λ·risk, under the dynamics, walls, speed and risk limits.

    Attributes:
        start: (d,) m, x_R(0); goal: (d,) m.
        time_step: s, ΔT; horizon: steps, N ≥ 1.
        max_speed: m/s; shape: "box" limits every axis (Eq. 9d), "disc" the norm.
        goal_cost: "squared" is ‖x−g‖²_θ5 (Eq. 9a), "distance" is ‖θ5·(x−g)‖.
        goal_weight: θ5, one number or one per axis; effort_weight: θ6, likewise.
        terminal_weight: further multiple of the goal cost at step N.
        people: the risk at any place, or None when nobody is near; for the rule "cells" what `RiskField.cells_above`
            returns.
        rule: see `sidestep.prediction.collision`; risk_limit: P_th.
        soft_risk_weight: λ, cost per unit probability and step, half of it charged midway.
        steep_risk_weight: cost per unit probability above the limit where the problem is `graded`.
        recourse_steps: steps after which it is `later_risk_weight` instead; None: never.
        graded: no plan is forbidden for its risk; used when no plan respects the limit.
        standing_share: part of the risk's cost that standing still is charged.
        beset: somebody stands so near that where the robot is, is no place to stay: a base of limited acceleration may
            go where it could stop with no more risk than staying.
        first_step: limits the risk until the next call, swept exactly; None: no such limit.
        hold: s until the next call; where that is longer than a step, the first action goes on until then.
        obstacles: walls, or None; margin: m, to be kept from them.
        distance_to_goal: walking distance around walls; replaces the straight line in the goal cost "distance" and,
            squared, in "squared" (θ5 of the first axis then counts for all).
        body: what the base would run into, whatever the risk of the point that is planned for, or None.
        inertia: of a base of limited acceleration, which limits the first action, or None; stop_limit: largest
            admissible risk at each half instant until such a base, braking from the next call on, would stand.
        resolution: K, largest tap of the search; None: by the budget.
        overshoot_weight: cost per m by which a base of limited acceleration, braking from the next call on, would go
            farther than the goal is, and any base within a `hold` that is longer than a step.
        preferred: (d,) m/s, a first velocity that is preferred, or None; preference_weight: cost per m²/s² off it.
    """

    start: Vector
    goal: Vector
    time_step: float
    horizon: int
    max_speed: float
    shape: Shape = "box"
    goal_cost: GoalCost = "distance"
    goal_weight: float | tuple[float, ...] = 1.0
    effort_weight: float | tuple[float, ...] = 0.0
    terminal_weight: float = 0.0
    people: RiskField | None = None
    rule: RiskRule = "mass"
    risk_limit: float = 0.02
    soft_risk_weight: float = 0.0
    steep_risk_weight: float = 1e4
    recourse_steps: int | None = None
    later_risk_weight: float = 100.0
    graded: bool = False
    standing_share: float = STANDING_SHARE
    beset: bool = False
    first_step: FirstStep | None = None
    hold: float = 0.0
    obstacles: Obstacles | None = None
    margin: float = 0.3
    distance_to_goal: DistanceField | None = None
    body: Body | None = None
    inertia: Inertia | None = None
    stop_limit: float = 0.01
    resolution: int | None = None
    overshoot_weight: float = 0.0
    preferred: Vector | None = None
    preference_weight: float = 0.0

    @property
    def dimension(self) -> int:
        """Number of axes d."""
        return int(self.start.size)

    @property
    def for_least_risk(self) -> PlanningProblem:
        """The same where no risk is forbidden, all of it is charged, and no way beyond the horizon outweighs it."""
        return replace(self, graded=True, terminal_weight=0.0)

    @property
    def goal_weights(self) -> FloatArray:
        """(d,) θ5."""
        return per_axis("planner.goal_weight", self.goal_weight, self.dimension)

    @property
    def effort_weights(self) -> FloatArray:
        """(d,) θ6."""
        return per_axis("planner.effort_weight", self.effort_weight, self.dimension)

    @property
    def excess_weights(self) -> FloatArray:
        """(N,) cost per unit probability above the limit at each step; zeros where what exceeds it is forbidden."""
        steep = self.steep_risk_weight if self.graded else 0.0
        later = None if not self.graded else self.recourse_steps
        return _excess_weights(self.horizon, steep, later, self.later_risk_weight)

    @property
    def instant_limit(self) -> float:
        """What the risk of an instant of the motion is held against."""
        return _instant_limit(self.rule, self.risk_limit)

    @property
    def half_share(self) -> float:
        """Part of a step's price of risk that a half instant is charged: ½ where the risk midway is known."""
        return 0.5 if self.people is not None and self.people.has_midway else 1.0

    def goal_costs(self, points: FloatArray) -> FloatArray:
        """Return the goal cost (M,) of being at `points` (M, d) m at one step."""
        if self.distance_to_goal is None:
            return goal_costs(points, self.goal, self.goal_weights, self.goal_cost == "squared")
        walk = self.distance_to_goal.at(points)
        return self.goal_weights[0] * (walk * walk if self.goal_cost == "squared" else walk)

    def preference_costs(self, velocities: FloatArray) -> FloatArray:
        """Return (M,) what first velocities (M, d) m/s cost for being off the preferred one."""
        if self.preferred is None:
            return np.zeros(len(velocities))
        return self.preference_weight * np.square(velocities - self.preferred).sum(axis=1)

    @property
    def may_overshoot(self) -> bool:
        """Whether the base may be beyond the end of the first step before it can be asked for anything else."""
        return self.inertia is not None or self.hold > self.time_step

    def overshoot_costs(self, velocities: FloatArray) -> FloatArray:
        """Return (M,) what it costs that the base would go farther than the goal is after first velocities (M, d) m/s.

        A lattice whose cells lie farther apart than the base can change its velocity by takes it to brake in time
        where it does not: it would swing around the goal. So would any base that goes on for longer than a step.
        Whichever way it goes: who passes beside the goal circles around it.
        """
        if not self.may_overshoot or self.overshoot_weight == 0.0:
            return np.zeros(len(velocities))
        ends = self.hold * velocities if self.inertia is None else self.inertia.stops(velocities, 0).ends
        farther = np.sqrt(np.square(ends).sum(axis=1)) - way_to(self.goal, self.start, self.distance_to_goal)
        return self.overshoot_weight * np.maximum(farther, 0.0)

    def risk_along(self, path: Path) -> FloatArray:
        """Return (2N,) what the rule limits, at half instants 1..2N of `path` (N+1, d) m."""
        if self.people is None or not self.people.people:
            return np.zeros(2 * (len(path) - 1))
        return self.people.along(path)

    def cost(self, path: Path, risk: FloatArray | None = None) -> float:
        """Return the objective of `path` (N+1, d) m, soft risk included (graded: the steep part and first step too).

        Args:
            path: m. risk: (2N,) along it, if known.
        """
        nothing = self.soft_risk_weight == 0 and not self.graded
        seen = np.zeros(2 * (len(path) - 1)) if nothing else self.risk_along(path) if risk is None else risk
        beyond = (
            self.terminal_weight, self.effort_weights, self.time_step, seen, self.half_share,
            self.soft_risk_weight, self.excess_weights, self.risk_limit, self.standing_share,
        )  # fmt: skip
        if self.distance_to_goal is None:
            squared = self.goal_cost == "squared"
            total = straight_motion_cost(path, self.goal, self.goal_weights, squared, *beyond)
        else:
            total = motion_cost(path, self.goal_costs(path[1:]), *beyond)
        if self.preferred is None and not self.may_overshoot and not self.graded:
            return total
        first = self.first_velocity(path)
        if self.preferred is not None:
            total += float(self.preference_costs(first)[0])
        if self.may_overshoot:
            total += float(self.overshoot_costs(first)[0])
        return total + float(self.first_step_costs(first)[0]) if self.graded else total

    @property
    def largest_change(self) -> float:
        """m/s by which the first action may differ from the present velocity; inf without a limit.

        From outside the speed limit, the way back into it is always allowed.
        """
        if self.inertia is None:
            return math.inf
        now: list[float] = self.inertia.velocity.tolist()
        limited = now if self.shape == "box" else [math.hypot(*now)]
        outside = math.hypot(*(max(abs(v) - self.max_speed, 0.0) for v in limited))
        return max(outside, self.inertia.largest_change)

    def begun(self, velocities: FloatArray) -> FloatArray:
        """Return (M, d) m/s, how far toward first velocities (M, d) m/s acceleration lets the base come."""
        if self.inertia is None:
            return velocities
        change, most = velocities - self.inertia.velocity, self.largest_change
        size = np.sqrt(np.square(change).sum(axis=1, keepdims=True))
        return np.where(size > most, self.inertia.velocity + change * (most / np.maximum(size, 1e-12)), velocities)

    def first_velocity(self, path: Path) -> FloatArray:
        """Return (1, d) m/s, the mean velocity over the first step of `path` (N+1, d) m."""
        return (path[1:2] - path[:1]) / self.time_step

    def first_step_costs(self, velocities: FloatArray) -> FloatArray:
        """Return (M,) what each first action costs beyond its effort; inf where it is not admissible.

        Judged are the acceleration, the risk until the next call, the walls along the first step and until then, where
        acceleration is limited the way on which the base would come to stand, and what the body would run into.

        Args:
            velocities: (M, d) m/s, means over the first step.
        """
        if self.first_step is None:
            out = np.zeros(len(velocities))
        else:
            out = self.first_step.costs(self.start, velocities, graded=self.graded, steep=self.steep_risk_weight)
        if self.inertia is not None:
            stops = self.inertia.are_stops(velocities)
            spared = out[stops]
            forbid_changes(velocities, self.inertia.velocity, self.largest_change, out)
            out[stops] = spared
        if self.obstacles is not None:
            ends = self.start + velocities * max(self.time_step, self.hold)
            out[~self._free(np.broadcast_to(self.start, ends.shape), ends)] = np.inf
        if self.inertia is not None:
            left = np.flatnonzero(np.isfinite(out))
            out[left] += self._stop_costs(self.inertia, velocities[left])
        if self.body is not None:
            left = np.flatnonzero(np.isfinite(out))
            hits = self._runs_into(self.body, velocities[left])
            if self.graded and self.inertia is not None:
                hits &= ~self.inertia.are_stops(velocities[left])  # to brake is all that can be done then
            out[left[hits]] = math.inf
        return out

    def _runs_into(self, body: Body, velocities: FloatArray) -> BoolArray:
        """(M,) whether first actions (M, d) m/s, and the stop after them, run the body into anything."""
        return body.runs_into(velocities if self.inertia is None else self.inertia.asked(velocities))

    def can_stop(self, path: Path) -> bool:
        """Return whether the base, once on `path` (N+1, d) m, could still come to stand with little enough risk."""
        first = self.first_velocity(path)
        if self.body is not None and self._runs_into(self.body, first)[0]:
            return False
        if self.inertia is None:
            return True
        excess, blocked = self._stop_excess(self.inertia, first)
        return not (excess[0] > 0.0 or blocked[0])

    def _stop_costs(self, inertia: Inertia, velocities: FloatArray) -> FloatArray:
        """(M,) 0 where the base can stop after a first action without more risk than `stop_limit`, else as graded.

        A wall in the way to a stop is never a matter of degree, as long as the base can still brake before it.
        """
        excess, blocked = self._stop_excess(inertia, velocities)
        if not self.graded:
            return np.where((excess > 0.0) | blocked, np.inf, 0.0)
        costs = self.half_share * self.later_risk_weight * excess
        costs[blocked] += math.inf if self._brakes_in_time else self.steep_risk_weight
        return costs

    @lazy
    def _staying(self) -> float:
        """The largest risk of staying where the robot is."""
        return float(self.risk_along(np.repeat(self.start[None], self.horizon + 1, axis=0)).max())

    @lazy
    def _brakes_in_time(self) -> bool:
        """Whether the hardest stop leads to no wall."""
        assert self.inertia is not None
        return not self._stop_excess(self.inertia, self.inertia.hardest_stop()[None])[1][0]

    def _stop_excess(self, inertia: Inertia, velocities: FloatArray) -> tuple[FloatArray, BoolArray]:
        """(M,) by how much the risk on the way to a stop passes `stop_limit`, summed; (M,) whether a wall is there."""
        stops = inertia.stops(velocities, 2 * self.horizon)
        excess = np.zeros(len(velocities))
        if self.people is not None and self.people.people and stops.moving.any():
            which, half = np.nonzero(stops.moving)
            seen = self.people.at_instants(half + 1, self.start + stops.shifts[which, half])
            limit = _instant_limit(self.rule, self.stop_limit)
            if self.beset:
                limit = max(limit, self._staying)
            np.add.at(excess, which, np.maximum(seen - limit * (1.0 + 1e-6) - 1e-9, 0.0))
        if self.obstacles is None:
            return excess, np.zeros(len(velocities), dtype=np.bool_)
        starts = np.broadcast_to(self.start, velocities.shape)
        return excess, ~self._free(starts, self.start + stops.ends)

    @lazy
    def room(self) -> float:
        """How many m to walls the robot has where it is, and can keep; inf where there are none."""
        return math.inf if self.obstacles is None else float(self.obstacles.distance(self.start[None])[0]) - 1e-9

    @property
    def lattice_margin(self) -> float:
        """How many m the cells of a lattice keep from walls, so that the ways between them keep the margin.

        A corner may poke in between two samples half a step apart.
        """
        return math.hypot(self.margin, 0.25 * self.max_speed * self.time_step * diagonal(self.shape, self.dimension))

    @property
    def beside_walls(self) -> bool:
        """Whether walls are so near that a lattice may be too coarse to lead past them."""
        return self.room <= self.lattice_margin + _BESIDE

    def _free(self, starts: FloatArray, ends: FloatArray) -> BoolArray:
        """(M,) whether straight ways (M, d) m from where the robot is come no nearer to walls than they may."""
        assert self.obstacles is not None
        free = self.obstacles.segment_free(starts, ends, min(self.margin, self.room))
        if self.room < 0.0:
            free[free] = self.obstacles.come_out(starts[free], ends[free], self.margin)
        return free

    def allows(self, path: Path, risk: FloatArray | None = None) -> bool:
        """Return whether `path` (N+1, d) m respects every limit: speed, walls, first step and (unless graded) risk."""
        if not top_speed(path, self.time_step, self.shape == "box") <= self.max_speed * (1 + 1e-6) + 1e-9:
            return False
        if not self.graded:
            seen = self.risk_along(path) if risk is None else risk
            if not respects(seen, self.rule, self.risk_limit):
                return False
        if not math.isfinite(self.first_step_costs(self.first_velocity(path))[0]):
            return False
        if self.obstacles is None or len(path) < 3:
            return True
        return bool(self.obstacles.segment_free(path[1:-1], path[2:], self.margin).all())


def respects(risk: FloatArray, rule: RiskRule, limit: float) -> bool:
    """Return whether the risk (2N,) at half instants 1..2N stays within `limit` under the rule."""
    tolerance = 1e-6 * limit + 1e-9
    if rule == "trajectory":
        return float(risk[1::2].sum()) <= limit + tolerance
    most = _instant_limit(rule, limit + tolerance)
    return all(r <= most for r in risk.tolist())  # what is no number is no certificate


def _instant_limit(rule: RiskRule, limit: float) -> float:
    """What the risk of an instant is held against: `limit`, or what parts 0 and 1, all that "cells" knows."""
    return 0.5 if rule == "cells" else limit


@lru_cache(maxsize=64)
def _excess_weights(horizon: int, steep: float, recourse: int | None, later: float) -> FloatArray:
    """(horizon,) `steep`, and `later` from the step `recourse` on."""
    weights = np.full(horizon, steep)
    if recourse is not None:
        weights[recourse:] = later
    return sealed(weights)
