"""The public interface of the planner, as the documents promise it."""

from __future__ import annotations

import dataclasses
from concurrent.futures import ThreadPoolExecutor
from threading import Thread

import numpy as np
import pytest

import sidestep
from sidestep.ladder import Outcome, climb
from sidestep.situation import Situation
from sidestep.types import Path


def planner(**more: object) -> sidestep.Planner:
    settings: dict[str, object] = {"horizon": 4, "time_step": 0.5, **more}
    robot = settings.pop("robot", sidestep.Holonomic(max_speed=1.0, radius=0.3))
    return sidestep.Planner(robot=robot, goal=settings.pop("goal", (0.0, 5.0)), **settings)  # type: ignore[arg-type]


def person(x: float, y: float, **more: object) -> sidestep.PersonObservation:
    return sidestep.PersonObservation(id=str(more.pop("id", "a")), position=(x, y), **more)  # type: ignore[arg-type]


ROBOT = sidestep.RobotState(position=(0.0, -5.0))


def test_the_call_of_the_architecture_page() -> None:
    full = sidestep.Planner(
        robot=sidestep.Holonomic(max_speed=1.0, radius=0.3),
        goal=(0.0, 5.0),
        human=sidestep.HumanModel(),
        time_step=0.5,
        horizon=8,
        risk_limit=0.02,
        clearance=0.7,
    )
    plan = full.step(
        time=0.0,
        robot=ROBOT,
        people=[
            sidestep.PersonObservation(id="a", position=(-5.0, 0.0), velocity=(1.0, 0.0), goal=None),
        ],
    )
    assert plan.status == "certified"
    assert plan.velocity.shape == plan.command.shape == (2,)
    assert plan.positions.shape == (9, 2)
    assert plan.collision_probability.shape == plan.risk.shape == (8,)
    assert (plan.risk <= plan.risk_limit).all()
    assert 0 < plan.people["a"].belief < 1
    occupancy = plan.people["a"].occupancy
    assert occupancy.shape == (9, *occupancy.lattice.shape)
    np.testing.assert_allclose(np.asarray(occupancy).reshape(9, -1).sum(axis=1), 1.0, atol=1e-9)
    full.reset()


def test_alone_the_robot_goes_straight_at_full_speed() -> None:
    plan = planner().step(time=0.0, robot=ROBOT, people=[])
    assert plan.status == "certified"
    np.testing.assert_allclose(plan.velocity, (0.0, 1.0), atol=1e-3)


def test_a_plan_cannot_be_changed() -> None:
    plan = planner().step(time=0.0, robot=ROBOT, people=[person(-3.0, -3.0)])
    with pytest.raises(dataclasses.FrozenInstanceError):
        plan.status = "certified"  # type: ignore[misc]
    for array in (plan.velocity, plan.positions, plan.collision_probability, plan.people["a"].occupancy.probability):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0


def test_first_contacts_with_several_people_add_up_to_a_probability() -> None:
    walled_in = [person(x, y, id=(x, y), velocity=(-0.8 * x, -0.8 * y)) for x, y in np.eye(2).tolist()]
    walled_in += [person(x, y, id=(x, y), velocity=(-0.8 * x, -0.8 * y)) for x, y in (-np.eye(2)).tolist()]
    plan = planner().step(time=0.0, robot=sidestep.RobotState(position=(0.0, 0.0)), people=walled_in)
    each = np.array([told.collision_probability for told in plan.people.values()])
    assert each.sum() > 1.5
    assert (plan.collision_probability >= 0.0).all()
    np.testing.assert_allclose(plan.collision_probability.sum(), 1.0 - np.prod(1.0 - each.sum(axis=1)))
    alone = planner().step(time=0.0, robot=sidestep.RobotState(position=(0.0, 0.0)), people=walled_in[:1])
    told = alone.people[walled_in[0].id].collision_probability
    np.testing.assert_allclose(alone.collision_probability, told, atol=1e-15)


