"""Simulated people: they do what their own parameters say, and their luck does not depend on the robot."""

import numpy as np
import pytest

from blind_driver import BlindDriver, crossing
from sidestep.errors import UnknownName
from sidestep.human.goals import PointGoal
from sidestep.human.policy import best_actions
from sidestep.lattice import Lattice
from sidestep.obstacles import Obstacles
from sidestep.simulation.loop import simulate
from sidestep.simulation.people import Recorded, Surroundings, build_people
from sidestep.simulation.recordings import Track

PAPER = {
    "frame": "world",
    "goal_cost": "squared",
    "goal_weight": 2.5,
    "effort_weight": 8.0,
    "danger_weight": 100.0,
    "danger_rate": 0.06,
    "randomness": 0.0,
}


def person(*, human=None, horizon=4, seed=0, **settings):
    """One person of a scenario, and the scenario."""
    one = {"id": "a", "start": (-3.0, 0.2), "goal": (5.0, 0.0)} | settings
    scenario = crossing(people=[one], human=human or PAPER, planner={"horizon": horizon})
    return build_people(scenario, [np.random.default_rng(seed)])[0], scenario


def around(time=0.0, path=None, **changes):
    """What a person sees; the robot comes up from below unless told otherwise."""
    steps = np.arange(20)[:, None]
    values = {
        "time": time,
        "time_step": 0.5,
        "robot_path": np.array([0.0, -2.0]) + steps * np.array([0.0, 0.5]) if path is None else path,
        "robot_velocity": np.array([0.0, 1.0]),
        "robot_radius": 0.3,
        "others": np.zeros((1, 2)),
        "velocities": np.zeros((1, 2)),
        "index": 0,
        "obstacles": None,
        "signal": False,
    }
    return Surroundings(**(values | changes))


@pytest.mark.parametrize("kind", ["concerned", "unconcerned"])
def test_a_person_without_randomness_takes_a_best_action_of_the_model(kind):
    p, scenario = person(kind=kind)
    seen = around()
    lattice = Lattice(origin=p.position(0.0), spacing=0.25, radius=0)
    path = seen.robot_path[: scenario.planner.horizon + 1]
    best = best_actions(p.model, lattice, PointGoal((5.0, 0.0)), path, int(kind == "concerned"), 0.5)
    multiples = np.array([(i, j) for i in range(-2, 3) for j in range(-2, 3)])
    p.decide(seen)
    assert any(np.allclose(p.velocity, 0.5 * m) for m in multiples[best.ravel()])


def test_tied_actions_are_drawn_equally_often():
    path = np.repeat([[0.0, 0.0]], 20, axis=0)
    sides = []
    for seed in range(200):
        p, _ = person(start=(-0.9, 0.0), goal=(5.0, 0.0), seed=seed, behaviour={"danger_weight": 300.0})
        p.decide(around(path=path))
        sides.append(np.sign(p.velocity[1]))
    assert set(sides) == {-1.0, 1.0}
    assert 65 <= sides.count(1.0) <= 135


def test_a_random_person_draws_every_action_alike():
    p, _ = person(kind="random")
    counts = {}
    for k in range(2500):
        p.decide(around(time=0.5 * k))
        key = tuple((p.velocity / 0.5).round().astype(int).tolist())
        counts[key] = counts.get(key, 0) + 1
    assert len(counts) == 25
    assert all(60 <= n <= 145 for n in counts.values())


def test_random_actions_come_as_often_as_the_own_parameter_says_not_the_predictors():
    p, _ = person(kind="unconcerned", human=PAPER | {"randomness": 0.9}, randomness=0.25)
    straight = 0
    for k in range(2000):
        p.decide(around(time=0.5 * k))
        straight += bool(np.allclose(p.velocity, (1.0, 0.0)))
    assert straight / 2000 == pytest.approx(0.75 + 0.25 / 25, abs=0.04)


def test_a_person_decides_anew_only_after_the_own_interval():
    p, _ = person(kind="random")
    p.decide(around(time=0.0))
    first = p.velocity
    p.decide(around(time=0.4))
    assert p.velocity is first
    p.decide(around(time=0.5))
    assert p.velocity is not first


def test_misjudged_distances_change_what_a_concerned_person_does_now_and_then():
    plain = {**PAPER, "danger_weight": 30.0, "danger_rate": 0.5}
    seen = around(path=np.repeat([[0.6, 0.3]], 20, axis=0))
    exact, _ = person(kind="concerned", human=plain)
    exact.decide(seen)
    for decay, weight, rate in (("squared_distance", 30.0, 0.5), ("distance", 60.0, 1.0)):
        human = plain | {"perception_noise": 1.5, "danger_decay": decay, "danger_weight": weight, "danger_rate": rate}
        found = set()
        for seed in range(40):
            p, _ = person(kind="concerned", human=human, seed=seed)
            p.decide(seen)
            found.add(tuple(p.velocity.tolist()))
        assert len(found) > 1
    unconcerned = {tuple(_velocity("unconcerned", human, seed, seen)) for seed in range(10)}
    assert len(unconcerned) == 1


def _velocity(kind, human, seed, seen):
    p, _ = person(kind=kind, human=human, seed=seed)
    p.decide(seen)
    return p.velocity.tolist()


def test_switching_people_switch_when_told():
    p, _ = person(kind="switching", switch_times=(1.0, 2.0), initially_concerned=True)
    found = []
    for k in range(6):
        p.decide(around(time=0.5 * k))
        found.append(p.awareness)
    assert found == [1.0, 1.0, 0.0, 0.0, 1.0, 1.0]


