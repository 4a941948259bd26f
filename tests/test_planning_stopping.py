"""Bases that cannot change their velocity at once: against small steps of the base itself, and among people."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import settings as options
from hypothesis import strategies as st

import sidestep
from made_masses import still_person
from made_trips import Trip
from sidestep.lattice import Lattice
from sidestep.obstacles import Obstacles
from sidestep.planning.body import Body
from sidestep.planning.problem import PlanningProblem
from sidestep.planning.search import search
from sidestep.planning.stopping import LAG, Inertia
from sidestep.prediction.collision import RiskField
from sidestep.prediction.person_mass import PersonMass
from sidestep.robots import DifferentialDrive, Holonomic, RobotState
from sidestep.simulation.loop import simulate
from sidestep.simulation.metrics import measure
from sidestep.simulation.scenario import Scenario
from sidestep.studies.scale import encounter

STEP = 0.5
SMALL = 0.001  # s

speeds = st.floats(-1.0, 1.0)
bases = st.builds(
    lambda x, y, a, interval: Inertia(velocity=np.array([x, y]), acceleration=a, time_step=STEP, interval=interval),
    speeds, speeds, st.floats(0.2, 5.0), st.sampled_from([0.02, 0.1, 0.5]),
)  # fmt: skip


def driven(base: Inertia, asked: np.ndarray, hold: float, until: float) -> np.ndarray:
    """(T, d) m, every `SMALL` s: the base ramps to `asked` for `hold` s, then to standing. The slow twin."""
    robot = Holonomic(max_speed=50.0, max_acceleration=base.acceleration, shape="disc")
    state = RobotState(position=np.zeros(2), velocity=base.velocity)
    places = [state.position]
    for n in range(round(until / SMALL)):
        state = robot.executed(asked if (n + 0.5) * SMALL < hold else np.zeros(2), state, SMALL)
        places.append(state.position)
    return np.array(places)


@given(base=bases, x=speeds, y=speeds)
@options(max_examples=25, deadline=None)
def test_stops_are_where_small_steps_of_the_base_lead(base, x, y):
    means = np.array([[x, y]])
    stops = base.stops(means, 8)
    path = driven(base, base.asked(means)[0], base.interval, 4.0)
    halves = np.arange(1, stops.shifts.shape[1] + 1)
    assert stops.shifts[0] == pytest.approx(path[np.round(halves * STEP / 2 / SMALL).astype(int)], abs=5e-3)
    moved = np.linalg.norm(np.diff(path, axis=0), axis=1) > 1e-7
    last = np.flatnonzero(moved)[-1] * SMALL if moved.any() else 0.0
    if last < 3.9:
        assert stops.ends[0] == pytest.approx(path[-1], abs=5e-3)
    for half, moving in zip(halves, stops.moving[0], strict=True):
        if abs((half - 1) * STEP / 2 - last) > 0.01:
            assert moving == ((half - 1) * STEP / 2 < last)


@given(base=bases, angle=st.floats(0, 2 * math.pi), share=st.floats(0, 1))
@options(max_examples=60, deadline=None)
def test_what_is_asked_leads_along_the_plan(base, angle, share):
    change = share * base.largest_change * np.array([math.cos(angle), math.sin(angle)])
    mean = base.velocity + change
    asked = base.asked(mean[None])[0]
    path = driven(base, asked, STEP, STEP)
    planned = mean * np.linspace(0, STEP, len(path))[:, None]
    assert np.linalg.norm(path - planned, axis=1).max() <= LAG + 2e-3
    assert np.linalg.norm(asked - base.velocity) <= base.acceleration * STEP + 1e-9
    straight = np.linalg.norm(change) <= 0.5 * base.acceleration * STEP and float(mean @ change) >= 0
    if straight:  # speeding up, and within reach: the plan is met at the end of the step
        assert path[-1] == pytest.approx(mean * STEP, abs=2e-3)


@given(
    base=bases, angle=st.floats(0, 2 * math.pi), share=st.floats(0, 1), top=st.floats(0.1, 1.0),
    shape=st.sampled_from(["box", "disc"]),
)  # fmt: skip
@options(max_examples=100, deadline=None)
def test_what_is_asked_is_cut_to_the_top_speed_without_turning_it(base, angle, share, top, shape):
    robot = Holonomic(max_speed=top, shape=shape)
    velocity = robot.limited(base.velocity)
    mean = robot.limited(velocity + share * base.largest_change * np.array([math.cos(angle), math.sin(angle)]))
    limited = replace(base, velocity=velocity, top_speed=top, shape=shape)
    asked = limited.asked(mean[None])[0]
    assert robot.limited(asked) == pytest.approx(asked, abs=1e-9)
    free = replace(limited, top_speed=math.inf).asked(mean[None])[0]
    shares = np.linspace(0.0, 1.0, 2001)[:, None]
    line = mean + shares * (free - mean)
    allowed = [math.dist(robot.limited(point), point) < 1e-9 for point in line]
    last = np.flatnonzero(allowed)[-1]  # as far on the way to what would be asked without a limit as there is room
    assert asked == pytest.approx(line[last], abs=1e-3 * (1.0 + np.linalg.norm(free - mean)))
    path = driven(limited, asked, STEP, STEP)
    planned = mean * np.linspace(0, STEP, len(path))[:, None]
    assert np.linalg.norm(path - planned, axis=1).max() <= LAG + 2e-3


@given(base=bases)
@options(max_examples=40, deadline=None)
def test_a_stop_is_never_turned_into_a_way_back(base):
    assume(np.linalg.norm(base.velocity) < base.largest_change)
    asked = base.asked(np.zeros((1, 2)))[0]
    assert float(asked @ base.velocity) >= -1e-9
    assert np.linalg.norm(asked) <= 1e-9


@given(base=bases)
@options(max_examples=40, deadline=None)
def test_the_hardest_stop_stands_first(base):
    hardest = base.hardest_stop()
    gentler = 0.5 * (hardest + base.velocity)
    ends = np.linalg.norm(base.stops(np.array([hardest, gentler]), 40).ends, axis=1)
    assert ends[0] <= ends[1] + 1e-9
    at_full = np.linalg.norm(base.velocity) ** 2 / (2 * base.acceleration)  # m, braking from now on
    assert ends[0] >= at_full - 1e-9


@given(base=bases)
@options(max_examples=60, deadline=None)
def test_where_the_hardest_stop_is_meant_the_base_brakes_as_hard_as_it_can(base):
    hardest = base.hardest_stop()
    asked = base.asked(hardest[None])[0]
    assert (asked == 0.0).all()
    assert driven(base, asked, STEP, STEP)[-1] == pytest.approx(hardest * STEP, abs=2e-3)
    given_ = PlanningProblem(
        start=np.zeros(2), goal=np.ones(2), time_step=STEP, horizon=4, max_speed=2.0, inertia=base, shape="disc"
    )
    assert given_.first_step_costs(hardest[None])[0] == 0.0  # however far from the velocity now


def moving_up(speed: float, people: RiskField | None = None, **changes) -> PlanningProblem:
    """A robot under way along x, that needs `speed`²/2 m to stop."""
    base = Inertia(velocity=np.array([speed, 0.0]), acceleration=1.0, time_step=STEP, interval=0.1)
    return PlanningProblem(
        start=np.zeros(2), goal=np.array([4.0, 0.0]), time_step=STEP, max_speed=1.0, shape="disc",
        people=people, risk_limit=0.05, inertia=base, **{"horizon": 6, **changes},
    )  # fmt: skip


def test_what_cannot_be_stopped_in_time_is_not_begun():
    crowd = RiskField(people=[still_person(horizon=6, position=(1.25, 0.0))], distances=np.array([0.7]))
    cautious, fast = np.array([[0.7, 0.0]]), np.array([[1.0, 0.0]])
    given_ = moving_up(0.95, crowd)
    assert np.isinf(given_.first_step_costs(fast)[0])  # stands after 0.1 + 0.5 m, nearer than 0.7 m
    assert given_.first_step_costs(cautious)[0] == 0.0
    graded = moving_up(0.95, crowd, graded=True)
    assert 0.0 < graded.first_step_costs(fast)[0] < np.inf
    assert moving_up(0.95).first_step_costs(fast)[0] == 0.0

    wall = Obstacles(polygons=[[(0.8, -1.0), (1.0, -1.0), (1.0, 1.0), (0.8, 1.0)]])
    assert np.isinf(moving_up(0.95, obstacles=wall, margin=0.3).first_step_costs(fast * 0.95)[0])
    far = Obstacles(polygons=[[(1.4, -1.0), (1.5, -1.0), (1.5, 1.0), (1.4, 1.0)]])
    assert moving_up(0.95, obstacles=far, margin=0.3).first_step_costs(fast * 0.95)[0] == 0.0


def test_a_wall_in_the_way_to_a_stop_is_no_matter_of_degree():
    """However risky all that is left may be: who can still brake before a wall does not go on into it."""
    behind = RiskField(people=[still_person(6, (-0.3, 0.0))], distances=np.array([0.7]))
    wall = Obstacles(polygons=[[(1.35, -3.0), (1.5, -3.0), (1.5, 3.0), (1.35, 3.0)]])
    onward = np.stack([np.linspace(1.15, 1.65, 13), np.linspace(-0.1, 0.1, 13)], axis=1)
    assert np.isfinite(moving_up(1.4, behind, graded=True).first_step_costs(onward)).all()
    walled = moving_up(1.4, behind, graded=True, obstacles=wall, margin=0.3)
    near = wall.distance(walled.inertia.stops(onward, 8).ends) < 0.3
    assert (np.isinf(walled.first_step_costs(onward)) == near).all()
    assert np.isfinite(walled.first_step_costs(walled.inertia.hardest_stop()[None]))[0]  # 0.98 m

    late = moving_up(1.5, behind, graded=True, obstacles=wall, margin=0.3)  # needs 1.13 m: it will be too near
    assert late.steep_risk_weight <= late.first_step_costs(late.inertia.hardest_stop()[None])[0] < np.inf


@pytest.mark.parametrize("half", range(9))
def test_who_is_in_the_way_to_a_stop_at_another_time_is_not_in_the_way(half):
    """From 1 m/s at 1 m/s², with a call after 0.1 s, the base stands after 1.1 s: in the fifth quarter of a second."""
    sometimes = np.zeros(13)  # half instants 0 to 12, of 0.25 s
    sometimes[half] = 1.0
    somebody = PersonMass(
        lattice=Lattice(origin=np.zeros(2), spacing=1.0, radius=0), flat=sometimes,
        offsets=np.arange(14), radii=np.zeros(13, dtype=np.int64),
    )  # fmt: skip
    for horizon in (2, 6):  # nobody knows of people after it
        given_ = moving_up(1.0, RiskField(people=[somebody], distances=np.array([2.0])), horizon=horizon)
        met = 1 <= half <= min(5, 2 * horizon)
        assert np.isinf(given_.first_step_costs(np.array([[1.0, 0.0]]))[0]) == met
        onward = np.arange(horizon + 1)[:, None] * np.array([[0.5, 0.0]])
        assert given_.can_stop(onward) == (not met)


def test_nobody_can_stop_in_time_where_a_wall_or_somebody_who_stands_is_nearer():
    onward = np.arange(7)[:, None] * np.array([[0.5, 0.0]])
    for room, can in ((0.58, False), (0.64, True)):  # it stands after 0.1 + 0.5 m
        wall = Obstacles(polygons=[[(room + 0.3, -1.0), (2.0, -1.0), (2.0, 1.0), (room + 0.3, 1.0)]])
        assert moving_up(1.0, obstacles=wall, margin=0.3).can_stop(onward) is can
        state, robot = RobotState(position=(0.0, 0.0), velocity=(1.0, 0.0)), Holonomic(max_acceleration=1.0)
        body = Body(
            robot=robot, state=state, interval=0.1, people=np.array([[room + 0.6, 0.0]]), contacts=np.array([0.6])
        )
        assert moving_up(1.0, body=body).can_stop(onward) is can
        free = replace(moving_up(1.0, body=replace(body, robot=Holonomic())), inertia=None)  # which goes 0.1 m
        assert free.can_stop(onward)


def test_whoever_stands_may_stand_whatever_comes():
    crowd = RiskField(people=[still_person(horizon=6, position=(0.3, 0.0))], distances=np.array([0.7]))
    costs = moving_up(0.0, crowd).first_step_costs(np.array([[0.0, 0.0], [0.2, 0.0]]))
    assert costs[0] == 0.0
    assert np.isinf(costs[1])


@pytest.mark.parametrize("horizon", [1, 2, 3])
def test_short_horizons_are_planned_too(horizon):
    planner = sidestep.Planner(robot=Holonomic(max_acceleration=0.5, shape="disc"), goal=(0.0, 6.0), horizon=horizon)
    near = sidestep.PersonObservation(id="p", position=(1.6, 1.5), velocity=(-0.6, 0.0))
    plan = planner.step(time=0.0, robot=RobotState(position=(0.0, 0.0), velocity=(0.4, 0.4)), people=[near])
    assert plan.status in ("certified", "least_risk"), plan.reason


@pytest.mark.parametrize("acceleration", [0.5, 1.0])
def test_every_step_of_a_plan_can_follow_the_one_before(acceleration):
    base = Inertia(velocity=np.array([0.0, -0.8]), acceleration=acceleration, time_step=STEP, interval=0.1)
    crowd = RiskField(people=[still_person(horizon=8, position=(1.5, 0.1))], distances=np.array([0.7]))
    given_ = PlanningProblem(
        start=np.zeros(2), goal=np.array([3.5, 0.0]), time_step=STEP, horizon=8, max_speed=1.0, shape="disc",
        people=crowd, risk_limit=0.05, inertia=base,
    )  # fmt: skip
    found = search(given_)
    assert found.feasible
    assert given_.allows(found.path)
    tap = found.maps.spacing / STEP
    changes = np.linalg.norm(np.diff(found.path, n=2, axis=0), axis=1) / STEP
    assert changes.max() <= max(acceleration * STEP, tap) + 1e-6
    free = search(replace(given_, inertia=None))
    assert free.cost <= found.cost + 1e-6
    assert np.linalg.norm(np.diff(free.path, n=2, axis=0), axis=1).max() / STEP > changes.max()


SLUGGISH = {
    "1.5 m/s, 0.5 m/s²": Holonomic(max_speed=1.5, max_acceleration=0.5),
    "2 m/s, 0.3 m/s²": Holonomic(max_speed=2.0, max_acceleration=0.3, shape="disc"),
    "it turns slowly": DifferentialDrive(max_speed=1.5, max_acceleration=2.0, max_turn_acceleration=1.0),
}
"""Bases that change their velocity in a step by less than a cell of the search's lattice."""


