"""People of other models: they walk to their goals, heed the robot or not, and draw from their own luck alone."""

import numpy as np
import pytest

from sidestep.simulation.crowd_people import crowd_kinds
from sidestep.simulation.loop import simulate
from sidestep.simulation.navigators import Steering
from sidestep.simulation.scenario import Scenario
from sidestep.types import frozen_array


class Constant:
    """A navigator that never changes its mind."""

    def __init__(self, velocity):
        self.velocity = velocity

    def reset(self):
        pass

    def step(self, *, time, robot, people):
        return Steering(velocity=frozen_array(self.velocity), status="least_risk")


def run(kind, *, velocity=(1.0, 0.0), duration=8.0, seed=3, **person):
    pytest.importorskip("navground.core")
    scenario = Scenario.parse(
        {
            "seed": seed,
            "duration": duration,
            "control_step": 0.1,
            "planning_period": 0.1,
            "stop_at_goal": False,
            "robot": {"start": (0.0, 0.0), "goal": (10.0, 0.0)},
            "people": [
                {"kind": kind, "start": (8.0, 0.05), "goal": (-8.0, 0.05), "speed": 1.0, "goal_known": False,
                 "decision_interval": 0.1, "arrives_with": (-1.0, 0.0), **person}
            ],
        }
    )  # fmt: skip
    return simulate(scenario, navigator=Constant(velocity), kinds=crowd_kinds(), snapshots=0)


def nearest(record):
    return np.linalg.norm(record.people_positions[:, 0] - record.robot_positions, axis=-1).min()


@pytest.mark.parametrize("kind", ["orca", "social-force"])
def test_the_concerned_evade_a_robot_that_does_not_and_the_unconcerned_do_not(kind):
    concerned, blind = run(kind), run(f"{kind}-unconcerned")
    assert nearest(concerned) > 0.5
    assert nearest(blind) < 0.3
    assert (concerned.people_awareness == 1).all()
    assert (blind.people_awareness == 0).all()
    for record in (concerned, blind):
        assert record.people_positions[-1, 0, 0] < 3.5


def test_somebody_who_looks_up_in_time_evades():
    late, never = run("orca-unconcerned", switch_times=(2.0,)), run("orca-unconcerned")
    assert nearest(late) > 0.55 > nearest(never)
    assert late.people_awareness[0, 0] == 0
    assert late.people_awareness[-1, 0] == 1


def test_the_half_random_are_half_random_and_have_their_own_luck():
    one = run("half-random", decision_interval=0.5)
    other = run("half-random", decision_interval=0.5, velocity=(0.0, 0.3))
    np.testing.assert_array_equal(one.people_positions, other.people_positions)
    another = run("half-random", decision_interval=0.5, seed=4)
    assert not np.array_equal(one.people_positions, another.people_positions)
    places = run("half-random", decision_interval=0.5, duration=20.0).people_positions[::5, 0]
    to_goal = (-8.0, 0.05) - places[:-1]
    straight = 0.5 * to_goal / np.linalg.norm(to_goal, axis=1, keepdims=True)
    assert 0.3 < np.isclose(np.diff(places, axis=0), straight, atol=1e-6).all(axis=1).mean() < 0.75


def test_unconcerned_people_still_avoid_each_other():
    pytest.importorskip("navground.core")
    people = [
        {"kind": "orca-unconcerned", "start": (x, y), "goal": (-x, y), "speed": 1.0, "decision_interval": 0.1}
        for x, y in ((5.0, 5.0), (-5.0, 5.02))
    ]
    scenario = Scenario.parse(
        {
            "duration": 10.0,
            "control_step": 0.1,
            "planning_period": 0.1,
            "stop_at_goal": False,
            "robot": {"start": (0.0, 0.0), "goal": (10.0, 0.0)},
            "people": people,
        }
    )
    record = simulate(scenario, navigator=Constant((0.0, 0.0)), kinds=crowd_kinds(), snapshots=0)
    apart = np.linalg.norm(record.people_positions[:, 0] - record.people_positions[:, 1], axis=-1)
    assert apart.min() > 0.55