def test_a_signal_makes_a_heeding_person_concerned():
    heeding, _ = person(kind="unconcerned", heeds_signal=1.0)
    deaf, _ = person(kind="unconcerned")
    for p in (heeding, deaf):
        p.decide(around(signal=False))
        assert p.awareness == 0.0
        p.decide(around(time=0.5, signal=True))
    assert (heeding.awareness, deaf.awareness) == (1.0, 0.0)


def test_waypoints_are_passed_in_order():
    one = {"id": "a", "kind": "straight", "start": (0, 0), "waypoints": [(3, 0)], "goal": (3, 3), "speed": 1.0}
    scenario = crossing(people=[one], robot={"start": (50, 50), "goal": (60, 50)}, duration=8.0)
    path = simulate(scenario, navigator=BlindDriver(goal=(60.0, 50.0))).people_positions[:, 0]
    assert np.linalg.norm(path - (3, 0), axis=1).min() < 0.6
    np.testing.assert_allclose(path[-1], (3, 3), atol=1e-9)


def test_a_change_of_mind_toward_the_robot_meets_a_robot_that_waits():
    changes = [{"time": 2.0, "goal": "robot"}]
    one = {"id": "a", "kind": "straight", "start": (-5, 0), "goal": (-5, 8), "speed": 1.0, "goal_changes": changes}
    scenario = crossing(people=[one], duration=12.0)
    record = simulate(scenario, navigator=BlindDriver(goal=(0.0, 5.0), speed=0.0))
    gaps = np.linalg.norm(record.people_positions[:, 0] - record.robot_positions, axis=1)
    assert gaps[4] > 6.0  # walked away from it for 2 s
    assert gaps.min() < 0.6
    np.testing.assert_allclose(record.people_goals[0], (-5, 8))  # what the planner is told does not change


def test_people_appear_and_vanish():
    one = {
        "id": "a",
        "kind": "straight",
        "start": (-5, 0),
        "goal": (5, 0),
        "speed": 1.0,
        "appears": 1.2,
        "vanishes": 4.0,
    }
    record = simulate(crossing(people=[one], duration=6.0), navigator=BlindDriver(goal=(0.0, 5.0)))
    there = np.isfinite(record.people_positions[:, 0, 0])
    np.testing.assert_array_equal(there, (record.time >= 1.2) & (record.time < 4.0))
    np.testing.assert_allclose(record.people_positions[there, 0, 0], [-5.0, -4.5, -4.0, -3.5, -3.0])


def test_walls_stop_people():
    wall = [(-1.0, -1.0), (-0.8, -1.0), (-0.8, 1.0), (-1.0, 1.0)]
    one = {"id": "a", "start": (-3.0, 0.0), "goal": (3.0, 0.0), "randomness": 0.3}
    for kind in ("straight", "unconcerned", "random"):
        scenario = crossing(people=[one | {"kind": kind}], walls=[wall], robot={"start": (9, -5), "goal": (9, 5)})
        path = simulate(scenario, navigator=BlindDriver(goal=(9.0, 5.0)), snapshots=0).people_positions[:, 0]
        assert Obstacles(polygons=[np.array(wall)]).free(path, 0.0).all()


def test_an_unknown_kind_is_named_with_the_nearest():
    scenario = crossing(people=[{"id": "a", "kind": "concernd", "start": (-5, 0)}])
    with pytest.raises(UnknownName, match=r"people.0.kind: got 'concernd'.*did you mean 'concerned'"):
        simulate(scenario, navigator=BlindDriver(goal=(0.0, 5.0)))


def test_other_rooms_bring_their_own_kinds():
    track = Track(agent="guest", kind="ped", time=np.array([0.0, 9.0]), positions=np.array([[4.0, 0.0], [4.0, 9.0]]))
    scenario = crossing(people=[{"id": "a", "kind": "guest", "start": (-5, 0)}], duration=2.0)
    kinds = {"guest": lambda scenario, index, generator: Recorded(track, 0.0, 0.3)}
    record = simulate(scenario, navigator=BlindDriver(goal=(0.0, 5.0)), kinds=kinds)
    np.testing.assert_allclose(record.people_positions[:, 0], [(4.0, t) for t in record.time])


def test_three_and_one_dimensions():
    for d in (1, 3):
        start, goal = [-3.0] + [0.0] * (d - 1), [3.0] + [0.0] * (d - 1)
        robot = {"start": [0.0] * (d - 1) + [9.0], "goal": [0.0] * (d - 1) + [12.0]}
        scenario = crossing(robot=robot, people=[{"id": "a", "start": start, "goal": goal, "randomness": 0.0}])
        record = simulate(scenario, navigator=BlindDriver(goal=tuple(robot["goal"]), speed=0.3), snapshots=0)
        assert record.people_positions.shape[2] == d
        np.testing.assert_allclose(record.people_positions[-1, 0], goal, atol=0.3)


def test_kinds_of_other_models_are_there_by_name():
    one = {"id": "a", "kind": "half-random", "start": (-5, 0), "goal": (5, 0), "randomness": 0.0, "speed": 1.0}
    record = simulate(crossing(people=[one], duration=5.0), navigator=BlindDriver(goal=(0.0, 5.0)))
    np.testing.assert_allclose(record.people_positions[-1, 0], (0.0, 0.0), atol=1e-9)
