"""People of whom the planner is told late (`PersonObservation.age`)."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import pytest

import sidestep
from sidestep import minds
from sidestep.human.actions import ActionSet
from sidestep.human.model import HumanModel
from sidestep.human.observation import PersonObservation
from sidestep.human.reaction import Way
from sidestep.mind import Mind

PAPER = HumanModel(
    frame="world", motion_filter=False, steadiness=False, online_randomness=False, switch_rate=0, action_noise=0.05
)
STEP = 0.5
ACTIONS = ActionSet(speed=0.5)


def walker(t: float, age: float = 0.0) -> PersonObservation:
    """Somebody who walks along x at 1.2 m/s, as they were `age` s before t (s)."""
    return PersonObservation(id="a", position=(1.2 * (t - age), 0.0), velocity=(1.2, 0.0), age=age)


def watched(model: HumanModel, age: float, *, until: float = 3.0, every: float = 0.1) -> Mind:
    known: dict[str, Mind] = {}
    for t in np.arange(0.0, until + 1e-9, every):
        known = minds.met(known, [walker(t, age)], t, model=model, dimension=2, time_step=STEP, memory=1.0)
    return known["a"]


@pytest.mark.parametrize("model", [HumanModel(), PAPER, HumanModel(motion_filter=False)])
def test_who_is_told_of_late_is_carried_forward_and_doubted_like_somebody_not_seen_since(model: HumanModel) -> None:
    now, late = watched(model, 0.0), watched(model, 0.3)
    np.testing.assert_allclose(late.position, (3.6, 0.0), atol=0.02)
    np.testing.assert_allclose(late.velocity, now.velocity, atol=0.05)
    lost = minds.miss(watched(model, 0.0, until=2.7), 3.0)
    np.testing.assert_allclose(late.position, lost.position, atol=1e-9)
    np.testing.assert_allclose(late.position_covariance, lost.position_covariance, rtol=0.05, atol=1e-9)
    told, foretold = late.spread(np.array([0.0, 1.0])), now.spread(np.array([0.3, 1.3]))
    assert (told is None) == (foretold is None)
    if told is not None and foretold is not None:
        np.testing.assert_allclose(told[1], foretold[1], rtol=0.05)
        assert late.position_covariance[0, 0] > now.position_covariance[0, 0]


@pytest.mark.parametrize("age", [0.0, 0.1, 0.4])
@pytest.mark.parametrize(("way", "minds_it"), [((0.0, 1.0), True), ((1.0, 0.0), False)])
def test_what_an_action_tells_is_the_same_however_late(age: float, way: tuple[float, float], minds_it: bool) -> None:
    """Whoever minds the robot would go along y, others along x; calls every 0.1 s."""
    met = partial(minds.met, model=PAPER, dimension=2, time_step=STEP, memory=1.0)
    p = np.full((1, 2, len(ACTIONS)), 0.2 / len(ACTIONS))
    for b, u in ((1, (0.0, 1.0)), (0, (1.0, 0.0))):
        p[0, b, int(np.argmin(((ACTIONS.velocities - u) ** 2).sum(axis=1)))] += 0.8
    known: dict[str, Mind] = {}
    for k in range(6):
        place = 0.1 * k * np.array(way)
        told = PersonObservation(id="a", position=place, velocity=way, goal=(9.0, 0.0), age=age)
        known = met(known, [told], 0.1 * k + age)
        known["a"] = minds.expect(known["a"], p, ACTIONS.velocities, 0.1 * k + age)
    assert (known["a"].belief.concerned > 0.9) if minds_it else (known["a"].belief.concerned < 0.1)


@pytest.mark.parametrize("aside", [0.0, 0.6])
def test_clearance_that_is_gained_tells_as_much_however_late(aside: float) -> None:
    """Somebody comes toward the robot, 0.2 m beside its way, and from 1 s on moves `aside` (m/s)."""

    def concerned(age: float) -> float:
        mind: Mind | None = None
        for t in np.arange(0.0, 3.0, 0.1):
            place = (6.0 - 1.2 * (t - age), 0.2 + aside * max(t - age - 1.0, 0.0))
            seen = PersonObservation(id="a", position=place, age=age)
            mind = minds.meet(seen, HumanModel(), t) if mind is None else minds.observe(mind, seen, t, STEP)
            ahead = np.stack([t - 6.0 + STEP * np.arange(17), np.zeros(17)], axis=1)
            mind = minds.face(mind, Way(time=t, positions=ahead, step=STEP), 0.6, t)
        assert mind is not None
        assert mind.by_clearance
        return mind.belief.concerned

    now, late = concerned(0.0), concerned(0.3)
    assert (now > 0.6, late > 0.6) == (aside > 0.0, aside > 0.0)
    assert late == pytest.approx(now, abs=0.12)


@pytest.mark.parametrize("model", [HumanModel(), PAPER])
def test_a_tracker_slower_than_the_planner_tells_nothing_new_but_that_somebody_is_there(model: HumanModel) -> None:
    """Measured 5 times a second, called 20 times: between them they walk on, and what they do is still weighed."""
    met = partial(minds.met, model=model, dimension=2, time_step=STEP, memory=1.0)
    known: dict[str, Mind] = {}
    for k in range(41):
        t, age = 0.05 * k, 0.05 * (k % 4)
        known = met(known, [walker(t, age)], t)
        mind = known["a"]
        np.testing.assert_allclose(mind.position, (1.2 * t, 0.0), atol=0.02)
        assert (mind.seen, mind.told, mind.unseen) == pytest.approx((t - age, t, age))
        p = np.full((len(mind.goals), 2, len(ACTIONS)), 1.0 / len(ACTIONS))
        known["a"] = minds.expect(mind, p, ACTIONS.velocities, t)
        assert known["a"].anchor is not None


def test_what_was_measured_before_what_is_known_tells_nothing_new() -> None:
    met = partial(minds.met, model=HumanModel(), dimension=2, time_step=STEP, memory=1.0)
    known = met({}, [walker(0.0)], 0.0)
    known = met(known, [walker(0.4)], 0.4)
    stray = PersonObservation(id="a", position=(-3.0, 2.0), age=0.35)
    after = met(known, [stray], 0.5)["a"]
    np.testing.assert_allclose(after.position, minds.miss(known["a"], 0.5).position)
    assert (after.seen, after.told) == (0.4, 0.5)


@pytest.mark.parametrize(("age", "said"), [(1.5, ", 1.5 s old"), (math.nan, ", nan s old"), (math.inf, ", inf s old")])
def test_what_is_older_than_the_memory_is_not_where_anybody_is(age: float, said: str) -> None:
    base = sidestep.Holonomic(max_speed=1.0, radius=0.3)
    one = sidestep.Planner(robot=base, goal=(0.0, 5.0), horizon=4)
    state = sidestep.RobotState(position=(0.0, -5.0))
    plan = one.step(time=0.0, robot=state, people=[PersonObservation(id="a", position=(1.0, 2.0), age=age)])
    assert plan.status == "stopped"
    assert plan.reason == f"person 'a': position is [1.0, 2.0]{said}"
    one.step(time=0.1, robot=state, people=[walker(0.1)])
    plan = one.step(time=0.5, robot=state, people=[PersonObservation(id="a", position=(1.0, 2.0), age=age)])
    assert plan.status == "certified"


def test_nobody_is_measured_in_the_future() -> None:
    def met(age: float) -> Mind:
        seen = PersonObservation(id="a", position=(1.0, 2.0), velocity=(1.0, 0.0), age=age)
        return minds.met({}, [seen], 3.0, model=HumanModel(), dimension=2, time_step=STEP, memory=1.0)["a"]

    np.testing.assert_array_equal(met(-0.2).position, (1.0, 2.0))
    assert met(-0.2).seen == met(0.0).seen == 3.0


@pytest.mark.parametrize("age", ["soon", None, True, (0.1,)])
def test_an_age_that_is_no_number_is_refused_in_one_line(age: object) -> None:
    with pytest.raises(sidestep.InvalidInput, match="person 'a': age"):
        PersonObservation(id="a", position=(0.0, 0.0), age=age)  # type: ignore[arg-type]


def test_ages_are_numbers_of_any_kind() -> None:
    assert [walker(1.0, age).age for age in (0, np.float32(0.5), np.int64(1))] == [0.0, 0.5, 1.0]
    masked = np.ma.masked_array([0.2], mask=[True])[0]
    assert math.isnan(PersonObservation(id="a", position=(0.0, 0.0), age=masked).age)


CROSSING = [((2.87, -3.60), (-1.12, 0.52)), ((-5.45, -3.29), (1.31, 0.59)), ((3.74, -3.04), (-0.81, 0.60))]


@pytest.mark.parametrize(("start", "velocity"), CROSSING)
def test_nobody_who_is_told_of_late_is_touched(start: tuple[float, float], velocity: tuple[float, float]) -> None:
    """Those who walk straight on were, by 5 to 8 cm, where positions of 0.3 s ago were taken for those of now."""
    base = sidestep.Holonomic(max_speed=1.0, radius=0.3)
    one = sidestep.Planner(robot=base, goal=(0.0, 5.0), horizon=8)
    here, at = np.array([0.0, -5.0]), np.array(start)
    for k in range(60):
        age = min(0.1 * k, 0.3)
        seen = PersonObservation(id="a", position=at + (0.1 * k - age) * np.array(velocity), age=age)
        plan = one.step(time=0.1 * k, robot=sidestep.RobotState(position=here), people=[seen])
        for t in 0.1 * k + 0.02 * np.arange(1, 6):
            here = here + 0.02 * plan.velocity
            assert math.dist(here, at + t * np.array(velocity)) > 0.7