def test_under_the_rule_trajectory_the_risk_told_is_the_one_whose_sum_is_limited() -> None:
    robot = sidestep.RobotState(position=(0.0, 0.0))
    settings = {"risk_rule": "trajectory", "horizon": 8, "time_step": 0.3, "goal": (4.0, 0.0)}
    plan = planner(**settings).step(time=0.0, robot=robot, people=[person(1.1, 0.3, velocity=(0.0, 0.0))])
    assert plan.status == "certified"
    assert 0.5 * plan.risk_limit < plan.risk.sum() <= plan.risk_limit * (1.0 + 1e-6)
    assert f"summed risk {plan.risk.sum():.2g} of 0.05" in plan.reason
    unsure = planner(**settings).step(time=0.0, robot=robot, people=[person(1.0, 0.0)])
    assert unsure.status == "least_risk"
    assert unsure.risk.sum() > unsure.risk_limit
    assert unsure.reason.endswith(f"taking the least risk, summed {unsure.risk.sum():.2g}")


def test_the_risk_told_is_looked_for_between_the_steps_too(monkeypatch: pytest.MonkeyPatch) -> None:
    found: list[Outcome] = []

    def climbed(now: Situation, anticipated: Path) -> Outcome:
        found.append(climb(now, anticipated))
        return found[-1]

    monkeypatch.setattr("sidestep.planner.climb", climbed)
    crossing = person(-2.0, 0.0, velocity=(1.2, 0.0))
    robot = sidestep.RobotState(position=(0.0, -2.0))
    plan = planner(horizon=8).step(time=0.0, robot=robot, people=[crossing])
    between, at = found[0].risk[0::2], found[0].risk[1::2]
    assert between.max() > at.max()
    np.testing.assert_array_equal(plan.risk, np.maximum(between, at))


def test_a_differential_drive_takes_speed_and_turn_rate() -> None:
    base = sidestep.DifferentialDrive(max_speed=0.7, max_turn_rate=1.5, radius=0.18)
    state = sidestep.RobotState(position=(0.0, -5.0), heading=np.pi / 2)
    plan = planner(robot=base).step(time=0.0, robot=state, people=[person(-3.0, 0.0, velocity=(1.0, 0.0))])
    v, omega = plan.command
    assert 0 < v <= 0.7 + 1e-9
    assert abs(omega) <= 1.5 + 1e-9


@pytest.mark.parametrize("d", [1, 2, 3])
def test_every_dimension(d: int) -> None:
    start, goal, there = np.zeros(d), np.zeros(d), np.zeros(d)
    goal[0], there[0] = 4.0, 3.0
    p = planner(goal=goal, horizon=3)
    seen = sidestep.PersonObservation(id="a", position=there, velocity=np.zeros(d))
    plan = p.step(time=0.0, robot=sidestep.RobotState(position=start), people=[seen])
    assert plan.positions.shape == (4, d)
    assert np.isfinite(plan.positions).all()


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"horizon": 0}, "planner.horizon"),
        ({"horizon": 101}, "planner.horizon"),
        ({"horizon": 10**20}, "planner.horizon"),
        ({"horizon": 50, "goal": (0.0, 0.0, 5.0)}, "planner.horizon"),
        ({"threads": 10**9}, "planner.threads"),
        ({"time_step": -1.0}, "planner.time_step"),
        ({"time_step": 1e9}, "planner.time_step"),
        ({"robot": sidestep.Holonomic(max_acceleration=1e-6)}, "planner.robot"),
        ({"robot": sidestep.DifferentialDrive(max_turn_acceleration=1e-6)}, "planner.robot"),
        ({"risk_limit": 0.0}, "planner.risk_limit"),
        ({"risk_limit": float("nan")}, "planner.risk_limit"),
        ({"clearance": -0.5}, "planner.clearance"),
        ({"goal": (float("nan"), 0.0)}, "planner.goal"),
        ({"goal": (float("inf"), 0.0)}, "planner.goal"),
        ({"goal": (0.0, 0.0, 0.0, 0.0)}, "planner.goal"),
        ({"goal_weight": -1.0}, "planner.goal_weight"),
        ({"goal_weight": (1.0, 1.0, 1.0)}, "planner.goal_weight"),
        ({"acceleration_weight": -0.1}, "planner.acceleration_weight"),
        ({"terminal_weight": -0.1}, "planner.terminal_weight"),
        ({"risk_rule": "hope"}, "planner.risk_rule"),
        ({"horizn": 3}, "planner.horizn"),
    ],
)
def test_bad_settings_get_one_line_that_names_the_field(changes: dict[str, object], field: str) -> None:
    with pytest.raises(sidestep.InvalidInput) as error:
        planner(**changes)
    assert str(error.value).startswith(field)
    assert "\n" not in str(error.value)