@pytest.mark.parametrize("name", SLUGGISH)
@pytest.mark.parametrize("period", [0.1, 0.5])
def test_a_base_of_little_acceleration_gets_going_and_arrives(name, period):
    robot = SLUGGISH[name]
    heading = 2.0 if isinstance(robot, DifferentialDrive) else None
    planner = sidestep.Planner(robot=robot, goal=(6.0, 3.0), horizon=8, time_step=0.5)
    trip = Trip(planner, heading=heading, period=period, within=0.3).run(40.0)
    assert trip.arrived
    top, a = robot.planning_speed, robot.planning_acceleration
    least = math.hypot(6.0, 3.0) / top + top / a  # s, speeding up and braking; the axes of a box may be faster
    assert trip.time + period < 1.6 * least + 2.0


@pytest.mark.parametrize(("horizon", "told"), [(5, True), (6, False)])
def test_a_horizon_that_ends_before_the_base_stands_is_told(horizon, told, caplog):
    robot = Holonomic(max_speed=1.5, max_acceleration=0.5)
    sidestep.Planner(robot=robot, goal=(6.0, 3.0), horizon=horizon, time_step=0.5)
    assert ("3 s from full speed" in caplog.text) == ("ask for 6 steps" in caplog.text) == told


def test_rehearsals_of_shorter_horizons_warn_of_nothing(caplog):
    robot = Holonomic(max_speed=1.5, max_acceleration=0.6)
    sidestep.Planner(robot=robot, goal=(6.0, 3.0), time_step=0.5, deadline=1.0)
    assert "planner.horizon" not in caplog.text


