"""What the planner keeps of each person between two calls: habits, belief, and what they were expected to do.

A `Mind` is one frozen value. Evidence is weighed against an *anchor*: the instant at which a prediction was last made,
the position then, and the action probabilities under the robot plan that the person could anticipate. While less than
one time step has passed since the anchor, the belief is the anchor's belief times a share of the evidence, so that it
depends on the time that passed and not on the rate of the calls.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from sidestep import belief as bayes
from sidestep._kernels.evidence import weigh_action
from sidestep.belief import Belief
from sidestep.human import habits as learning
from sidestep.human.goals import DirectionGoal, Goal, PointGoal, SlowingGoal, StandGoal
from sidestep.human.habits import Habits
from sidestep.human.model import HumanModel
from sidestep.human.observation import PersonObservation
from sidestep.human.reaction import Facing, Way
from sidestep.lattice import identity
from sidestep.types import FloatArray, Vector, finite, frozen_array

_STALE = 3.0  # time steps after which a displacement no longer tells one action
_GOAL_RATE = 0.5  # 1/s, how fast "where to" is forgotten when it is only known as a direction
_ARRIVED = 0.3  # m from the goal, within which there is no way to it


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Anchor:
    """What a person was expected to do when it was last predicted.

    Attributes:
        time: s; position: (d,) m, measured then; covariance: (d, d) m² of that measurement.
        probabilities: (G, 2, n) P(u|x; goal, β); velocities: (n, d) m/s, world frame.
        belief: before the evidence that has come since.
    """

    time: float
    position: Vector
    covariance: FloatArray
    probabilities: FloatArray
    velocities: FloatArray
    belief: Belief


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Mind:
    """One person, as remembered.

    Attributes:
        id: identity; model: of this person.
        seen: s, last observation; measured: (d,) m, then; covariance: (d, d) m² of it.
        position: (d,) m; velocity: (d,) m/s; now, filtered and carried forward.
        habits: what was learned from the past, or None where the model switches that off.
        goals: candidates, in the order of the belief's rows.
        belief: now; anchor: None until the person was predicted.
        facing: the robot's way and the person's courses, where β is learned from the clearance they gain.
    """

    id: str
    model: HumanModel
    seen: float
    measured: Vector
    covariance: FloatArray
    position: Vector
    velocity: Vector
    habits: Habits | None
    goals: tuple[Goal, ...]
    belief: Belief
    anchor: Anchor | None = None
    facing: Facing | None = None

    @property
    def randomness(self) -> float:
        """ω of this person: learned where the model says so."""
        learned = self.habits is not None and self.model.online_randomness
        return self.habits.randomness if learned and self.habits else self.model.randomness

    @property
    def heading_velocity(self) -> Vector:
        """(d,) m/s, along which the lattice is laid, so that this motion is exactly an action.

        Where the one goal is known: straight to it at the mean pace of the last seconds, whatever way the person steps
        just now. Otherwise the velocity that the person is expected to keep.
        """
        goal = self.goals[0]
        if len(self.goals) == 1 and isinstance(goal, PointGoal):
            way = goal.position - self.position
            distance = math.hypot(*way.tolist())
            pace = self.velocity if self.habits is None else self.habits.mean_velocity
            if distance > _ARRIVED:
                return way * (max(math.hypot(*pace.tolist()), 1e-6) / distance)
        return self.velocity if self.habits is None else self.habits.extrapolated_velocity

    @property
    def position_covariance(self) -> FloatArray:
        """(d, d) m², of `position`."""
        return self.covariance if self.habits is None else self.habits.position_covariance

    def spread(self, times: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        """Weights (C,), sigmas (K, C) m of the Gaussians around the predicted position at `times` (K,) s, or None."""
        if self.habits is None or not self.model.steadiness:
            return None
        return self.habits.spread(times)


class Unplaceable(Exception):  # noqa: N818 (says why the planner must stop; never leaves it)
    """Somebody is there, but nobody can say where."""


def met(
    known: Mapping[str, Mind],
    people: Sequence[PersonObservation],
    time: float,
    *,
    model: HumanModel,
    dimension: int,
    time_step: float,
    memory: float,
) -> dict[str, Mind]:
    """Return everybody who counts at `time` s: those seen, and those seen at most `memory` s ago.

    People who share an id are told apart by primes: "a", "a'". A position that is not finite counts as not seen.

    Raises:
        Unplaceable: a position has the wrong dimension, or was never finite within `memory`.
    """
    present: dict[str, Mind] = {}
    for seen in people:
        name = seen.id
        while name in present:
            name += "'"
        before = known.get(name)
        if seen.position.shape != (dimension,):
            raise Unplaceable(f"person {seen.id!r}: position has {seen.position.size} coordinates, not {dimension}")
        if not finite(seen.position):
            if before is None or time - before.seen > memory:
                raise Unplaceable(f"person {seen.id!r}: position is {seen.position.tolist()}")
            present[name] = miss(before, time)
        elif before is None or not _same_but_goals(before.model, seen.model or model):
            present[name] = replace(meet(seen, seen.model or model, time), id=name)
        elif time > before.seen:
            given = seen.model or model
            same = before.model is given or before.model == given
            known_as = before if same else replace(before, model=given)
            present[name] = observe(known_as, seen, time, time_step)
        else:
            present[name] = before
    for name, before in known.items():
        if name not in present and time - before.seen <= memory:
            present[name] = miss(before, time)
    return present


def _same_but_goals(one: HumanModel, other: HumanModel) -> bool:
    """Whether two models differ at most in their candidate goals: what is believed of awareness is worth keeping."""
    return one is other or one == other or replace(one, goals=()) == replace(other, goals=())


def meet(observation: PersonObservation, model: HumanModel, time: float) -> Mind:
    """Return a mind for someone who was never seen before (or whose past no longer counts)."""
    covariance = _covariance(observation, model)
    velocity = np.zeros(observation.position.size) if observation.velocity is None else observation.velocity
    state = None
    if model.motion_filter:
        state = learning.meet(
            time,
            observation.position,
            covariance,
            velocity=observation.velocity,
            velocity_covariance=observation.velocity_covariance,
            settings=model.habits,
        )
    goals, over_goals = _goals(observation, model, state, velocity)
    return Mind(
        id=observation.id,
        model=model,
        seen=time,
        measured=observation.position,
        covariance=covariance,
        position=observation.position if state is None else state.position,
        velocity=frozen_array(velocity if state is None else state.velocity),
        habits=state,
        goals=goals,
        belief=bayes.prior(len(goals), model.prior_concerned, over_goals),
    )


def observe(mind: Mind, observation: PersonObservation, time: float, time_step: float) -> Mind:
    """Return the mind after one more observation at `time` s (later than the last one).

    Evidence is one action per `time_step` (s); an observation that comes later than three steps, or shows a
    displacement that no action explains, leaves the belief to its own relaxation.
    """
    covariance = _covariance(observation, mind.model)
    state = mind.habits and learning.update(mind.habits, time, observation.position, covariance)
    velocity = state.velocity if state is not None else _velocity(mind, observation, time)
    believed = _weigh(mind, observation.position, covariance, time, time_step)
    facing = mind.facing and mind.facing.at(time)
    if by_clearance(mind):
        believed = bayes.with_concern(believed, _concern(mind, facing, state, time))
    goals, over_goals = _goals(observation, mind.model, state, velocity)
    if len(goals) != len(mind.goals) or isinstance(goals[0], PointGoal) != isinstance(mind.goals[0], PointGoal):
        believed = bayes.prior(len(goals), believed.concerned, over_goals)
    anchor = mind.anchor
    if anchor is not None and (len(anchor.probabilities) != len(goals) or time - anchor.time >= 0.999 * time_step):
        anchor = None  # its evidence is in the belief now; the next prediction sets a new one
    return Mind(
        id=mind.id,
        model=mind.model,
        seen=time,
        measured=observation.position,
        covariance=covariance,
        position=observation.position if state is None else state.position,
        velocity=velocity,
        habits=state,
        goals=goals,
        belief=believed,
        anchor=anchor,
        facing=facing,
    )


def miss(mind: Mind, time: float) -> Mind:
    """Return the mind of someone not seen now: carried forward at their last velocity, the belief left to relax."""
    ahead = max(time - mind.seen, 0.0)
    start = mind.measured if mind.habits is None else mind.habits.position
    relaxed = bayes.relax(
        mind.belief,
        switch_rate=mind.model.switch_rate,
        prior_concerned=mind.model.prior_concerned,
        elapsed=ahead,
    )
    return replace(mind, position=frozen_array(start + ahead * mind.velocity), belief=relaxed, anchor=None)


def expect(mind: Mind, probabilities: FloatArray, velocities: FloatArray, time: float) -> Mind:
    """Return the mind with an anchor at `time` s, unless evidence is still being weighed against an older one.

    Args:
        mind: seen at `time`.
        probabilities: (G, 2, n) P(u|x; goal, β) under the plan that the person can anticipate now.
        velocities: (n, d) m/s, of these actions in the world frame.
        time: s.
    """
    if mind.anchor is not None or mind.seen != time:
        return mind
    anchor = Anchor(
        time=time,
        position=mind.measured,
        covariance=mind.covariance,
        probabilities=probabilities,
        velocities=velocities,
        belief=mind.belief,
    )
    return _with(mind, anchor, mind.facing)


def face(mind: Mind, way: Way, contact: float, time: float) -> Mind:
    """Return the mind with the robot's `way` known, and whether the person is on a collision course with it.

    Args:
        mind: seen at `time`; anybody else, and those whose β is learned from actions, are left as they are.
        way: of the robot.
        contact: m between centres at which bodies touch.
        time: s.
    """
    if mind.seen != time or mind.habits is None or not by_clearance(mind):
        return mind
    courses = () if mind.facing is None else mind.facing.courses
    facing = Facing(settings=mind.model.reaction, way=way, contact=contact, courses=courses)
    return _with(mind, mind.anchor, facing.noted(mind.habits, time))


def _with(mind: Mind, anchor: Anchor | None, facing: Facing | None) -> Mind:
    """The same mind with these; `replace` would take longer than Bayes' rule."""
    return Mind(
        id=mind.id,
        model=mind.model,
        seen=mind.seen,
        measured=mind.measured,
        covariance=mind.covariance,
        position=mind.position,
        velocity=mind.velocity,
        habits=mind.habits,
        goals=mind.goals,
        belief=mind.belief,
        anchor=anchor,
        facing=facing,
    )