def test_a_goal_inside_a_wall_is_refused_with_the_mend() -> None:
    block = sidestep.Obstacles(polygons=[[(-1.0, 4.0), (1.0, 4.0), (1.0, 6.0), (-1.0, 6.0)]])
    with pytest.raises(sidestep.InvalidInput, match=r"planner\.goal"):
        planner(obstacles=block)


NAN, INF = float("nan"), float("inf")


@pytest.mark.parametrize(
    ("robot", "people"),
    [
        (sidestep.RobotState(position=(NAN, 0.0)), []),
        (sidestep.RobotState(position=(INF, 0.0)), []),
        (sidestep.RobotState(position=(0.0, 0.0, 0.0)), []),
        (ROBOT, [person(NAN, 0.0)]),
        (ROBOT, [sidestep.PersonObservation(id="a", position=(0.0, 0.0, 1.0))]),
        (ROBOT, None),
    ],
)
def test_data_that_cannot_be_used_stop_the_robot_and_say_why(
    robot: sidestep.RobotState, people: list[sidestep.PersonObservation] | None
) -> None:
    plan = planner().step(time=0.0, robot=robot, people=people)
    assert plan.status == "stopped"
    assert plan.reason
    here = robot.position if robot.position.shape == (2,) and np.isfinite(robot.position).all() else np.zeros(2)
    np.testing.assert_array_equal(plan.positions, np.tile(here, (5, 1)))
    np.testing.assert_array_equal(plan.velocity, 0.0)
    np.testing.assert_array_equal(plan.command, 0.0)


@pytest.mark.parametrize(
    "people",
    [
        [person(0.0, -5.0)],
        [person(0.2, -5.0, velocity=(0.0, 0.0))],
        [person(0.4, -4.9, velocity=(-100.0, 0.0))],
        [person(1.0, -5.0), person(2.0, -5.0)],
        [person(1.0, -4.0, velocity=(NAN, NAN))],
        [person(1.0, -4.0, goal=(NAN, 1.0))],
        [person(1.0, -4.0, position_covariance=-np.eye(2))],
        [person(1e9, 1e9)],
        [person(np.cos(a), -5 + np.sin(a), id=str(i)) for i, a in enumerate(np.linspace(0, 6, 12))],
    ],
    ids=["on-top", "inside", "fast", "same-id", "nan-velocity", "nan-goal", "bad-covariance", "far", "surrounded"],
)
def test_odd_worlds_give_a_finite_plan_within_the_limits(people: list[sidestep.PersonObservation]) -> None:
    p = planner()
    for i in range(3):
        plan = p.step(time=0.5 * i, robot=ROBOT, people=people)
        assert plan.status in ("certified", "least_risk", "stopped")
        assert not plan.reason.startswith("internal"), plan.reason
        for array in (plan.velocity, plan.command, plan.positions, plan.collision_probability, plan.risk):
            assert np.isfinite(array).all()
        assert (np.abs(plan.velocity) <= 1 + 1e-9).all()


def test_time_running_backwards_stops_once_and_then_starts_afresh() -> None:
    p = planner()
    seen = [person(-4.0, 0.0, velocity=(1.0, 0.0))]
    assert p.step(time=5.0, robot=ROBOT, people=seen).status == "certified"
    back = p.step(time=1.0, robot=ROBOT, people=seen)
    assert back.status == "stopped"
    assert "backwards" in back.reason
    assert p.step(time=1.5, robot=ROBOT, people=seen).status == "certified"