@pytest.mark.parametrize("name", SLUGGISH)
def test_it_gets_away_from_a_wall_that_it_stands_beside_and_around_a_corner(name):
    robot = SLUGGISH[name]
    heading = 1.0 if isinstance(robot, DifferentialDrive) else None
    walls = Obstacles(polygons=[[(-2.0, -1.0), (2.0, -1.0), (2.0, 0.0), (-2.0, 0.0)]])
    planner = sidestep.Planner(robot=robot, goal=(0.0, -2.5), obstacles=walls, horizon=8, time_step=0.5)
    trip = Trip(planner, (0.0, robot.radius + 0.02), heading=heading, within=0.3).run(80.0)
    assert trip.arrived
    assert trip.to_walls() > robot.radius - 0.01


HARD = {0.5: (7, 12, 13, 19, 21, 24, 41, 57, 74, 78), 1.0: (21, 41, 74, 78, 143, 148, 151, 163, 177, 186)}
"""Encounters in every one of which such a base ran into the person when only its first action was limited."""


@pytest.mark.slow
@pytest.mark.parametrize("acceleration", HARD)
def test_bases_that_brake_slowly_do_not_run_into_people_who_do_not_look(acceleration):
    moving = standing = 0
    for seed in HARD[acceleration]:
        data = encounter(seed, "unconcerned").settings()
        data["robot"] |= {"max_acceleration": acceleration, "shape": "disc"}
        record = simulate(Scenario.parse(data | {"control_step": 0.1, "planning_period": 0.5}), snapshots=0)
        m = measure(record)
        assert m.reached_goal
        moving += m.contacts_moving > 0
        standing += m.contacts_standing > 0
    assert moving <= 2
    assert standing <= 2


