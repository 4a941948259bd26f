"""What the planner keeps of each person between two calls: habits, belief, and what they were expected to do."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from sidestep import belief as bayes
from sidestep.evidence import concern, weighed
from sidestep.human import habits as learning
from sidestep.human.goals import DirectionGoal, Goal, PointGoal, SlowingGoal, StandGoal
from sidestep.human.habits import Habits
from sidestep.human.model import HumanModel
from sidestep.human.observation import PersonObservation
from sidestep.human.reaction import Facing, Way
from sidestep.mind import Anchor, Mind
from sidestep.types import INSTANT, FloatArray, Vector, finite, frozen_array, plausible


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

    People who share an id are told apart by primes: "a", "a'". A position that is not finite, or older than `memory`,
    counts as not seen. Whose id is now somebody else's, who is where nobody could have walked to, is met anew. An
    observation that was made before the last one tells nothing new.

    Raises:
        Unplaceable: a position, velocity or goal has the wrong dimension, a position was never one within `memory`, or
            somebody is told of in another way than is asked for.
    """
    present: dict[str, Mind] = {}
    _check_many(people)
    for seen in people:
        _check_kind(seen)
        name = seen.id
        _check_id(name)
        while name in present:
            name = f"{name}'"
        before = known.get(name)
        _check_dimension(seen, dimension)
        when, given = time - _age(seen), seen.model or model
        if not (plausible(seen.position) and time - when <= memory):
            if before is None or time - before.seen > memory:
                old = f", {seen.age:.3g} s old" if seen.age else ""
                raise Unplaceable(f"person {seen.id!r}: position is {seen.position.tolist()}{old}")
            present[name] = miss(before, time)
        elif before is None or not _same_but_goals(before.model, given) or _anew(before, seen, when):
            present[name] = replace(meet(seen, given, time), id=name)
        elif when > before.seen + INSTANT:
            same = before.model is given or before.model == given
            known_as = before if same else replace(before, model=given)
            present[name] = observe(known_as, seen, time, time_step)
        elif time > before.told:  # nothing new, but somebody is there
            present[name] = replace(miss(before, time), anchor=before.anchor, told=time)
        else:
            present[name] = before  # asked again in the same instant
    for name, before in known.items():
        if name not in present and time - before.seen <= memory:
            present[name] = miss(before, time)
    return present


def coordinates_of(vector: Vector) -> str:
    """Say how many coordinates a place has that has not as many as it should."""
    return f"{vector.size} coordinates" if vector.ndim < 2 else f"the shape {vector.shape}"


def _check_many(people: object) -> None:
    """Raise `Unplaceable` unless these are several."""
    if not isinstance(people, Iterable):
        raise Unplaceable(f"people is one {type(people).__name__}, not a list of PersonObservation")


def _check_kind(seen: object) -> None:
    """Raise `Unplaceable` unless this is an observation of somebody."""
    if not isinstance(seen, PersonObservation):
        raise Unplaceable(f"there is a {type(seen).__name__} among people, not a PersonObservation")


def _check_id(name: object) -> None:
    """Raise `Unplaceable` unless somebody can be found again by this id."""
    if not isinstance(name, Hashable):
        raise Unplaceable(f"the id of a person is a {type(name).__name__}, not a text")


def _check_dimension(seen: PersonObservation, dimension: int) -> None:
    """Raise `Unplaceable` unless all that is told of somebody is of this dimension."""
    for what, vector in (("position", seen.position), ("velocity", seen.velocity), ("goal", seen.goal)):
        if vector is not None and vector.shape != (dimension,):
            raise Unplaceable(f"person {seen.id!r}: {what} has {coordinates_of(vector)}, not {dimension}")


def _same_but_goals(one: HumanModel, other: HumanModel) -> bool:
    """Whether two models differ at most in their candidate goals: what is believed of awareness is worth keeping."""
    return one is other or one == other or replace(one, goals=()) == replace(other, goals=())


def _age(seen: PersonObservation) -> float:
    """S since somebody was measured; nobody is from the future."""
    return 0.0 if seen.age < 0.0 else seen.age


def _anew(mind: Mind, seen: PersonObservation, time: float) -> bool:
    """Whether somebody else bore this name at `time` s, or nothing known counts any more after so long."""
    covariance = _covariance(seen, mind.model)
    if mind.habits is None or time <= mind.seen:
        return False
    return learning.begins_anew(mind.habits, time, seen.position, covariance)


def meet(observation: PersonObservation, model: HumanModel, time: float) -> Mind:
    """Return a mind, at `time` s, for someone who was never seen before (or whose past no longer counts)."""
    age, covariance = _age(observation), _covariance(observation, model)
    known = _known(observation.velocity)
    velocity = np.zeros(observation.position.size) if known is None else known
    state = None
    if model.motion_filter:
        state = learning.meet(
            time - age,
            observation.position,
            covariance,
            velocity=known,
            velocity_covariance=observation.velocity_covariance,
            settings=model.habits,
        )
    goals, over_goals = _goals(observation, model, state, velocity)
    return Mind(
        id=observation.id,
        model=model,
        seen=time - age,
        told=time,
        measured=observation.position,
        covariance=covariance,
        position=_ahead(observation.position, velocity, age) if state is None else state.position_at(time),
        velocity=frozen_array(velocity if state is None else state.velocity),
        habits=state,
        goals=goals,
        belief=bayes.prior(len(goals), model.prior_concerned, over_goals),
        unseen=age,
    )