def test_a_goal_that_is_set_while_a_call_is_answered_counts_from_the_next_on(monkeypatch: pytest.MonkeyPatch) -> None:
    one, climb = planner(), sidestep.planner.climb
    setting = Thread(target=lambda: setattr(one, "goal", (5.0, -5.0)))
    meanwhile: list[list[float]] = []

    def climbing(*given: object) -> object:
        setting.start()
        setting.join(0.2)
        meanwhile.append(one.goal.tolist())
        return climb(*given)  # type: ignore[arg-type]

    with monkeypatch.context() as patch:
        patch.setattr(sidestep.planner, "climb", climbing)
        plan = one.step(time=0.0, robot=ROBOT, people=[])
    setting.join()
    assert (meanwhile, one.goal.tolist()) == ([[0.0, 5.0]], [5.0, -5.0])
    np.testing.assert_allclose(plan.velocity, (0.0, 1.0), atol=1e-3)
    assert one.step(time=0.5, robot=ROBOT, people=[]).velocity[0] > 0.9


@pytest.mark.parametrize("measured", [True, False])
@pytest.mark.parametrize("limit", [None, 1.0])
def test_who_is_asked_again_in_the_same_instant_answers_the_same(limit: float | None, measured: bool) -> None:
    """The clock of a simulation may be slower than who asks: that tells nothing of the next call, or of the base."""
    base = sidestep.Holonomic(max_speed=1.0, radius=0.3, max_acceleration=limit)
    one, state = planner(robot=base), sidestep.RobotState(position=(0.0, -5.0), velocity=(0.0, 0.0))
    for k in range(5):
        told = state if measured else dataclasses.replace(state, velocity=None)
        people = [person(-3.0 + 0.45 * k, -2.0, velocity=(0.9, 0.0))]
        first, again = (one.step(time=0.5 * k, robot=told, people=people) for _ in range(2))
        assert again.status == first.status
        np.testing.assert_allclose(again.velocity, first.velocity, atol=0.01)
        state = base.follow(first.velocity, state, 0.5)


def test_the_places_of_a_stop_are_of_the_point_that_is_planned_for() -> None:
    """They were those of the axle, and of every other plan those of the reference."""
    base = sidestep.DifferentialDrive(radius=0.3)
    state = sidestep.RobotState(position=(1.0, 2.0), heading=0.7)
    one = planner(robot=base)
    stop, plan = one.step(time=0.0, robot=state, people=None), one.step(time=0.1, robot=state, people=[])
    assert stop.status == "stopped"
    np.testing.assert_allclose(stop.positions, np.tile(plan.positions[0], (5, 1)))
    lost = dataclasses.replace(state, heading=float("nan"))
    np.testing.assert_allclose(one.step(time=0.2, robot=lost, people=[]).positions, np.tile([1.0, 2.0], (5, 1)))


def test_losing_sight_stops_within_the_timeout_and_recovers() -> None:
    p = planner(timeout=1.0)
    seen = [person(-4.0, 0.0, velocity=(1.0, 0.0))]
    assert p.step(time=0.0, robot=ROBOT, people=seen).status == "certified"
    assert p.step(time=0.5, robot=ROBOT, people=None).status != "stopped"
    assert p.step(time=1.6, robot=ROBOT, people=None).status == "stopped"
    assert p.step(time=1.7, robot=ROBOT, people=seen).status != "stopped"


@pytest.mark.parametrize("before", [None, 0.0])
def test_people_of_whom_nobody_can_say_where_they_are_are_no_news_of_nobody(before: float | None) -> None:
    """The call after it, which brought no data, was planned as if nobody were there: full speed, certified."""
    p = planner(timeout=1.0)
    if before is not None:
        p.step(time=before, robot=ROBOT, people=[person(40.0, 40.0, id="b")])
    stop = p.step(time=1.0, robot=ROBOT, people=[person(NAN, 0.0)])
    assert "position is [nan" in stop.reason
    plan = p.step(time=1.2, robot=ROBOT, people=None)
    assert plan.status == "stopped"
    assert plan.reason == f"no observation of people {'yet' if before is None else 'for 1.20 s'}"


