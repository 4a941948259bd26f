"""Numbers of a run against hand-made runs and slow twins."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from blind_driver import BlindDriver, crossing
from sidestep.simulation.approach import closest_within_steps, contacts
from sidestep.simulation.loop import simulate
from sidestep.simulation.metrics import measure
from sidestep.simulation.record import Record

coordinates = st.floats(-5, 5, allow_nan=False, width=32)


def made(robot, people, *, radius=0.3, clearance=0.7, step=0.5, time_step=0.5, goals=None, **changes):
    """A record of a robot (T+1, d) and people (T+1, P, d)."""
    robot, people = np.asarray(robot, dtype=float), np.asarray(people, dtype=float)
    t, p, d = len(robot) - 1, people.shape[1], robot.shape[1]
    values = {
        "scenario": "made",
        "settings": {"duration": t * step, "robot": {"goal_tolerance": 0.3}},
        "seed": 0,
        "time": step * np.arange(t + 1),
        "robot_positions": robot,
        "robot_headings": np.full(t + 1, np.nan),
        "robot_velocities": np.diff(robot, axis=0) / step,
        "robot_goal": robot[-1],
        "robot_radius": radius,
        "people": tuple(f"p{i}" for i in range(p)),
        "people_radii": np.full(p, 0.3),
        "people_goals": np.full((p, d), np.nan) if goals is None else np.asarray(goals, dtype=float),
        "people_positions": people,
        "people_awareness": np.full((t + 1, p), np.nan),
        "beliefs": np.full((t, p), 0.5),
        "status": ("certified",) * t,
        "collision_probability": np.zeros((t, 3)),
        "risk": np.zeros((t, 3)),
        "plans": np.zeros((t, 4, d)),
        "planning_time": np.full(t, 0.002),
        "plan_age": np.zeros(t),
        "risk_limit": 0.05,
        "clearance": clearance,
        "time_step": time_step,
        "control_step": step,
        "snapshots": (),
        "walls": (),
        "reached_goal": True,
    }
    return Record(**(values | changes))


@settings(max_examples=60, deadline=None)
@given(arrays(np.float64, (3, 2), elements=coordinates), arrays(np.float64, (3, 2, 2), elements=coordinates))
def test_closest_approach_equals_a_fine_scan(robot, people):
    found = closest_within_steps(robot, people)
    share = np.linspace(0, 1, 4001)[:, None, None]
    for step in range(2):
        r = robot[step] + share[:, 0] * (robot[step + 1] - robot[step])
        p = people[step] + share * (people[step + 1] - people[step])
        scanned = np.linalg.norm(p - r[:, None], axis=-1).min(axis=0)
        assert np.all(found[step] <= scanned + 1e-9)
        np.testing.assert_allclose(found[step], scanned, atol=2e-2)


def test_two_who_swap_places_between_samples_touch():
    record = made([[0.0, 0.0], [2.0, 0.0]], [[[2.0, 0.0]], [[0.0, 0.0]]])
    m = measure(record)
    assert m.sampled_min_distance == pytest.approx(2.0)
    assert m.min_distance == pytest.approx(0.0, abs=1e-12)
    assert (m.clearance_violations, m.contacts_moving, m.contacts_standing) == (1, 1, 0)


def test_someone_who_walks_into_a_parked_robot_is_another_kind_of_contact():
    still = np.zeros((5, 2))
    walker = np.stack([np.linspace(-2, 2, 5), np.zeros(5)], axis=1)[:, None]
    m = measure(made(still, walker))
    assert (m.contacts_moving, m.contacts_standing) == (0, 1)


def test_drawing_back_from_a_contact_is_no_driving_into_it_but_driving_on_is():
    walker = np.zeros((4, 1, 2))
    walker[:, 0, 0] = [1.0, 0.4, 0.4, 0.4]
    back = np.array([[0.0, 0.0], [0.0, 0.0], [-0.1, 0.0], [-0.1, 0.0]])
    gone_on = np.array([[0.0, 0.0], [0.0, 0.0], [0.1, 0.0], [0.1, 0.0]])
    assert measure(made(back, walker)).contacts_standing == 1
    assert measure(made(gone_on, walker)).contacts_moving == 1


def test_each_unbroken_stretch_is_one_contact():
    robot = np.zeros((7, 2))
    walker = np.full((7, 1, 2), 3.0)
    walker[[2, 3], 0], walker[5, 0] = 0.1, 0.1
    record = made(robot, walker)
    gaps = np.linalg.norm(walker[1:] - robot[1:, None], axis=-1)
    assert contacts(record, gaps) == (0, 2)


def test_people_who_come_and_go_count_only_while_they_are_there():
    people = np.full((4, 2, 2), np.nan)
    people[1:3, 0] = [[1.0, 0.0], [0.8, 0.0]]
    m = measure(made(np.zeros((4, 2)), people))
    assert m.min_distance == pytest.approx(0.8)
    assert m.human_path_length == pytest.approx(0.2)
    empty = measure(made(np.zeros((4, 2)), np.full((4, 0, 2), np.nan)))
    assert math.isnan(empty.min_distance)
    assert empty.clearance_violations == 0


def test_indices_as_printed_and_as_lateral_offset():
    robot = np.array([[0.0, 0.0], [1.0, 1.0], [0.0, 2.0]])
    human = np.array([[[-1.0, 0.0]], [[0.0, 0.5]], [[1.0, 0.0]]])
    m = measure(made(robot, human, goals=[[1.0, 0.0]]))
    assert pytest.approx(4.0 + 2.0 + 0.0) == m.PI_R
    assert pytest.approx(4.0 + 1.25 + 0.0) == m.PI_H
    assert pytest.approx(m.PI_R + m.PI_H) == m.PI_T
    assert m.PI_R_lateral == pytest.approx(1.0)
    assert m.PI_H_lateral == pytest.approx(0.5)


def test_a_finer_record_of_the_same_motion_has_the_same_indices():
    t = np.linspace(0, 10, 21)
    coarse = np.stack([np.sin(t), t], axis=1)
    fine_t = np.linspace(0, 10, 101)
    fine = np.stack([np.interp(fine_t, t, coarse[:, 0]), fine_t], axis=1)
    nobody = np.zeros((21, 0, 2)), np.zeros((101, 0, 2))
    a = measure(made(coarse, nobody[0]))
    b = measure(made(fine, nobody[1], step=0.1))
    assert pytest.approx(a.PI_R) == b.PI_R
    assert b.PI_R_lateral == pytest.approx(a.PI_R_lateral)
    assert b.path_length == pytest.approx(a.path_length)


def test_turning_is_the_sum_of_the_angles_and_pauses_do_not_count():
    square = np.array([[0, 0], [1, 0], [1, 0], [1, 1], [0, 1], [0, 0]], dtype=float)
    assert measure(made(square, np.zeros((6, 0, 2)))).turning == pytest.approx(1.5 * np.pi)
    back = np.array([[0.0], [1.0], [0.0]])
    assert measure(made(back, np.zeros((3, 0, 1)))).turning == pytest.approx(np.pi)


def test_predicted_and_realised_violations_are_counted_where_plans_were_made():
    robot = np.zeros((5, 2))
    human = np.array([[2.0, 0], [2.0, 0], [0.5, 0], [0.5, 0], [2.0, 0]])[:, None]
    risk = np.zeros((4, 3))
    risk[:, 0] = [0.01, 0.2, 0.3, 0.04]
    m = measure(made(robot, human, risk=risk, plan_age=np.array([0.0, 0.0, 0.5, 0.0])))
    assert m.predicted_violations == pytest.approx(0.01 + 0.2 + 0.04)
    assert m.realised_violations == 1


def test_planning_time_leaves_out_the_steps_that_reused_a_plan():
    times = np.array([0.001, 0.0, 0.003, 0.0])
    m = measure(made(np.zeros((5, 2)), np.zeros((5, 0, 2)), planning_time=times, plan_age=np.array([0, 0.1, 0, 0.1])))
    assert (m.plan_median, m.plan_max) == (pytest.approx(2.0), pytest.approx(3.0))


def test_status_counts_name_all_three():
    m = measure(made(np.zeros((4, 2)), np.zeros((4, 0, 2)), status=("certified", "stopped", "certified")))
    assert m.status_counts == {"certified": 2, "least_risk": 0, "stopped": 1}


def test_arrival_is_the_first_instant_within_the_tolerance():
    scenario = crossing(stop_at_goal=False, duration=15.0, people=[])
    m = measure(simulate(scenario, navigator=BlindDriver(goal=(0.0, 5.0))))
    assert m.time_to_goal == pytest.approx(10.0)
    assert (m.steps, m.finished, m.reached_goal) == (30, True, True)
    cut = replace(simulate(scenario, navigator=BlindDriver(goal=(0.0, 5.0), speed=0.1)))
    assert math.isnan(measure(cut).time_to_goal)


@settings(max_examples=25, deadline=None)
@given(
    arrays(np.float64, (5, 2), elements=coordinates),
    arrays(np.float64, (5, 2, 2), elements=coordinates),
    st.floats(-np.pi, np.pi),
)
def test_turning_the_world_changes_no_number(robot, people, angle):
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    goals = people[-1]
    a = measure(made(robot, people, goals=goals))
    b = measure(made(robot @ turn.T, people @ turn.T, goals=goals @ turn.T))
    for name in ("min_distance", "PI_R", "PI_H", "PI_R_lateral", "path_length"):
        assert getattr(b, name) == pytest.approx(getattr(a, name), rel=1e-6, abs=1e-5)
