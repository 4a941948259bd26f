"""Whether somebody makes room: made-up people whose intention is known by construction."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from alternatives import closest as naive
from sidestep import minds
from sidestep._kernels.closest import closest_approach
from sidestep.errors import InvalidInput
from sidestep.human.actions import ActionSet
from sidestep.human.model import HumanModel
from sidestep.human.observation import PersonObservation
from sidestep.human.reaction import ReactionSettings, Way
from sidestep.mind import Mind
from sidestep.types import FloatArray

ACTIONS = ActionSet(speed=0.5)
Walk = Callable[[float], tuple[float, float]]


def straight(t: float) -> tuple[float, float]:
    """Meets the robot at the origin at 6 s."""
    return 0.0, -1.3 * (6.0 - t)


def makes_room(t: float) -> tuple[float, float]:
    """The same, but slower from 2 s on: passes behind the robot."""
    return 0.0, -1.3 * 4.0 + 0.5 * (t - 2.0) if t > 2.0 else straight(t)[1]


def comes_nearer(t: float) -> tuple[float, float]:
    """Would pass 1 m behind the robot, then turns toward it."""
    late = max(t - 2.0, 0.0)
    return -1.0 + 0.25 * late, straight(t)[1]


def robot_from(t: float, until: float) -> FloatArray:
    """(17, 2) m every 0.5 s: 1 m/s along x, standing from `until` on."""
    return np.stack([np.minimum(t + 0.5 * np.arange(17), until) - 6.0, np.zeros(17)], axis=1)


def seen_by(
    walk: Walk,
    *,
    last: float = 4.0,
    step: float = 0.1,
    noise: float = 0.0,
    seed: int = 0,
    turn: float = 0.0,
    model: HumanModel | None = None,
    stops: float = math.inf,
) -> list[Mind]:
    """What is known after each look; the robot drives on, or at `stops` s decides to stay; all turned by `turn` rad."""
    rotation = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    rng = np.random.default_rng(seed)
    mind: Mind | None = None
    known: list[Mind] = []
    chosen = model or HumanModel(measurement_noise=max(noise, 0.03))
    for k in range(round(last / step) + 1):
        t = k * step
        seen = PersonObservation(id="a", position=rotation @ np.array(walk(t)) + rng.normal(0.0, noise, 2))
        mind = minds.meet(seen, chosen, t) if mind is None else minds.observe(mind, seen, t, 0.5)
        p = np.full((len(mind.goals), 2, len(ACTIONS)), 1.0 / len(ACTIONS))
        mind = minds.expect(mind, p, ACTIONS.velocities, t)
        ahead = robot_from(t, t if t >= stops else math.inf)
        mind = minds.face(mind, Way(time=t, positions=ahead @ rotation.T, step=0.5), 0.6, t)
        known.append(mind)
    return known


@settings(max_examples=60)
@given(seed=st.integers(0, 100_000), d=st.integers(1, 3))
def test_the_closest_approach_is_what_looking_very_often_finds(seed: int, d: int) -> None:
    rng = np.random.default_rng(seed)
    way = np.cumsum(rng.normal(0.0, 0.5, (int(rng.integers(1, 12)), d)), axis=0)
    case = (way, 0.5, float(rng.uniform(0.0, 7.0)), rng.normal(0.0, 3.0, d), rng.normal(0.0, 1.0, d), 4.0)
    for found in (closest_approach(*case), closest_approach.py_func(*case)):  # type: ignore[attr-defined]
        distance, when = naive.closest_approach(*case)
        assert found[0] == pytest.approx(distance, abs=2e-3)
        at_its_time = naive.closest_approach(way, 0.5, case[2] + found[1], case[3] + found[1] * case[4], case[4], 1e-9)
        assert at_its_time[0] == pytest.approx(found[0], abs=1e-6)
        assert abs(found[1] - when) < 0.05 or found[0] == pytest.approx(distance, abs=1e-3)


def test_who_makes_room_minds_the_robot_and_who_walks_on_does_not() -> None:
    assert seen_by(makes_room, last=3.0)[-1].belief.concerned > 0.75
    assert seen_by(straight)[-1].belief.concerned < 0.35
    assert seen_by(comes_nearer)[-1].belief.concerned < 0.35


def test_without_a_conflict_nothing_is_learned() -> None:
    walked_by = seen_by(lambda t: (3.0 + 1.3 * t, -5.0))  # turns nowhere, meets nobody
    turned = seen_by(lambda t: (3.0 + 1.3 * min(t, 2.0), -5.0 - max(t - 2.0, 0.0)))
    for known in (walked_by, turned):
        assert [m.belief.concerned for m in known] == pytest.approx([0.5] * len(known))


def test_what_the_robot_does_about_the_conflict_is_no_evidence() -> None:
    """The robot decides to stay; the person walks on as before, and now passes far from it: they made no room."""
    known = seen_by(straight, stops=2.5, last=3.0)
    assert known[-1].belief.concerned < 0.4


def test_belief_grows_with_the_clearance_gained() -> None:
    def slowing(by: float) -> Walk:
        return lambda t: (0.0, straight(t)[1] - by * max(t - 2.0, 0.0))

    found = [seen_by(slowing(by), last=3.0)[-1].belief.concerned for by in (0.0, 0.2, 0.4, 0.6, 0.8)]
    assert found == sorted(found)
    assert found[-1] - found[0] > 0.4


@pytest.mark.parametrize("turn", [0.7, 2.0, -2.6])
def test_a_turned_scene_is_believed_alike(turn: float) -> None:
    for walk in (makes_room, straight):
        ours = [m.belief.concerned for m in seen_by(walk)]
        assert [m.belief.concerned for m in seen_by(walk, turn=turn)] == pytest.approx(ours, abs=1e-6)


def test_the_sensors_rate_hardly_matters() -> None:
    for walk, low, high in ((makes_room, 0.6, 1.0), (straight, 0.0, 0.4)):
        found = [seen_by(walk, last=3.0, step=step)[-1].belief.concerned for step in (0.05, 0.1, 0.25)]
        assert low < min(found)
        assert max(found) < high


def test_a_noisy_sensor_makes_nobody_concerned() -> None:
    for noise in (0.1, 0.2):
        known = [seen_by(straight, noise=noise, seed=seed, last=3.4)[-8:] for seed in range(6)]
        beliefs = np.array([m.belief.concerned for minds_of in known for m in minds_of])
        assert beliefs.mean() < 0.5
        assert (beliefs > 0.8).mean() < 0.1


def test_what_was_learned_is_kept_when_the_conflict_is_over_and_fades() -> None:
    model = HumanModel(switch_rate=0.1)
    known = seen_by(makes_room, last=3.2, model=model)
    peak = max(m.belief.concerned for m in known)
    mind = replace(known[-1], facing=None)
    seen = PersonObservation(id="a", position=np.array(makes_room(3.3)))
    assert minds.observe(mind, seen, 3.3, 0.5).belief.concerned == pytest.approx(mind.belief.concerned, abs=0.02)
    assert 0.5 < minds.miss(mind, 5.0).belief.concerned < peak


def test_actions_are_the_evidence_where_the_model_says_so_or_the_goal_is_known() -> None:
    model = HumanModel(evidence="action")
    assert all(m.facing is None for m in seen_by(makes_room, model=model, last=1.0))
    seen = PersonObservation(id="a", position=(0.0, 0.0), velocity=(1.0, 0.0), goal=(5.0, 0.0))
    assert not minds.meet(seen, HumanModel(), 0.0).by_clearance
    assert not seen_by(straight, last=0.0, model=HumanModel(motion_filter=False))[-1].by_clearance


@pytest.mark.parametrize(
    ("name", "value"), [("window", 0.0), ("gained", math.nan), ("undecided", 1.0), ("slowest", -1)]
)
def test_wrong_constants_are_named(name: str, value: float) -> None:
    with pytest.raises(InvalidInput, match=f"human.reaction.{name}"):
        ReactionSettings(**{name: value})


def test_who_has_cleared_the_way_is_remembered_for_having_done_so() -> None:
    """Two seconds after the turn nobody is on a collision course any more; what they did about it still counts."""
    kept = seen_by(makes_room, last=4.4)
    forgetful = HumanModel(reaction=replace(ReactionSettings(), remembered=0.0))
    lost = seen_by(makes_room, last=4.4, model=forgetful)
    assert lost[-1].belief.concerned < max(mind.belief.concerned for mind in lost) - 0.05
    assert kept[-1].belief.concerned > max(mind.belief.concerned for mind in kept) - 0.01
    assert kept[-1].belief.concerned > lost[-1].belief.concerned + 0.05