def by_clearance(mind: Mind) -> bool:
    """Whether β of this person is learned from the clearance they gain, not from their last action."""
    learned = mind.model.evidence == "clearance" and mind.habits is not None
    return learned and isinstance(mind.goals[0], DirectionGoal)


def _concern(mind: Mind, facing: Facing | None, state: Habits | None, time: float) -> float:
    """P(β = 1) by the clearance gained since a collision course; relaxing where there was none of late."""
    model = mind.model
    told = None if facing is None or state is None else facing.log_ratio(state, time)
    if told is None:
        return bayes.relax(
            mind.belief,
            switch_rate=model.switch_rate,
            prior_concerned=model.prior_concerned,
            elapsed=max(time - mind.seen, 0.0),
        ).concerned
    odds = model.prior_concerned / (1.0 - model.prior_concerned) * math.exp(told)
    return odds / (1.0 + odds)


def _weigh(mind: Mind, position: Vector, covariance: FloatArray, time: float, time_step: float) -> Belief:
    """Eq. 8 against the anchor, after letting awareness change its mind."""
    anchor = mind.anchor
    model = mind.model
    since = mind.seen if anchor is None else anchor.time
    elapsed = max(time - since, 0.0)
    start = mind.belief if anchor is None else anchor.belief
    believed = bayes.relax(start, switch_rate=model.switch_rate, prior_concerned=model.prior_concerned, elapsed=elapsed)
    if anchor is None or not 0 < elapsed <= _STALE * time_step:
        return believed
    moved = position - anchor.position
    doubt = covariance + anchor.covariance + (model.action_noise * elapsed) ** 2 * identity(position.size)
    # by clearance: a displacement tells where to; whether they mind is told otherwise
    weighed = weigh_action(
        believed.weights, anchor.probabilities, anchor.velocities, moved, elapsed, doubt,
        min(elapsed / time_step, 1.0), by_clearance(mind),
    )  # fmt: skip
    believed = bayes.believed(weighed)
    if mind.habits is not None and isinstance(mind.goals[0], DirectionGoal):
        believed = bayes.relax_goals(believed, mind.habits.modes, _GOAL_RATE, elapsed)
    return believed