def test_after_the_clock_ran_backwards_no_data_is_no_news_of_nobody() -> None:
    p = planner(timeout=1.0)
    p.step(time=5.0, robot=ROBOT, people=[person(0.0, -3.5)])
    assert "backwards" in p.step(time=1.0, robot=ROBOT, people=[person(0.0, -3.5)]).reason
    assert p.step(time=1.5, robot=ROBOT, people=None).reason == "no observation of people yet"


def test_a_long_pause_is_not_taken_for_the_time_until_the_next_call() -> None:
    """With a timeout of days, a call after an hour took 23 s and 0.8 GB: it looked at that hour in slices of 0.05 s."""
    p = planner(timeout=1e6, robot=sidestep.Holonomic(max_acceleration=1.0))
    robot = sidestep.RobotState(position=(0.0, -5.0), velocity=(0.0, 0.0))
    for time in (0.0, 3600.0):
        assert p.step(time=time, robot=robot, people=[person(1.0, -5.0)]).status != "stopped"
        assert p._interval == 0.5


def test_two_people_with_the_same_name_are_both_avoided() -> None:
    p = planner()
    plan = p.step(time=0.0, robot=ROBOT, people=[person(1.0, -3.0), person(-1.0, -3.0)])
    assert len(plan.people) == 2


def test_the_same_calls_give_the_same_plans() -> None:
    def run() -> list[np.ndarray]:
        p = planner()
        return [
            p.step(time=0.5 * i, robot=ROBOT, people=[person(-3 + 0.5 * i, -3.0, velocity=(1.0, 0.0))]).positions
            for i in range(4)
        ]

    for a, b in zip(run(), run(), strict=True):
        np.testing.assert_array_equal(a, b)


def test_people_who_are_too_far_away_are_predicted_when_asked_for_even_later_and_from_other_threads() -> None:
    """What was not asked for at once is the same later, whatever was asked in between and by how many at a time."""
    far = [person(40.0, 0.0, id="a", velocity=(1.0, 0.2)), person(-30.0, 20.0, id="b", velocity=(0.0, -1.3))]
    one, other = planner(), planner()
    plans = [one.step(time=0.5 * k, robot=ROBOT, people=far) for k in range(4)]
    at_once: list[dict[str, np.ndarray]] = []
    for k in range(4):
        plan = other.step(time=0.5 * k, robot=ROBOT, people=far)
        at_once.append({name: plan.people[name].occupancy.probability.copy() for name in "ab"})
    asked = [(k, name) for k in range(4) for name in "ba"]

    def ask(key: tuple[int, str]) -> np.ndarray:
        return plans[key[0]].people[key[1]].occupancy.probability

    with ThreadPoolExecutor(4) as pool:
        later = list(pool.map(ask, asked))
    for (k, name), probability in zip(asked, later, strict=True):
        np.testing.assert_array_equal(probability, at_once[k][name])


def test_a_map_without_walls_is_no_map() -> None:
    plans = [
        planner(obstacles=walls).step(time=0.0, robot=ROBOT, people=[person(-3.0, -3.0)])
        for walls in (None, sidestep.Obstacles())
    ]
    np.testing.assert_allclose(plans[0].positions, plans[1].positions, atol=1e-6)


def test_a_steady_walker_is_planned_for_as_somebody_who_may_still_do_anything() -> None:
    used: dict[float, list[float]] = {}
    for least in (0.0, 0.09):
        one = planner(least_randomness=least)
        used[least] = []
        for step in range(8):
            seen = [person(-4.0 + 0.5 * step, 0.0, velocity=(1.0, 0.0))]
            used[least].append(one.step(time=0.5 * step, robot=ROBOT, people=seen).people["a"].randomness)
    assert used[0.0][-1] < 0.05  # what is learned
    assert min(used[0.09]) >= 0.09
    with pytest.raises(sidestep.InvalidInput, match="least_randomness"):
        planner(least_randomness=1.5)
    fixed = sidestep.HumanModel(online_randomness=False, randomness=0.01)
    plan = planner(human=fixed).step(time=0.0, robot=ROBOT, people=[person(-3.0, -3.0)])
    assert plan.people["a"].randomness == 0.01


