"""Robots: what is commanded, and where it leads."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as options
from hypothesis import strategies as st

from sidestep.errors import InvalidInput
from sidestep.robots import DifferentialDrive, Holonomic, RobotState

ANGLE = st.floats(-math.pi, math.pi)
PACE = st.floats(-2.0, 2.0)


def unit(angle):
    return np.array([math.cos(angle), math.sin(angle)])


def integrated(robot, command, state, dt, steps=4000):
    """Unicycle by small steps."""
    x, heading = np.array(state.position), state.heading
    for _ in range(steps):
        x = x + command[0] * dt / steps * unit(heading + 0.5 * command[1] * dt / steps)
        heading += command[1] * dt / steps
    return x, heading


@given(x=PACE, y=PACE, shape=st.sampled_from(["box", "disc"]))
def test_holonomic_limits_keep_the_direction(x, y, shape):
    robot = Holonomic(max_speed=0.8, shape=shape)
    u = robot.limited((x, y))
    size = np.abs(u).max() if shape == "box" else np.linalg.norm(u)
    assert size <= 0.8 + 1e-12
    assert u[0] * y == pytest.approx(u[1] * x, abs=1e-12)
    if max(abs(x), abs(y)) <= 0.5:
        assert u == pytest.approx([x, y])
    state = RobotState(position=(1.0, 2.0))
    assert robot.command((x, y), state) == pytest.approx(u)
    assert robot.executed((x, y), state, 0.5).position == pytest.approx(np.array([1.0, 2.0]) + 0.5 * u)
    assert robot.reference(state) == pytest.approx([1.0, 2.0])
    assert robot.planning_radius == robot.radius


@given(vx=st.floats(-0.7, 0.7), vy=st.floats(-0.7, 0.7), ux=st.floats(-0.7, 0.7), uy=st.floats(-0.7, 0.7))
def test_limited_acceleration_ramps_straight_to_the_command(vx, vy, ux, uy):
    robot = Holonomic(max_acceleration=0.9, shape="disc")
    state = RobotState(position=(0.0, 0.0), velocity=(vx, vy))
    after = robot.executed((ux, uy), state, 0.4)
    assert np.linalg.norm(after.velocity - [vx, vy]) <= 0.9 * 0.4 + 1e-12
    t = np.linspace(0, 0.4, 4001)
    change = np.array([ux - vx, uy - vy])
    share = np.minimum(1.0, 0.9 * t / max(np.linalg.norm(change), 1e-12))
    way = np.trapezoid(np.array([vx, vy]) + share[:, None] * change, t, axis=0)
    assert after.position == pytest.approx(way, abs=1e-6)
    lag = np.linalg.norm(after.position - 0.4 * np.array([ux, uy]))
    assert lag <= np.linalg.norm(change) ** 2 / (2 * 0.9) + 1e-9


@given(heading=ANGLE, direction=ANGLE, speed=st.floats(0, 1))
@options(max_examples=40)
def test_reference_moves_as_planned_at_the_first_instant(heading, direction, speed):
    robot = DifferentialDrive(max_speed=0.7, max_turn_rate=3.0)
    state = RobotState(position=(0.3, -0.2), heading=heading)
    u = speed * robot.planning_speed * unit(direction)
    v, turn = robot.command(u, state)
    assert abs(v) <= robot.max_speed + 1e-9
    assert abs(turn) <= robot.max_turn_rate + 1e-9
    dt = 1e-5
    after = robot.executed((v, turn), state, dt)
    moved = (robot.reference(after) - robot.reference(state)) / dt
    assert moved == pytest.approx(u, abs=1e-4)
    assert after.velocity == pytest.approx(u, abs=1e-4)
    assert robot.reference_velocity(after) is after.velocity


@given(v=st.floats(-0.7, 0.7), turn=st.floats(-3, 3), heading=ANGLE)
@options(max_examples=30)
def test_arcs_are_exact(v, turn, heading):
    robot = DifferentialDrive(max_speed=0.7, max_turn_rate=3.0)
    state = RobotState(position=(1.0, 1.0), heading=heading)
    after = robot.executed((v, turn), state, 0.8)
    x, end = integrated(robot, (v, turn), state, 0.8)
    assert after.position == pytest.approx(x, abs=1e-6)
    assert after.heading == pytest.approx(end)


@given(vx=PACE, vy=PACE, heading=ANGLE)
@options(max_examples=40)
def test_differential_limits_scale_both_parts_alike(vx, vy, heading):
    robot = DifferentialDrive(max_speed=0.5, max_turn_rate=1.0, reference_offset=0.2)
    state = RobotState(position=(0.0, 0.0), heading=heading)
    v, turn = robot.command((vx, vy), state)
    assert abs(v) <= 0.5 + 1e-12
    assert abs(turn) <= 1.0 + 1e-12
    along, across = unit(heading) @ [vx, vy], unit(heading + math.pi / 2) @ [vx, vy]
    assert v * across / 0.2 == pytest.approx(turn * along, abs=1e-9)


@given(heading=ANGLE, direction=ANGLE, speed=st.floats(0, 1), dt=st.sampled_from([0.1, 0.5, 1.0]))
@options(max_examples=60)
def test_followed_path_stays_within_five_centimetres(heading, direction, speed, dt):
    robot = DifferentialDrive(max_speed=0.7, max_turn_rate=3.14)
    state = RobotState(position=(0.0, 0.0), heading=heading)
    u = speed * robot.planning_speed * unit(direction)
    start = robot.reference(state)
    pieces = 20
    for i in range(pieces):
        state = robot.follow(u, state, dt / pieces)
        planned = start + u * dt * (i + 1) / pieces
        assert np.linalg.norm(robot.reference(state) - planned) < 0.05
    assert robot.reference(state) == pytest.approx(start + u * dt, abs=0.01)
    whole = robot.follow(u, RobotState(position=(0.0, 0.0), heading=heading), dt)
    assert robot.reference(whole) == pytest.approx(start + u * dt, abs=0.01)


@given(heading=ANGLE, direction=ANGLE)
@options(max_examples=30)
def test_held_command_ends_where_the_plan_does(heading, direction):
    robot = DifferentialDrive(max_speed=0.7, max_turn_rate=6.0, reference_offset=0.25)
    state = RobotState(position=(0.0, 0.0), heading=heading)
    u = 0.5 * unit(direction)
    after = robot.executed(robot.command(u, state, hold=0.2), state, 0.2)
    assert robot.reference(after) == pytest.approx(robot.reference(state) + 0.2 * u, abs=1e-6)


def test_differential_accelerations_are_kept():
    robot = DifferentialDrive(max_acceleration=0.5, max_turn_acceleration=2.0)
    state = RobotState(position=(0.0, 0.0), heading=0.3, velocity=0.2 * unit(0.3))
    before = np.array([0.2, 0.0])
    for _ in range(30):
        command = np.array([0.7, -3.0])
        after = robot.executed(command, state, 0.1)
        twist = np.array([unit(after.heading) @ after.velocity,
                          unit(after.heading + math.pi / 2) @ after.velocity / robot.offset])  # fmt: skip
        assert np.abs(twist - before)[0] <= 0.05 + 1e-9
        assert np.abs(twist - before)[1] <= 0.2 + 1e-9
        state, before = after, twist
    assert before == pytest.approx([0.7, -3.0])
    assert robot.planning_acceleration == pytest.approx(min(0.5, 2.0 * robot.offset))
    assert DifferentialDrive().planning_acceleration is None


def test_every_planned_velocity_is_executable_at_every_heading():
    for robot in (DifferentialDrive(), DifferentialDrive(max_turn_rate=0.5), DifferentialDrive(reference_offset=0.1)):
        assert robot.planning_speed <= robot.max_speed
        for heading in np.linspace(0, 6, 13):
            for direction in np.linspace(0, 6, 13):
                state = RobotState(position=(0.0, 0.0), heading=heading)
                u = robot.planning_speed * unit(direction)
                v, turn = robot.command(u, state)
                back = v * unit(heading) + turn * robot.offset * unit(heading + math.pi / 2)
                assert back == pytest.approx(u)
        assert robot.planning_radius == pytest.approx(robot.radius + robot.offset)


@pytest.mark.parametrize("made", [
    lambda: Holonomic(max_speed=0.0),
    lambda: Holonomic(radius=-1.0),
    lambda: Holonomic(max_acceleration=math.nan),
    lambda: Holonomic(shape="star"),
    lambda: DifferentialDrive(max_speed=math.inf),
    lambda: DifferentialDrive(max_turn_rate=0.0),
    lambda: DifferentialDrive(reference_offset=0.0),
    lambda: DifferentialDrive(max_turn_acceleration=-1.0),
    lambda: DifferentialDrive(control_period=0.0),
])  # fmt: skip
def test_impossible_robots_are_refused_in_one_line(made):
    with pytest.raises(InvalidInput, match=r"^robot\.\w+: got .*; allowed: [^\n]*$"):
        made()


def test_differential_drive_asks_for_a_heading():
    with pytest.raises(InvalidInput, match="heading"):
        DifferentialDrive().reference(RobotState(position=(0.0, 0.0)))


@given(st.integers(0, 10_000))
def test_an_axle_comes_nearer_to_a_wall_than_the_radius_only_where_its_reference_is_nearer_than_the_wall_margin(seed):
    rng = np.random.default_rng(seed)
    robot = DifferentialDrive(radius=float(rng.uniform(0.1, 0.5)), reference_offset=float(rng.uniform(0.05, 0.4)))
    places = rng.uniform(-2.0, 2.0, (40, 2))  # of walls
    state = RobotState(position=(0.0, 0.0), heading=float(rng.uniform(-3, 3)))
    places = places[np.linalg.norm(places, axis=1) > robot.radius]
    nearest = np.full(len(places), np.inf)  # m from the reference
    for _ in range(20):
        command = rng.uniform(0.0, robot.max_speed), rng.uniform(-1.0, 1.0) * robot.max_turn_rate
        for _ in range(20):
            state = robot.executed(command, state, 0.01)
            nearest = np.minimum(nearest, np.linalg.norm(places - robot.reference(state), axis=1))
            hit = np.linalg.norm(places - state.position, axis=1) < robot.radius
            assert (nearest[hit] < robot.wall_margin + 0.01).all()
