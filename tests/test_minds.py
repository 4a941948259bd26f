"""What is remembered of a person between two calls."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sidestep import belief as bayes
from sidestep import minds
from sidestep.human.actions import ActionSet
from sidestep.human.goals import DirectionGoal, PointGoal, SlowingGoal, StandGoal
from sidestep.human.habit_settings import HabitSettings
from sidestep.human.model import HumanModel
from sidestep.human.observation import PersonObservation
from sidestep.human.reaction import Way
from sidestep.mind import Mind

PAPER = HumanModel(
    frame="world", motion_filter=False, steadiness=False, online_randomness=False, switch_rate=0, action_noise=0.05
)
STEP = 0.5
ACTIONS = ActionSet(speed=0.5)


def sees(position: tuple[float, float], **more: object) -> PersonObservation:
    return PersonObservation(id="a", position=position, goal=(9.0, 0.0), **more)  # type: ignore[arg-type]


def expecting(mind: Mind, concerned: tuple[float, float], unconcerned: tuple[float, float], time: float) -> Mind:
    """An anchor at which the two kinds of people would act differently (ω = 0.2)."""
    p = np.full((1, 2, len(ACTIONS)), 0.2 / len(ACTIONS))
    for b, u in ((1, concerned), (0, unconcerned)):
        p[0, b, int(np.argmin(((ACTIONS.velocities - u) ** 2).sum(axis=1)))] += 0.8
    return minds.expect(mind, p, ACTIONS.velocities, time)


def walk(u: tuple[float, float], calls: int) -> Mind:
    mind = expecting(minds.meet(sees((0.0, 0.0)), PAPER, 0.0), (0.0, 1.0), (1.0, 0.0), 0.0)
    for i in range(1, calls + 1):
        t = STEP * i / calls
        mind = minds.observe(mind, sees((u[0] * t, u[1] * t)), t, STEP)
    return mind


def test_the_two_kinds_are_told_apart() -> None:
    assert walk((0.0, 1.0), 1).belief.concerned > 0.9
    assert walk((1.0, 0.0), 1).belief.concerned < 0.1


@pytest.mark.parametrize("calls", [2, 5, 20])
def test_evidence_of_one_step_is_the_same_at_any_rate(calls: int) -> None:
    assert walk((0.0, 1.0), calls).belief.concerned == pytest.approx(walk((0.0, 1.0), 1).belief.concerned, abs=0.02)


def test_a_new_anchor_is_set_only_after_a_whole_step() -> None:
    half = expecting(minds.meet(sees((0.0, 0.0)), PAPER, 0.0), (0.0, 1.0), (1.0, 0.0), 0.0)
    half = minds.observe(half, sees((0.25, 0.0)), 0.25, STEP)
    assert half.anchor is not None
    assert expecting(half, (1.0, 0.0), (0.0, 1.0), 0.25).anchor is half.anchor
    whole = minds.observe(half, sees((0.5, 0.0)), 0.5, STEP)
    assert whole.anchor is None


@pytest.mark.parametrize("where", [(30.0, 0.0), (0.0, -12.0)])
def test_a_displacement_that_nobody_makes_is_no_evidence(where: tuple[float, float]) -> None:
    mind = expecting(minds.meet(sees((0.0, 0.0)), PAPER, 0.0), (0.0, 1.0), (1.0, 0.0), 0.0)
    assert minds.observe(mind, sees(where), STEP, STEP).belief.concerned == pytest.approx(0.5)


@pytest.mark.parametrize("model", [PAPER, HumanModel()])
def test_asked_again_in_the_same_instant_nothing_is_forgotten_or_learned_twice(model: HumanModel) -> None:
    met = partial(minds.met, model=model, dimension=2, time_step=STEP, memory=1.0)
    known = {"a": expecting(met({}, [sees((0.0, 0.0))], 0.0)["a"], (0.0, 1.0), (1.0, 0.0), 0.0)}
    assert met(known, [sees((0.0, 0.0))], 0.0)["a"] is known["a"]
    known = met(known, [sees((0.3, 0.0))], 0.25)
    assert met(known, [sees((0.3, 0.0))], 0.25)["a"] is known["a"]


def test_a_late_observation_leaves_the_belief_or_relaxes_it() -> None:
    mind = walk((0.0, 1.0), 1)
    mind = expecting(mind, (0.0, 1.0), (1.0, 0.0), STEP)
    late = minds.observe(mind, sees((3.0, 0.5)), STEP + 10.0, STEP)
    assert late.belief.concerned == pytest.approx(mind.belief.concerned)
    forgetful = HumanModel(frame="world", motion_filter=False, switch_rate=0.1)
    other = minds.meet(sees((0.0, 0.0)), forgetful, 0.0)
    missed = minds.miss(other, 100.0)
    assert missed.belief.concerned == pytest.approx(0.5)


def test_someone_not_seen_is_carried_forward() -> None:
    mind = minds.meet(sees((1.0, 2.0), velocity=(0.5, -0.5)), PAPER, 3.0)
    np.testing.assert_allclose(minds.miss(mind, 5.0).position, (2.0, 1.0))


@pytest.mark.parametrize(("told", "known"), [((0.3, 0.1), (0.3, 0.1)), (None, (1.0, -0.4))])
def test_without_a_filter_the_velocity_is_the_one_told_or_that_of_the_way_since(
    told: tuple[float, float] | None, known: tuple[float, float]
) -> None:
    before = minds.meet(sees((3.0, 2.0)), PAPER, 1.0)
    mind = minds.observe(before, sees((3.5, 1.8), velocity=told), 1.5, STEP)
    assert mind.velocity == pytest.approx(known)


@pytest.mark.parametrize(("where", "when"), [((-3.0, 2.0), 0.2), ((0.3, 0.0), 4.0)])
def test_somebody_else_under_a_known_name_is_met_as_they_are_seen(where: tuple[float, float], when: float) -> None:
    """Where a tracker swaps ids, who walks was taken to stand: their velocity was not looked at."""
    model = HumanModel()
    met = partial(minds.met, model=model, dimension=2, time_step=STEP, memory=10.0)
    first = PersonObservation(id="a", position=(0.0, 0.0), velocity=(1.2, 0.0))
    known = met({}, [first], 0.0)
    trusted = {"a": replace(known["a"], belief=bayes.with_concern(known["a"].belief, 0.99))}
    other = PersonObservation(id="a", position=where, velocity=(0.0, -1.3))
    (now,) = met(trusted, [other], when).values()
    np.testing.assert_allclose(now.velocity, (0.0, -1.3))
    np.testing.assert_allclose(now.position, where)
    assert now.belief.concerned == pytest.approx(model.prior_concerned)
    assert now.facing is None


def test_the_longer_somebody_is_not_seen_the_less_is_known_of_where_they_are() -> None:
    """They were predicted from where they would be, as sharply as if they had been seen there."""
    model = HumanModel()
    mind = minds.meet(PersonObservation(id="a", position=(0.0, 0.0), velocity=(1.2, 0.0)), model, 0.0)
    for k in range(1, 20):
        seen = PersonObservation(id="a", position=(0.24 * k, 0.0), velocity=(1.2, 0.0))
        mind = minds.observe(mind, seen, 0.2 * k, STEP)
    told, foretold = mind.spread(np.array([0.9, 2.0])), mind.position_covariance
    lost = minds.miss(mind, mind.seen + 0.9)
    now = lost.spread(np.array([0.0, 1.1]))
    assert told is not None
    assert now is not None
    np.testing.assert_allclose(now[1], told[1])
    assert lost.position_covariance[0, 0] > foretold[0, 0] + float(told[0] @ told[1][0] ** 2) - 1e-12
    back = minds.observe(lost, PersonObservation(id="a", position=(4.56 + 1.3, 0.0)), mind.seen + 1.0, STEP)
    assert back.unseen == 0.0


@pytest.mark.parametrize("learned", [True, False])
def test_what_is_believed_of_somebody_out_of_view_fades_with_the_time_that_passes_not_with_the_calls(
    learned: bool,
) -> None:
    """At every call the whole time since they were seen was counted once more: at 50 Hz a second was as long as 25."""
    model = HumanModel(switch_rate=0.1, motion_filter=learned, steadiness=learned, online_randomness=learned)
    met = partial(minds.met, model=model, dimension=2, time_step=STEP, memory=10.0)
    seen = PersonObservation(id="a", position=(0.0, 0.0), velocity=(1.2, 0.0))
    back = PersonObservation(id="a", position=(2.4, 0.0), velocity=(1.2, 0.0))
    (first,) = met({}, [seen], 0.0).values()
    for rate in (1, 10, 50):
        known = {"a": replace(first, belief=bayes.with_concern(first.belief, 0.99))}
        for call in range(1, rate + 1):
            known = met(known, [], call / rate)
        assert known["a"].belief.concerned == pytest.approx(0.5 + 0.49 * np.exp(-0.2))
        known = met(known, [back], 2.0)
        assert known["a"].belief.concerned == pytest.approx(0.5 + 0.49 * np.exp(-0.4))


def test_only_who_is_seen_is_taken_to_have_seen_where_the_robot_goes() -> None:
    coming = PersonObservation(id="a", position=(3.0, 0.0), velocity=(-1.2, 0.0))
    seen = minds.meet(coming, HumanModel(), 1.0)
    lost = minds.miss(seen, 1.2)
    way = Way(time=1.2, positions=np.array([[0.5 * k, 0.0] for k in range(9)]), step=STEP)
    assert minds.face(lost, way, 0.6, 1.2) is lost
    assert minds.face(seen, replace(way, time=1.0), 0.6, 1.0).facing is not None


def test_goals_are_given_listed_or_directions() -> None:
    assert isinstance(minds.meet(sees((0.0, 0.0)), HumanModel(), 0.0).goals[0], PointGoal)
    listed = HumanModel(goals=((1.0, 0.0), (0.0, 1.0), (1.0, 1.0)))
    stranger = PersonObservation(id="b", position=(0.0, 0.0), velocity=(1.0, 0.0))
    places = [g.position.tolist() for g in minds.meet(stranger, listed, 0.0).goals if isinstance(g, PointGoal)]
    assert places == [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]
    kinds = [type(g) for g in minds.meet(stranger, HumanModel(), 0.0).goals]
    assert kinds == [DirectionGoal, DirectionGoal, SlowingGoal]
    abrupt = HumanModel(habits=HabitSettings(slowing_time=0.0))
    assert isinstance(minds.meet(stranger, abrupt, 0.0).goals[2], StandGoal)
    stander = PersonObservation(id="c", position=(0.0, 0.0), velocity=(0.0, 0.0))
    assert isinstance(minds.meet(stander, HumanModel(), 0.0).goals[2], StandGoal)


@pytest.mark.parametrize(
    ("velocity", "heeded"),
    [
        ((1.0, 0.0), True),
        ((0.7, 0.7), True),  # a sidestep
        ((0.4, 0.9), False),
        ((-1.0, 0.0), False),
        ((-0.1, 0.1), True),  # who stands heads nowhere
        (None, True),
    ],
)
def test_a_told_goal_counts_while_nobody_walks_elsewhere(velocity: tuple[float, float] | None, heeded: bool) -> None:
    """`sees` tells of a goal at (9, 0)."""
    mind = minds.meet(sees((0.0, 0.0), velocity=velocity), HumanModel(), 0.0)
    assert isinstance(mind.goals[0], PointGoal) == heeded
    trusting = HumanModel(habits=HabitSettings(off_course=np.pi))
    assert isinstance(minds.meet(sees((0.0, 0.0), velocity=velocity), trusting, 0.0).goals[0], PointGoal)
    assert isinstance(minds.meet(sees((0.0, 0.0), velocity=velocity), PAPER, 0.0).goals[0], PointGoal)
    near = minds.meet(sees((8.5, 0.0), velocity=velocity), HumanModel(), 0.0)
    assert isinstance(near.goals[0], PointGoal)  # less than a second away nobody can tell


def test_who_turns_away_from_a_told_goal_and_back_is_predicted_by_what_they_do() -> None:
    """The belief about awareness is kept over both changes."""
    kinds: list[bool] = []
    mind, place = minds.meet(sees((0.0, 0.0), velocity=(1.0, 0.0)), HumanModel(), 0.0), np.zeros(2)
    mind = replace(mind, belief=bayes.prior(1, 0.9))
    for k in range(1, 61):
        pace = (0.0, 1.0) if 20 < k <= 40 else (1.0, 0.0)
        place = place + 0.1 * np.array(pace)
        mind = minds.observe(mind, sees(tuple(place), velocity=pace), 0.1 * k, STEP)
        assert mind.belief.concerned > 0.5
        kinds.append(isinstance(mind.goals[0], PointGoal))
    assert all(kinds[:20])
    assert not any(kinds[24:40])  # found out within half a second
    assert all(kinds[45:])


def test_other_candidate_goals_leave_awareness_and_habits_as_they_are_known() -> None:
    """Who stops is no longer said to be on the way to one of some places; what was learned of them stays."""
    human = HumanModel()
    walking = replace(human, goals=((5.0, 0.0), (0.0, 5.0)))

    def met_after(model: HumanModel | None) -> minds.Mind:
        first = PersonObservation(id="a", position=(0.0, 0.0), velocity=(1.0, 0.0), model=walking)
        mind = minds.meet(first, walking, 0.0)
        sure = replace(mind, belief=bayes.prior(2, 0.9))
        seen = PersonObservation(id="a", position=(0.5, 0.0), velocity=(1.0, 0.0), model=model)
        return minds.met({"a": sure}, [seen], 0.5, model=human, dimension=2, time_step=STEP, memory=1.0)["a"]

    kept, changed = met_after(walking), met_after(None)
    assert len(changed.goals) == 3
    assert changed.model == human
    assert changed.belief.concerned == pytest.approx(kept.belief.concerned)
    assert changed.belief.concerned > 0.85
    np.testing.assert_array_equal(changed.velocity, kept.velocity)
    afresh = met_after(replace(walking, danger_weight=1.0))
    assert afresh.belief.concerned == 0.5  # somebody else's model: what was believed under the other one does not count


def test_spread_grows_with_time_and_with_noise() -> None:
    times = np.array([0.0, 0.5, 1.0, 4.0])
    calm = minds.meet(PersonObservation(id="b", position=(0.0, 0.0), velocity=(1.0, 0.0)), HumanModel(), 0.0)
    noisy = minds.meet(
        PersonObservation(id="b", position=(0.0, 0.0), velocity=(1.0, 0.0), position_covariance=np.eye(2) * 0.04),
        HumanModel(),
        0.0,
    )
    weights, sigmas = calm.spread(times) or (np.zeros(0), np.zeros(0))
    assert weights.sum() == pytest.approx(1)
    assert (np.diff(sigmas, axis=0) > 0).all()
    assert (noisy.spread(times)[1] > sigmas).all()  # type: ignore[index]
    assert minds.meet(sees((0.0, 0.0)), PAPER, 0.0).spread(times) is None


@settings(max_examples=40)
@given(seed=st.integers(0, 100_000))
def test_whatever_is_seen_the_belief_stays_a_probability(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mind = minds.meet(PersonObservation(id="b", position=rng.normal(size=2), velocity=None), HumanModel(), 0.0)
    t = 0.0
    for _ in range(12):
        p = rng.dirichlet(np.ones(len(ACTIONS)), size=(len(mind.goals), 2))
        mind = minds.expect(mind, p, ACTIONS.velocities, t)
        t += float(rng.choice([0.01, 0.1, 0.5, 0.7, 5.0]))
        seen = PersonObservation(id="b", position=rng.normal(size=2) * rng.choice([1.0, 1e3]), velocity=None)
        mind = minds.observe(mind, seen, t, STEP)
        assert 0 < mind.belief.concerned < 1
        assert np.isfinite(mind.position).all()
        assert np.isfinite(mind.velocity).all()