def followed(interval: float, weight: float) -> tuple[np.ndarray, np.ndarray]:
    """Positions (M, 2) m and velocities (M, 2) m/s behind somebody slow, as plans are made every `interval` s."""
    one = planner(goal=(0.0, 8.0), acceleration_weight=weight)
    here, positions, velocities = np.array([0.0, -2.0]), [], []
    for k in range(round(8.0 / interval)):
        ahead = person(0.1, -0.5 + 0.5 * interval * k, velocity=(0.0, 0.5))
        plan = one.step(time=interval * k, robot=sidestep.RobotState(position=here), people=[ahead])
        here = here + interval * plan.velocity
        positions.append(here)
        velocities.append(plan.velocity)
    return np.array(positions), np.array(velocities)


def test_a_robot_that_plans_ten_times_a_second_is_not_shaken() -> None:
    """Somebody slower is overtaken in about the same time, with a fraction of the acceleration."""
    found = {weight: followed(0.1, weight) for weight in (0.0, 0.05)}
    shaken = {w: np.linalg.norm(np.diff(v, axis=0), axis=1).sum() for w, (_, v) in found.items()}  # m/s in all
    assert shaken[0.05] < 0.5 * shaken[0.0]
    assert found[0.05][0][-1, 1] > found[0.0][0][-1, 1] - 0.5


def test_what_a_change_of_velocity_costs_counts_by_elapsed_time() -> None:
    """Half as long until the next call, twice as dear; nothing is preferred at first, or where it is free."""

    def first(interval: float, weight: float) -> np.ndarray:
        one = planner(acceleration_weight=weight)
        one.step(time=0.0, robot=ROBOT, people=[])
        one.goal = (5.0, -5.0)  # to the right now
        one.step(time=1.0, robot=ROBOT, people=[])
        one.goal = (0.0, 5.0)  # and ahead again
        return one.step(time=1.0 + interval, robot=ROBOT, people=[]).velocity

    free = planner(acceleration_weight=0.0).step(time=0.0, robot=ROBOT, people=[]).velocity
    np.testing.assert_allclose(planner(acceleration_weight=5.0).step(time=0.0, robot=ROBOT, people=[]).velocity, free)
    np.testing.assert_allclose(first(0.1, 0.0), free, atol=1e-6)
    np.testing.assert_allclose(first(0.1, 0.1), first(0.2, 0.2), atol=1e-6)
    assert first(0.1, 0.1)[0] > first(0.5, 0.1)[0] + 0.1


def in_a_corridor(recourse: float | None) -> tuple[sidestep.Plan, sidestep.Plan]:
    """The plans for a person who comes down a corridor, a little on the robot's side, and for one who has come near."""
    wall = [(-20.0, 1.5), (20.0, 1.5), (20.0, 1.8), (-20.0, 1.8)]
    walls = sidestep.Obstacles(polygons=[wall, [(x, -y) for x, y in wall]])
    human = sidestep.HumanModel(evidence="action")  # who does not react is soon known to be unconcerned
    one = planner(obstacles=walls, goal=(8.0, 0.0), horizon=8, recourse=recourse, human=human)
    plans = []
    for k in range(8):
        robot = sidestep.RobotState(position=(-0.2 * k, -1.0))
        plans.append(one.step(time=0.2 * k, robot=robot, people=[person(4.0 - 0.2 * k, -0.2, velocity=(-1.0, 0.0))]))
    return plans[0], plans[-1]


def test_the_robot_does_not_give_way_for_what_it_will_see_in_time() -> None:
    frozen = in_a_corridor(None)[1]
    assert frozen.status == "certified"
    assert frozen.positions[-1, 0] < frozen.positions[0, 0]  # gives way, step after step
    going = in_a_corridor(1.0)[1]
    assert going.status == "least_risk"
    assert "going on" in going.reason
    assert going.positions[-1, 0] > going.positions[0, 0] + 2.0
    assert (going.risk[:2] <= going.risk_limit).all()
    assert (going.risk > going.risk_limit).any()
    with pytest.raises(sidestep.InvalidInput, match="recourse"):
        planner(recourse=-1.0)