def _goals(
    observation: PersonObservation, model: HumanModel, state: Habits | None, velocity: Vector
) -> tuple[tuple[Goal, ...], FloatArray | None]:
    """Candidate goals and the prior over them (None: uniform)."""
    if observation.goal is not None and finite(observation.goal):
        return (PointGoal(observation.goal),), None
    fitting = [g for g in model.candidates if len(g) == observation.position.size] if model.goals else []
    if fitting:
        return tuple(PointGoal(g) for g in fitting), None
    if state is None:
        return (DirectionGoal(velocity), StandGoal()), np.array([0.95, 0.05])
    ahead, slowing = state.extrapolated_velocity, 0.0 if state.slow else state.settings.slowing_time
    ends = SlowingGoal(ahead, slowing) if slowing > 0 else StandGoal()
    return (DirectionGoal(ahead), DirectionGoal(state.mean_velocity), ends), state.modes


def _covariance(observation: PersonObservation, model: HumanModel) -> FloatArray:
    d = observation.position.size
    given = observation.position_covariance
    if given is not None and given.shape == (d, d) and finite(given.ravel()) and min(given.diagonal().tolist()) >= 0:
        return given
    return _isotropic(model.measurement_noise, d)


@lru_cache(maxsize=64)
def _isotropic(sigma: float, d: int) -> FloatArray:
    return frozen_array(np.eye(d) * sigma**2)


def _velocity(mind: Mind, observation: PersonObservation, time: float) -> Vector:
    """The observed velocity, or a difference of positions where the observation brings none."""
    if observation.velocity is not None and finite(observation.velocity):
        return observation.velocity
    return frozen_array((observation.position - mind.measured) / (time - mind.seen))
