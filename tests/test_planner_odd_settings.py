"""Settings in any combination, and observations that are no numbers: plans stay finite, and nobody vanishes.

`SIDESTEP_FAULT_PLANNERS` sets how many planners are drawn per case.
"""

from __future__ import annotations

import math
import os
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import sidestep
from sidestep.errors import InvalidInput
from sidestep.human.goals import PointGoal
from sidestep.lattice import Lattice
from sidestep.planning.problem import respects
from sidestep.prediction.occupancy import predict
from test_planner_faults import check, check_bounds

PLANNERS = int(os.environ.get("SIDESTEP_FAULT_PLANNERS", "30"))


class Undecided:
    """Like the NA of pandas, which is neither equal to anything nor different from it."""

    def __eq__(self, other):
        return self

    __hash__ = None
    __ne__ = __lt__ = __gt__ = __eq__

    def __bool__(self):
        raise TypeError("boolean value of NA is ambiguous")

    def __str__(self):
        return "unknown"


HERE = sidestep.RobotState(position=[0.0, 0.0])
UNFILTERED = sidestep.HumanModel(motion_filter=False, evidence="action")


class Drawn:
    """Settings, people and walls, drawn from one generator."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)

    def of(self, *values: Any) -> Any:
        return values[self.rng.integers(len(values))]

    def settings(self, d: int) -> dict[str, Any]:
        weights = tuple(self.rng.uniform(0.0, 3.0, d))
        return {
            "horizon": self.of(1, 2, 3, 5, 8) if d < 3 else self.of(1, 2, 3),
            "time_step": self.of(0.1, 0.25, 0.5, 1.0),
            "risk_rule": self.of("mass", "cells", "trajectory"),
            "risk_limit": self.of(1e-6, 0.01, 0.05, 0.5, 1.0),
            "goal_cost": self.of("squared", "distance"),
            "goal_weight": self.of(0.0, 1.0, weights),
            "effort_weight": self.of(0.0, 0.02, 5.0, weights),
            "terminal_weight": self.of(0.0, 1.0, 50.0),
            "acceleration_weight": self.of(0.0, 0.05, 10.0),
            "soft_risk_weight": self.of(0.0, 6.0, 1000.0),
            "midway": self.of(False, True),
            "first_step_limit": self.of(None, 1e-9, 0.01, 1.0),
            "least_randomness": self.of(0.0, 0.09, 1.0),
            "recourse": self.of(None, 0.05, 1.0, 100.0),
            "detour_after": self.of(None, 0.1, 2.0, 100.0),
            "rounds": self.of(1, 3, 6),
            "polish": self.of(False, True),
            "search_resolution": self.of(None, 1, 5),
            "clearance": self.of(None, 0.05, 0.7, 3.0),
            "memory": self.of(0.0, 1.0, 50.0),
            "signal_belief": self.of(None, 0.5),
        }

    def human(self, d: int) -> sidestep.HumanModel:
        filtered = self.of(False, True, True)
        return sidestep.HumanModel(
            walking_speed=self.of(0.1, 0.5, 1.5),
            reach=self.of(1, 2, 3) if d < 3 else 1,
            horizon=self.of(None, 0, 1, 3),
            frame=self.of("heading", "world"),
            goal_cost=self.of("squared", "distance"),
            goal_weight=self.of(0.0, 1.0, 50.0),
            effort_weight=self.of(0.0, 0.05, 5.0),
            danger_weight=self.of(0.0, 6.0, 1e4),
            danger_rate=self.of(0.0, 1.0, 50.0),
            danger_decay=self.of("distance", "squared_distance"),
            repulsion_weight=self.of(0.0, 0.0, 3.0),
            randomness=self.of(0.0, 0.2, 1.0),
            rationality=self.of(math.inf, math.inf, 1.0, 1e3),
            awareness_over_horizon=self.of("persistent", "resampled"),
            prior_concerned=self.of(1e-12, 0.5, 1.0 - 1e-12),
            switch_rate=self.of(0.0, 0.05, 100.0),
            measurement_noise=self.of(0.0, 0.03, 1.0),
            action_noise=self.of(0.0, 0.15),
            radius=self.of(0.01, 0.3, 1.0),
            motion_filter=filtered,
            evidence=self.of("action", "clearance") if filtered else "action",
            goals=self.of((), self.rng.uniform(-5.0, 5.0, (3, d))),
        )

    def robot(self, d: int) -> sidestep.Holonomic | sidestep.DifferentialDrive:
        if d == 2 and self.rng.random() < 0.4:
            return sidestep.DifferentialDrive(max_acceleration=self.of(None, 0.3), reference_offset=self.of(None, 0.05))
        return sidestep.Holonomic(
            max_speed=self.of(0.1, 1.0, 3.0), shape=self.of("box", "disc"), max_acceleration=self.of(None, 0.5)
        )

    def walls(self, d: int) -> sidestep.Obstacles | None:
        if d == 1 or self.rng.random() < 0.7:
            return None
        corners = self.rng.uniform(-4.0, 4.0, (3, 2))
        return sidestep.Obstacles(
            polygons=[c + np.array([[0.0, 0.0], [self.of(0.1, 2.0), 0.0], [0.2, 1.5]]) for c in corners]
        )

    def seen(self, name: str, place: np.ndarray, velocity: np.ndarray) -> sidestep.PersonObservation:
        d = place.size
        told: dict[str, Any] = {"velocity": self.of(None, velocity, velocity, velocity * self.of(np.nan, 1e6, 1e200))}
        if self.rng.random() < 0.3:
            told["goal"] = self.rng.uniform(-5.0, 5.0, d) * self.of(1.0, 1e5, 1e200, np.nan)
        if self.rng.random() < 0.2:
            told["position_covariance"] = np.eye(d) * self.of(0.0, 0.01, 100.0, -1.0, np.nan)
            told["velocity_covariance"] = np.eye(d) * self.of(0.0, 0.01, 100.0, -1.0)
        lost = self.of(*([1.0] * 40), np.nan, 1e200)
        return sidestep.PersonObservation(id=name, position=place * lost, **told)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("d", [1, 2, 3])
def test_plans_stay_finite_and_all_of_everybody_is_predicted(seed, d):
    drawn = Drawn(10 * seed + d)
    for _ in range(PLANNERS):
        settings, human, robot, walls = drawn.settings(d), drawn.human(d), drawn.robot(d), drawn.walls(d)
        try:
            planner = sidestep.Planner(
                robot=robot, goal=drawn.rng.uniform(-6.0, 6.0, d), human=human, obstacles=walls, **settings
            )
        except InvalidInput:
            continue  # a goal within a wall
        place, people = drawn.rng.uniform(-5.0, 5.0, d), drawn.rng.uniform(-4.0, 4.0, (drawn.of(0, 1, 3), d))
        velocities = drawn.rng.normal(size=people.shape)
        state = sidestep.RobotState(position=place, heading=float(drawn.rng.uniform(-9.0, 9.0)))
        for k in range(4):
            seen = [drawn.seen(str(i), x, v) for i, (x, v) in enumerate(zip(people, velocities, strict=True))]
            wish = drawn.of(None, None, drawn.rng.normal(size=d))
            plan = planner.step(time=0.2 * k, robot=state, people=seen, wish=wish)
            (check if settings["risk_rule"] == "mass" else check_bounds)(plan, robot)
            assert "internal error" not in plan.reason, (plan.reason, settings, human, robot)
            for person in plan.people.values():
                mass = person.occupancy.probability.reshape(settings["horizon"] + 1, -1).sum(axis=1)
                assert np.abs(mass - 1.0).max() < 1e-6, (mass, settings, human)
            state = robot.follow(plan.velocity, state, 0.2)
            people = people + 0.2 * velocities


@pytest.mark.parametrize("human", [UNFILTERED, sidestep.HumanModel()], ids=["unfiltered", "filtered"])
@pytest.mark.parametrize("velocity", [None, [np.nan, 0.0], [np.inf, 0.0]])
def test_a_velocity_that_is_no_number_is_not_known_and_the_person_is_still_there(human, velocity):
    planner = sidestep.Planner(robot=sidestep.Holonomic(), goal=(4.0, 0.0), human=human, horizon=3)
    person = sidestep.PersonObservation(id="a", position=[1.0, 0.0], velocity=velocity)
    plan = planner.step(time=0.0, robot=HERE, people=[person])
    assert "1 person in reach" in plan.reason
    assert plan.velocity[0] < 1.0  # whoever stands in the way is not driven into
    told = planner.step(time=0.1, robot=HERE, people=[person]).people["a"]
    assert np.isfinite(told.velocity).all()


def test_a_goal_beyond_all_places_is_no_goal():
    planner = sidestep.Planner(robot=sidestep.Holonomic(), goal=(4.0, 0.0), horizon=3)
    told = {}
    for far in (None, [1e200, 0.0], [np.inf, 0.0]):
        planner.reset()
        person = sidestep.PersonObservation(id="a", position=[2.0, 0.1], velocity=[-1.0, 0.0], goal=far)
        plan = planner.step(time=0.0, robot=HERE, people=[person])
        told[str(far)] = (plan.status, plan.velocity.tolist(), plan.risk.tolist())
    assert len(set(map(str, told.values()))) == 1
    with pytest.raises(InvalidInput, match=r"human\.goals: .*up to 1e9"):
        sidestep.HumanModel(goals=[(1e200, 0.0)])
    with pytest.raises(InvalidInput, match=r"planner\.goal: .*up to 1e9"):
        planner.goal = (1e200, 0.0)


def test_a_robot_or_a_person_beyond_all_places_stops_the_robot():
    planner = sidestep.Planner(robot=sidestep.Holonomic(), goal=(4.0, 0.0))
    far = planner.step(time=0.0, robot=sidestep.RobotState(position=[1e200, 0.0]), people=[])
    person = sidestep.PersonObservation(id="a", position=[1e200, 0.0])
    lost = planner.step(time=0.1, robot=HERE, people=[person])
    assert far.status == lost.status == "stopped"
    assert not np.concatenate([far.velocity, lost.velocity]).any()


@pytest.mark.parametrize(
    ("told", "words"),
    [
        ({"position": [2.0]}, "position has 1 coordinates, not 2"),
        ({"velocity": [1.0]}, "velocity has 1 coordinates, not 2"),
        ({"velocity": 1.0}, "velocity has 1 coordinates, not 2"),
        ({"goal": [1.0, 0.0, 0.0]}, "goal has 3 coordinates, not 2"),
        ({"position": [[2.0, 0.1]]}, "position has the shape (1, 2), not 2"),
    ],
)
def test_a_person_in_another_dimension_stops_the_robot_in_plain_words(told, words):
    planner = sidestep.Planner(robot=sidestep.Holonomic(), goal=(4.0, 0.0))
    plan = planner.step(
        time=0.0, robot=HERE, people=[sidestep.PersonObservation(**{"id": "a", "position": [2.0, 0.1], **told})]
    )
    assert plan.status == "stopped"
    assert plan.reason == f"person 'a': {words}"


def test_people_who_share_an_id_of_any_type_are_told_apart():
    planner = sidestep.Planner(robot=sidestep.Holonomic(), goal=(4.0, 0.0))
    for shared in ("a", 7, None, ("b", 1)):
        planner.reset()
        people = [sidestep.PersonObservation(id=shared, position=[2.0, y]) for y in (-1.0, 1.0, 2.0)]
        plan = planner.step(time=0.0, robot=HERE, people=people)
        assert plan.status == "certified", plan.reason
        assert list(plan.people) == [shared, f"{shared}'", f"{shared}''"]


@pytest.mark.parametrize(
    ("told", "words"),
    [
        ({"time": None}, "time is None"),
        ({"time": "now"}, "time is now"),
        ({"time": Undecided()}, "time is unknown"),
        ({"time": 10**400}, "time is 1000"),
        ({"people": [("a", 2.0, 0.1)]}, "there is a tuple among people, not a PersonObservation"),
        ({"people": sidestep.PersonObservation(id="a", position=[2.0, 0.1])}, "people is one PersonObservation, not a"),
        ({"people": 3}, "people is one int, not a list of"),
        ({"people": [sidestep.PersonObservation(id=[1], position=[2.0, 0.1])]}, "the id of a person is a list"),
        ({"robot": sidestep.RobotState(position=[[0.0, 0.0]], heading=0.0)}, "robot position has the shape (1, 2)"),
        ({"robot": sidestep.RobotState(position=[0.0, 0.0], heading="north")}, "robot heading is north"),
    ],
)
def test_what_is_told_in_another_way_than_is_asked_for_stops_the_robot_in_plain_words(told, words):
    planner = sidestep.Planner(robot=sidestep.DifferentialDrive(), goal=(4.0, 0.0))
    here = sidestep.RobotState(position=[0.0, 0.0], heading=0.0)
    plan = planner.step(**{"time": 0.0, "robot": here, "people": [], **told})
    assert plan.status == "stopped"
    assert plan.reason.startswith(words), plan.reason
    assert planner.step(time=1.0, robot=here, people=[]).status == "certified"


@pytest.mark.parametrize(
    "number", [Decimal, Fraction, np.float16, np.float32, np.longdouble, np.int64, np.bool_, np.array, lambda x: x > 0]
)
def test_numbers_of_any_kind_tell_the_time(number):
    """Some ended in an internal error, from what is subtracted or compiled, and the robot stood."""
    planner, same = (sidestep.Planner(robot=sidestep.Holonomic(), goal=(4.0, 0.0), horizon=3) for _ in range(2))
    for time in (0, 1):
        people = [sidestep.PersonObservation(id="a", position=[2.0, 1.0 - time], velocity=[0.0, -1.0], age=Decimal(0))]
        plan = planner.step(time=number(time), robot=HERE, people=people)
        expected = same.step(time=float(time), robot=HERE, people=people)
        assert (type(plan.time), plan.time) == (float, time)
        assert plan.reason == expected.reason
        assert np.array_equal(plan.positions, expected.positions)


def test_people_may_come_in_an_array():
    """Of more than one its truth is ambiguous: the robot stopped for an internal error."""
    planner = sidestep.Planner(robot=sidestep.Holonomic(), goal=(4.0, 0.0))
    people = np.array([sidestep.PersonObservation(id=n, position=[2.0, n]) for n in (1, 2)], dtype=object)
    assert planner.step(time=0.0, robot=HERE, people=people).people.keys() == {1, 2}


def test_what_is_masked_is_not_known():
    """Whatever lay under the mask was taken for a place, and a robot went past where nobody was."""
    planner = sidestep.Planner(robot=sidestep.Holonomic(), goal=(4.0, 0.0))
    lost = np.ma.array([2, 9], mask=[False, True])
    here = sidestep.RobotState(position=np.ma.array([0.0, 0.0]))
    plan = planner.step(time=0.0, robot=here, people=[sidestep.PersonObservation(id="a", position=lost)])
    assert plan.reason == "person 'a': position is [2.0, nan]"
    plan = planner.step(time=0.1, robot=sidestep.RobotState(position=lost), people=[])
    assert plan.reason == "robot position is [2.0, nan]"
    assert planner.step(time=0.2, robot=here, people=[]).status == "certified"


def test_a_velocity_of_the_robot_in_another_dimension_is_not_known():
    robot = sidestep.Holonomic(max_acceleration=1.0)
    plans = [
        sidestep.Planner(robot=robot, goal=(4.0, 0.0)).step(
            time=0.0, robot=sidestep.RobotState(position=[0.0, 0.0], velocity=velocity), people=[]
        )
        for velocity in (None, [1.0, 0.0, 0.0])
    ]
    assert plans[0].velocity.tolist() == plans[1].velocity.tolist()


def test_robots_too_slow_to_get_out_of_the_way_are_refused():
    with pytest.raises(InvalidInput, match=r"planner\.robot: .*0\.005 m in a time step of 0\.5 s"):
        sidestep.Planner(robot=sidestep.Holonomic(max_speed=0.009), goal=(4.0, 0.0))
    assert sidestep.Planner(robot=sidestep.Holonomic(max_speed=0.01), goal=(4.0, 0.0)).settings.time_step == 0.5


@pytest.mark.parametrize("rule", ["mass", "cells", "trajectory"])
@pytest.mark.parametrize("place", range(4))
def test_a_risk_that_is_no_number_is_no_certificate(rule, place):
    risk = np.zeros(4)
    assert respects(risk, rule, 0.05)
    risk[place] = np.nan
    if rule != "trajectory" or place % 2 == 1:  # the sum goes over whole instants
        assert not respects(risk, rule, 0.05)


def test_a_prediction_that_loses_mass_is_none():
    path = np.zeros((12, 2))
    with pytest.raises(ArithmeticError, match="mass"):
        predict(
            model=sidestep.HumanModel(),
            lattice=Lattice(origin=np.zeros(2), spacing=0.25, radius=4),
            goals=[PointGoal([3.0, 0.0])],
            weights=[[0.5, np.nan]],
            robot_path=path,
            horizon=3,
            time_step=0.5,
        )


@pytest.mark.parametrize("variance", [10.0, 100.0])
def test_blobs_of_metres_on_a_lattice_of_millimetres_fill_no_memory(variance):
    planner = sidestep.Planner(
        robot=sidestep.Holonomic(max_speed=0.1), goal=(5.0, -5.0, 0.0), time_step=0.1, horizon=3, risk_limit=1e-6,
        human=sidestep.HumanModel(walking_speed=0.1, reach=1, frame="world"), search_resolution=5,
    )  # fmt: skip
    somewhere = sidestep.PersonObservation(id="a", position=(2.0, 1.0, 0.0), position_covariance=np.eye(3) * variance)
    plan = planner.step(time=0.0, robot=sidestep.RobotState(position=(0.0, 0.0, 0.0)), people=[somewhere])
    assert plan.status == "least_risk", plan.reason
    assert 1e-6 < plan.risk.max() < 0.01