def test_the_plan_says_when_no_stop_is_safe_any_more():
    planner = sidestep.Planner(robot=Holonomic(max_acceleration=0.5, shape="disc"), goal=(6.0, 0.0))
    ahead = sidestep.PersonObservation(id="p", position=(1.4, 0.0), velocity=(-1.0, 0.0))
    plan = planner.step(time=0.0, robot=RobotState(position=(0.0, 0.0), velocity=(1.0, 0.0)), people=[ahead])
    assert plan.status == "least_risk"
    assert "no motion leaves a safe stop" in plan.reason
    assert plan.velocity[0] < 0.9  # it brakes or turns away all the same
    far = sidestep.PersonObservation(id="p", position=(4.0, 3.0), velocity=(-1.0, 0.0))
    planner.reset()
    plan = planner.step(time=0.0, robot=RobotState(position=(0.0, 0.0), velocity=(1.0, 0.0)), people=[far])
    assert plan.status == "certified"
    broken = RobotState(position=(0.0, 0.0), velocity=(math.nan, 0.0))
    assert planner.step(time=0.1, robot=broken, people=[far]).status in ("certified", "least_risk", "stopped")


def test_a_velocity_that_nobody_measured_is_taken_from_the_way_made():
    def plan_for(velocity):
        planner = sidestep.Planner(robot=Holonomic(max_acceleration=0.5, shape="disc"), goal=(0.0, 6.0))
        for k in range(3):
            state = RobotState(position=(0.3 * k, 0.0), velocity=velocity)
            plan = planner.step(time=0.3 * k, robot=state, people=[])
        return plan

    measured, inferred = plan_for((1.0, 0.0)), plan_for(None)
    assert inferred.velocity == pytest.approx(measured.velocity)
    assert inferred.velocity[0] > 0.5  # it cannot turn at once
    free = sidestep.Planner(robot=Holonomic(shape="disc"), goal=(0.0, 6.0))
    assert free.step(time=0.0, robot=RobotState(position=(0.0, 0.0)), people=[]).velocity[0] == pytest.approx(0.0)


