"""What the planner is told: noisy, incomplete, and never about the future."""

import numpy as np
import pytest

from blind_driver import BlindDriver, crossing
from sidestep.simulation.loop import simulate
from sidestep.simulation.recordings import Recording, Track


def told(scenario, **more):
    """What a blind driver hears in a run."""
    driver = BlindDriver(goal=scenario.robot.goal)
    record = simulate(scenario, navigator=driver, snapshots=0, **more)
    return driver.heard, record


def zigzag():
    """A person who turns at random at every decision."""
    return {"id": "a", "kind": "random", "start": (-4, 0), "goal": (5, 0)}


def test_velocities_are_those_of_the_step_before():
    heard, record = told(crossing(people=[zigzag()]))
    path = record.people_positions[:, 0]
    assert heard[0][2][0].velocity is None
    for k, (_, _, people) in enumerate(heard[1:], start=1):
        np.testing.assert_allclose(people[0].velocity, (path[k] - path[k - 1]) / 0.5, atol=1e-9)


def test_the_coming_action_does_not_leak_through_the_velocity():
    heard, record = told(crossing(people=[zigzag()], duration=200.0, stop_at_goal=False, control_step=0.1))
    path = record.people_positions[:, 0]
    seen = np.array([people[0].velocity for _, _, people in heard[1:-1]])
    coming = np.array([(path[5 * k + 5] - path[5 * k]) / 0.5 for k in range(1, len(heard) - 1)])
    assert abs(np.corrcoef(seen[:, 0], coming[:, 0])[0, 1]) < 0.15


def test_arriving_velocity_is_known_at_once_where_the_scenario_says_so():
    one = {"id": "a", "kind": "standing", "start": (-4, 0), "goal": (5, 0), "arrives_with": (1.0, 0.5)}
    heard, _ = told(crossing(people=[one]))
    np.testing.assert_allclose(heard[0][2][0].velocity, (1.0, 0.5))
    np.testing.assert_allclose(heard[1][2][0].velocity, (0.0, 0.0))


def test_noise_has_the_given_size_and_is_declared():
    one = {"id": "a", "kind": "standing", "start": (-4, 0)}
    scenario = crossing(people=[one], measurement={"position_noise": 0.1}, duration=500.0, stop_at_goal=False)
    heard, _ = told(scenario)
    positions = np.array([people[0].position for _, _, people in heard])
    assert positions.std(axis=0) == pytest.approx([0.1, 0.1], rel=0.1)
    assert positions.mean(axis=0) == pytest.approx([-4.0, 0.0], abs=0.02)
    np.testing.assert_allclose(heard[0][2][0].position_covariance, 0.01 * np.eye(2))
    velocities = np.array([people[0].velocity for _, _, people in heard[1:]])
    np.testing.assert_allclose(heard[5][2][0].velocity_covariance, np.eye(2) * velocities.var(), rtol=0.2)


def test_dropped_people_are_missing_as_often_as_said():
    one = {"id": "a", "kind": "standing", "start": (-4, 0)}
    heard, record = told(crossing(people=[one], measurement={"dropout": 0.3}, duration=400.0, stop_at_goal=False))
    assert np.mean([len(people) for _, _, people in heard]) == pytest.approx(0.7, abs=0.06)
    assert np.isfinite(record.people_positions).all()  # what happened is recorded, not what was seen


def test_a_goal_is_told_only_where_it_is_known():
    both = [zigzag(), zigzag() | {"id": "b", "start": (4, 0), "goal_known": False}]
    heard, _ = told(crossing(people=both))
    a, b = heard[0][2]
    np.testing.assert_allclose(a.goal, (5, 0))
    assert b.goal is None


def test_far_and_hidden_people_are_not_seen():
    near, far = ({"id": n, "kind": "standing", "start": (x, 0.0)} for n, x in (("near", 3.0), ("far", 9.0)))
    heard, _ = told(crossing(people=[near, far], measurement={"range": 8.0}))
    assert [p.id for p in heard[0][2]] == ["near"]
    wall = [(4.0, -2.0), (4.2, -2.0), (4.2, 2.0), (4.0, 2.0)]
    heard, _ = told(crossing(people=[near, far], walls=[wall], measurement={"occlusion": True}))
    assert [p.id for p in heard[10][2]] == ["near"]
    heard, _ = told(crossing(people=[near, far], walls=[wall]))
    assert [p.id for p in heard[10][2]] == ["near", "far"]


def test_two_robots_with_the_same_seed_meet_the_same_luck():
    scenario = crossing(people=[zigzag(), zigzag() | {"id": "b", "start": (4, 0)}], measurement={"position_noise": 0.1})
    heard = []
    for speed in (0.2, 1.0):
        driver = BlindDriver(goal=(0.0, 5.0), speed=speed)
        record = simulate(scenario, navigator=driver, snapshots=0)
        heard.append((record.people_positions[:15], [p.position for _, _, people in driver.heard[:15] for p in people]))
    np.testing.assert_array_equal(heard[0][0], heard[1][0])
    np.testing.assert_array_equal(heard[0][1], heard[1][1])


def recording(times, places):
    track = Track(agent="r", kind="ped", time=np.array(times), positions=np.array(places))
    return Recording(name="s", tracks=(track,))


def replay(*, start, step, duration):
    clock = {"control_step": step, "planning_period": step, "duration": duration}
    return crossing(people=[], recording={"file": "f", "scene": "s", "start": start}, **clock)


def test_recorded_velocities_use_samples_up_to_now_only():
    held = recording([0.0, 0.4, 0.8, 1.2, 1.6], [[0, 9], [1, 9], [1, 9], [3, 9], [3, 9]])
    scenario = crossing(
        people=[],
        recording={"file": "f", "scene": "s", "start": 0.4},
        control_step=0.1,
        planning_period=0.1,
        duration=1.0,
    )
    heard, record = told(scenario, recording=held)
    velocities = {round(t, 6): people[0].velocity for t, _, people in heard}
    np.testing.assert_allclose(velocities[0.0], (2.5, 0.0))  # 0 → 0.4 s of the recording
    np.testing.assert_allclose(velocities[0.3], (2.5, 0.0))  # between samples: nothing new is known
    np.testing.assert_allclose(velocities[0.4], (0.0, 0.0))
    np.testing.assert_allclose(velocities[0.9], (5.0, 0.0))
    np.testing.assert_allclose(record.people_positions[1, 0], (1.0, 9.0))


def test_changing_the_future_of_a_recording_changes_nothing_that_was_told_before():
    times = [0.0, 0.4, 0.8, 1.2]
    scenario = crossing(
        people=[],
        recording={"file": "f", "scene": "s", "start": 0.0},
        control_step=0.4,
        planning_period=0.4,
        duration=1.2,
    )
    a, _ = told(scenario, recording=recording(times, [[0, 9], [1, 9], [2, 9], [3, 9]]))
    b, _ = told(scenario, recording=recording(times, [[0, 9], [1, 9], [2, 9], [0, 0]]))
    for (_, _, p), (_, _, q) in zip(a, b, strict=True):
        np.testing.assert_array_equal(p[0].position, q[0].position)
        assert (p[0].velocity is None) == (q[0].velocity is None)
        if p[0].velocity is not None:
            np.testing.assert_array_equal(p[0].velocity, q[0].velocity)