def observe(mind: Mind, observation: PersonObservation, time: float, time_step: float) -> Mind:
    """Return the mind, at `time` s, after one more observation, made later than the last one.

    Evidence is one action per `time_step` (s); an observation that comes later than three steps, or shows a
    displacement that no action explains, leaves the belief to its own relaxation.
    """
    age, covariance = _age(observation), _covariance(observation, mind.model)
    when = time - age
    state = mind.habits and learning.update(mind.habits, when, observation.position, covariance)
    velocity = state.velocity if state is not None else _velocity(mind, observation, when)
    believed = weighed(mind, observation.position, covariance, time, time_step, age=age)
    facing = mind.facing and mind.facing.at(time)
    if mind.by_clearance:
        believed = bayes.with_concern(believed, concern(mind, facing, state, time))
    goals, over_goals = _goals(observation, mind.model, state, velocity)
    if len(goals) != len(mind.goals) or isinstance(goals[0], PointGoal) != isinstance(mind.goals[0], PointGoal):
        believed = bayes.prior(len(goals), believed.concerned, over_goals)
    anchor = mind.anchor
    if anchor is not None and (len(anchor.probabilities) != len(goals) or when - anchor.time >= 0.999 * time_step):
        anchor = None  # its evidence is in the belief now; the next prediction sets a new one
    return Mind(
        id=mind.id,
        model=mind.model,
        seen=when,
        told=time,
        measured=observation.position,
        covariance=covariance,
        position=_ahead(observation.position, velocity, age) if state is None else state.position_at(time),
        velocity=velocity,
        habits=state,
        goals=goals,
        belief=believed,
        anchor=anchor,
        facing=facing,
        unseen=age,
    )


def miss(mind: Mind, time: float) -> Mind:
    """Return the mind of someone not seen now: carried forward at their last velocity, the belief left to relax."""
    ahead = max(time - mind.seen, 0.0)
    start = mind.measured if mind.habits is None else mind.habits.position
    relaxed = bayes.relax(
        mind.belief,
        switch_rate=mind.model.switch_rate,
        prior_concerned=mind.model.prior_concerned,
        elapsed=ahead - mind.unseen,
    )
    place = frozen_array(start + ahead * mind.velocity)
    return replace(mind, position=place, belief=relaxed, anchor=None, unseen=ahead)


def expect(mind: Mind, probabilities: FloatArray, velocities: FloatArray, time: float) -> Mind:
    """Return the mind with an anchor where it was last measured, unless evidence is being weighed against an older one.

    Args:
        mind: told of at `time`; anybody else is left as they are.
        probabilities: (G, 2, n) P(u|x; goal, β) under the plan that the person can anticipate now.
        velocities: (n, d) m/s, of these actions in the world frame.
        time: s.
    """
    if mind.anchor is not None or mind.told != time:
        return mind
    anchor = Anchor(
        time=mind.seen,
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
        mind: told of at `time`; anybody else, and those whose β is learned from actions, are left as they are.
        way: of the robot.
        contact: m between centres at which bodies touch.
        time: s.
    """
    if mind.told != time or mind.habits is None or not mind.by_clearance:
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
        told=mind.told,
        measured=mind.measured,
        covariance=mind.covariance,
        position=mind.position,
        velocity=mind.velocity,
        habits=mind.habits,
        goals=mind.goals,
        belief=mind.belief,
        anchor=anchor,
        facing=facing,
        unseen=mind.unseen,
    )


def _ahead(position: Vector, velocity: Vector, age: float) -> Vector:
    """(d,) m, `age` s later at this velocity."""
    return position if age == 0.0 else frozen_array(position + age * velocity)


def _goals(
    observation: PersonObservation, model: HumanModel, state: Habits | None, velocity: Vector
) -> tuple[tuple[Goal, ...], FloatArray | None]:
    """Candidate goals and the prior over them (None: uniform)."""
    told = observation.goal
    if told is not None and plausible(told) and not (state is not None and state.off_course(told)):
        return (PointGoal(told),), None
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


def _known(velocity: Vector | None) -> Vector | None:
    """An observed velocity; None where there is none, or none that can be."""
    return velocity if velocity is not None and plausible(velocity) else None


def _velocity(mind: Mind, observation: PersonObservation, time: float) -> Vector:
    """The observed velocity, or a difference of positions where the observation brings none."""
    known = _known(observation.velocity)
    if known is not None:
        return known
    return frozen_array((observation.position - mind.measured) / (time - mind.seen))