def test_where_nobody_measures_it_a_velocity_that_changes_steadily_is_that_of_now():
    """x = ½·a·t²: the mean since the last call lags by half an interval."""

    def plan_for(measured):
        planner = sidestep.Planner(robot=Holonomic(max_acceleration=1.0, shape="disc"), goal=(0.0, 6.0))
        for time in (0.0, 0.2, 0.4, 0.6):
            velocity = (time, 0.0) if measured else None
            state = RobotState(position=(0.5 * time**2, 0.0), velocity=velocity)
            plan = planner.step(time=time, robot=state, people=[])
        return plan

    assert plan_for(measured=False).velocity == pytest.approx(plan_for(measured=True).velocity)


@pytest.mark.parametrize(("speed", "dimension", "most"), [(1.5, 2, 0.45), (2.0, 2, 0.6), (1.5, 3, 0.6)])
def test_a_base_of_little_acceleration_stops_at_its_goal(speed, dimension, most):
    robot = Holonomic(max_speed=speed, radius=0.2, shape="disc", max_acceleration=0.5)
    goal = np.array([4.8, 3.6, 0.0])[:dimension]
    trip = Trip(sidestep.Planner(robot=robot, goal=goal, horizon=5), np.zeros(dimension), heading=None)
    trip.run(20.0)
    for _ in range(30):
        trip.step()
    along = np.array(trip.path) @ goal / 6.0
    assert along.max() < 6.0 + most
    assert np.linalg.norm(trip.state.position - goal) < 0.2


@pytest.mark.parametrize(("speed", "acceleration", "most"), [(1.0, 1.0, 0.25), (1.5, 0.5, 0.45)])
def test_asked_once_a_second_it_brakes_before_its_goal(speed, acceleration, most):
    robot, goal = Holonomic(max_speed=speed, max_acceleration=acceleration), np.array([3.0, 0.4])
    for start in ((0.0, 0.0), (-1.83, -0.53), (-0.4, 0.16)):
        trip = Trip(sidestep.Planner(robot=robot, goal=goal, time_step=1.0), start, period=1.0, within=0.0).run(16.0)
        beyond = (np.array(trip.path) - goal) @ (goal - start) / np.linalg.norm(goal - start)
        assert beyond.max() < most, str(trip)
        assert np.linalg.norm(trip.state.position - goal) < 0.25, str(trip)


RARE = {
    "on a disc": Holonomic(max_speed=1.0, shape="disc", max_acceleration=0.5),
    "in a box": Holonomic(max_speed=2.0, max_acceleration=0.5),
    "two wheels": DifferentialDrive(max_speed=1.0, max_acceleration=1.0, max_turn_acceleration=4.0),
}


@pytest.mark.parametrize("kind", RARE)
def test_called_ten_times_rarer_than_steps_it_comes_to_its_goal_and_stays(kind):
    """It was asked for no more than it can do within a step, a tenth of its acceleration: it went past and around."""
    planner = sidestep.Planner(robot=RARE[kind], goal=(5.0, 3.0), time_step=0.1, timeout=2.0)
    trip = Trip(planner, period=1.0, within=0.3).run(16.0)
    assert trip.arrived, str(trip)
    for _ in range(8):
        trip.step()
    assert trip.arrived, str(trip)


@pytest.mark.parametrize(("acceleration", "time_step", "period", "most"), [(0.5, 0.2, 0.1, 7.0), (0.2, 0.5, 0.5, 12.0)])
def test_a_base_that_goes_askew_does_not_circle_around_its_goal(acceleration, time_step, period, most):
    """What would end beside the goal was not charged, only what would end beyond it."""
    robot = Holonomic(max_speed=2.0, max_acceleration=acceleration)
    planner = sidestep.Planner(robot=robot, goal=(5.0, 3.0), time_step=time_step)
    trip = Trip(planner, period=period, within=0.3).run(most)
    assert trip.arrived, str(trip)
