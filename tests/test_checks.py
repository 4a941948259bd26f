"""Bad values of the frozen settings: one line that names the field, whatever was passed; good ones are settled."""

import copy
import dataclasses
import math
import pickle

import numpy as np
import pytest

from sidestep import (
    Announced,
    DifferentialDrive,
    Holonomic,
    HumanModel,
    Obstacles,
    PersonObservation,
    Planner,
    PlannerSettings,
    RobotState,
)
from sidestep.checks import one_of
from sidestep.errors import InvalidFile, InvalidInput, MissingExtra, OutputError, SidestepError, UnknownName
from sidestep.human.habit_settings import HabitSettings
from sidestep.human.reaction import ReactionSettings
from sidestep.obstacles import OccupancyGrid
from sidestep.safety_filter import SafetyFilter
from sidestep.simulation.loop import simulate
from sidestep.simulation.scenario import Scenario

MADE = (HumanModel, HabitSettings, ReactionSettings, PlannerSettings, Holonomic, DifferentialDrive)
FIELDS = [(cls, field.name) for cls in MADE for field in dataclasses.fields(cls)]
NEVER = (
    math.nan,
    "fast",
    [math.nan],
    [[1.0, "a"]],
    [[]],
    np.array([[1.0, np.nan]]),
    np.array(["a"]),
    {1: "a"},
    object(),
)
SQUARE = [(1.0, 1.0), (2.0, 1.0), (2.0, 2.0)]


@pytest.mark.parametrize(("cls", "name"), FIELDS)
@pytest.mark.parametrize("value", NEVER, ids=lambda v: repr(v)[:12])
def test_what_no_field_can_be_is_refused_in_one_line_that_names_it(cls, name, value):
    with pytest.raises(InvalidInput, match=rf"\.{name}: got .*; allowed: ") as caught:
        cls(**{name: value})
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize(("cls", "name"), FIELDS)
def test_the_default_of_every_field_is_allowed_and_kept(cls, name):
    value = getattr(cls(), name)
    assert getattr(cls(**{name: value}), name) == value


@pytest.mark.parametrize(
    ("cls", "name", "value"),
    [
        (HumanModel, "walking_speed", True),
        (HumanModel, "walking_speed", 10**400),
        (HumanModel, "reach", 2.5),
        (HumanModel, "reach", True),
        (HumanModel, "frame", "hedding"),
        (HumanModel, "speed_range", (2.0, 1.0)),
        (HumanModel, "speed_range", (1.0, 2.0, 3.0)),
        (HumanModel, "goal_weight", ()),
        (HumanModel, "goal_weight", (1.0, -1.0)),
        (HumanModel, "goals", "doors"),
        (HumanModel, "goals", [(1.0, 2.0), (1.0,)]),
        (HumanModel, "goals", [1.0, 2.0]),
        (HumanModel, "rationality", np.array([1.0, 2.0])),
        (HumanModel, "motion_filter", 1),
        (HumanModel, "habits", {}),
        (HabitSettings, "randomness_range", (0.5, 1.5)),
        (HabitSettings, "walking_modes", (0.5, 0.5)),
        (HumanModel, "radius", 101.0),
        (HumanModel, "danger_weight", 1e300),
        (HumanModel, "goal_weight", 1e300),
        (PlannerSettings, "midway", "no"),
        (Holonomic, "max_speed", None),
        (DifferentialDrive, "radius", None),
    ],
)
def test_what_this_field_cannot_be_is_refused(cls, name, value):
    with pytest.raises(InvalidInput, match=rf"\.{name}: got .*; allowed: "):
        cls(**{name: value})


def test_sequences_become_tuples_and_numbers_of_numpy_plain_ones():
    human = HumanModel(
        goals=np.array([[1, 2], [3, 4]]), goal_weight=[1, 2], speed_range=[1, 2], randomness=np.float32(0.5),
        reach=np.int64(3),
    )  # fmt: skip
    assert human == HumanModel(
        goals=((1.0, 2.0), (3.0, 4.0)), goal_weight=(1.0, 2.0), speed_range=(1.0, 2.0), randomness=0.5, reach=3
    )
    assert hash(human) == hash(dataclasses.replace(human))
    assert type(human.randomness) is float
    assert type(human.reach) is int
    assert HabitSettings(scales=np.array([0.1, 0.2])).scales == (0.1, 0.2)


class Tensor:
    """What a learned policy answers with, and a column of a table: neither a sequence nor an array of numpy."""

    def __init__(self, values):
        self.values = values

    def __array__(self, dtype=None, copy=None):
        return np.array(self.values, dtype=dtype)


def test_numbers_may_come_in_what_holds_an_array():
    """A series of pandas was refused, its numbers shown in the message."""
    human = HumanModel(goals=[Tensor([1, 2]), Tensor([3, 4])], goal_weight=Tensor([1.0, 2.0]))
    assert human == HumanModel(goals=((1.0, 2.0), (3.0, 4.0)), goal_weight=(1.0, 2.0))
    assert Planner(robot=Holonomic(), goal=Tensor([4.0, 0.0])).goal.tolist() == [4.0, 0.0]
    for none in (Tensor([4.0, np.nan]), Tensor([4.0, None]), Tensor([[4.0, 0.0]]), Tensor(4.0), Tensor(["4", "0"])):
        with pytest.raises(InvalidInput, match=r"^planner\.goal: got "):
            Planner(robot=Holonomic(), goal=none)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("robot", None),
        ("robot", Holonomic),
        ("goal", "abc"),
        ("goal", None),
        ("goal", [1.0, None]),
        ("goal", [[1.0, 2.0]]),
        ("human", {}),
        ("obstacles", [SQUARE]),
        ("settings", {"horizon": 4}),
        ("goal_weight", (1.0, 2.0, 3.0)),
        ("goal_weight", 1e300),
        ("clearance", 101.0),
        ("soft_risk_weight", 1e10),
    ],
)
def test_what_a_planner_cannot_start_from_is_refused_in_one_line(name, value):
    with pytest.raises(InvalidInput, match=rf"^planner\.{name}: got ") as caught:
        Planner(**{"robot": Holonomic(), "goal": (4.0, 0.0), name: value})
    assert len(str(caught.value).splitlines()) == 1


def test_wheels_and_walls_say_which_dimensions_they_can_do():
    walls = Obstacles(polygons=[SQUARE])
    with pytest.raises(InvalidInput, match=r"2 finite numbers .* differential drive"):
        Planner(robot=DifferentialDrive(), goal=(4.0, 0.0, 1.0))
    with pytest.raises(InvalidInput, match=r"2 or 3 finite numbers .* map"):
        Planner(robot=Holonomic(), goal=(4.0,), obstacles=walls)
    assert Planner(robot=Holonomic(), goal=(4.0, 0.0, 1.0), obstacles=walls).goal.tolist() == [4.0, 0.0, 1.0]


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: OccupancyGrid(occupied="map.pgm", resolution=0.1), "occupied"),
        (lambda: OccupancyGrid(occupied=[[1, 0], [1]], resolution=0.1), "occupied"),
        (lambda: OccupancyGrid(occupied=[[1, 0]], resolution="fine"), "resolution"),
        (lambda: OccupancyGrid(occupied=[[1, 0]], resolution=0.1, origin=(1.0,)), "origin"),
        (lambda: OccupancyGrid(occupied=[[1, 0]], resolution=0.1, yaw=math.nan), "yaw"),
        (lambda: Obstacles(polygons="x"), "polygons"),
        (lambda: Obstacles(grid=3), "grid"),
    ],
)
def test_what_a_map_cannot_be_is_refused(make, field):
    with pytest.raises(InvalidInput, match=rf"^obstacles\.(grid\.)?{field}.*: got "):
        make()


def test_a_map_of_lists_is_kept_as_cells_that_nobody_can_change():
    grid = OccupancyGrid(occupied=[[1, 0], [0, 0]], resolution=1)
    assert grid.occupied.dtype == np.bool_
    assert not grid.occupied.flags.writeable
    assert Obstacles(grid=grid).free([1.5, 1.5])


@pytest.mark.parametrize("robot", [(0.0, 0.0), None, "here"])
def test_a_state_that_is_none_stops_the_robot_and_says_so(robot):
    plan = Planner(robot=Holonomic(), goal=(4.0, 0.0)).step(time=0.0, robot=robot, people=[])
    assert plan.status == "stopped"
    assert "not a RobotState" in plan.reason
    assert not plan.velocity.any()


@pytest.mark.parametrize("velocity", ["abc", None, [1.0], [1.0, None], [[1.0, 0.0]], [math.nan, 0.0]])
def test_a_wanted_velocity_that_is_none_counts_as_standing(velocity):
    planner = Planner(robot=Holonomic(), goal=(4.0, 0.0))
    told = SafetyFilter(planner).filter(velocity, time=0.0, robot=RobotState(position=[0.0, 0.0]), people=[])
    assert not told.velocity.any()
    assert not told.interfered
    assert told.reason.startswith("what was wanted is not 2 finite numbers and counts as standing, let through: every")


def test_a_wanted_velocity_may_be_an_array_of_any_kind():
    """It counted as standing, without a word."""
    screen = SafetyFilter(Planner(robot=Holonomic(), goal=(4.0, 0.0)))
    for velocity in (Tensor([0.5, 0.0]), np.array([0.5, 0.0], dtype=np.float32), [np.array(0.5), np.array(0.0)]):
        told = screen.filter(velocity, time=0.0, robot=RobotState(position=[0.0, 0.0]), people=[])
        assert told.velocity.tolist() == [0.5, 0.0]
        assert told.reason.startswith("let through")


def test_of_many_names_a_message_lists_some_and_suggests_the_nearest():
    names = [f"scene_{n:03d}" for n in range(300)]
    one_of("--without", names[:3], names)
    with pytest.raises(UnknownName, match=r"scene_000, .*… \(300 in all\); did you mean 'scene_29") as found:
        one_of("--without", ["scene_29x"], names)
    assert len(str(found.value)) < 400
    with pytest.raises(UnknownName, match=r"allowed: one of a, b$"):
        one_of("--without", ["zebra"], ["b", "a"])


def _complaint() -> InvalidInput:
    with pytest.raises(InvalidInput) as caught:
        Scenario.parse({"robot": {}})
    return caught.value


@pytest.mark.parametrize(
    "error",
    [
        SidestepError("so"),
        InvalidInput("planner.horizon", 0, "an integer ≥ 1", "raise it"),
        InvalidFile("tracks.csv", "no rows", "at least one row"),
        UnknownName("scenario", "crosing", ["crossing", "lane"]),
        MissingExtra("the page", "live"),
        OutputError("runs", "no space"),
        _complaint(),
    ],
    ids=lambda error: type(error).__name__,
)
@pytest.mark.parametrize("carried", [copy.copy, copy.deepcopy, lambda error: pickle.loads(pickle.dumps(error))])
def test_exceptions_come_out_of_other_processes_as_they_are(error, carried):
    again = carried(error)
    assert type(again) is type(error)
    assert str(again) == str(error)
    assert vars(again) == vars(error)


@pytest.mark.parametrize("value", [5, None, "planner"])
def test_a_filter_of_something_else_is_refused_when_it_is_made(value):
    with pytest.raises(InvalidInput, match=r"safety_filter.planner.*Planner"):
        SafetyFilter(value)


def test_a_name_is_no_scenario_and_it_says_what_reads_one():
    with pytest.raises(InvalidInput, match=r"simulate.scenario.*'crossing'.*load_scenario"):
        simulate("crossing")


@pytest.mark.parametrize(
    "value",
    ["x", (1.0, "a"), {1: 2.0}, [(1.0, 2.0), (3.0,)], (10**400, 0.0), object()],
    ids=["word", "mixed", "table", "ragged", "huge", "anything"],
)
@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda v: RobotState(position=v), "robot.position"),
        (lambda v: RobotState(position=(0.0, 0.0), velocity=v), "robot.velocity"),
        (lambda v: PersonObservation(id="a", position=v), "person 'a': position"),
        (lambda v: PersonObservation(id="a", position=(0.0, 0.0), velocity=v), "person 'a': velocity"),
        (
            lambda v: PersonObservation(id=7, position=(0.0, 0.0), position_covariance=v),
            "person 7: position_covariance",
        ),
        (lambda v: Announced(path=v, radius=0.3, settled=True), "announced.path"),
    ],
)
def test_what_is_measured_and_no_numbers_is_refused_in_one_line(make, field, value):
    with pytest.raises(InvalidInput, match=f"^{field}: got .*; allowed: ") as caught:
        make(value)
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize("goal", [np.zeros((3, 2)), "on\ntwo lines"])
def test_a_value_of_several_lines_is_told_in_one(goal):
    with pytest.raises(InvalidInput, match=r"^planner\.goal: got [^\n]*; allowed: [^\n]*$"):
        Planner(robot=Holonomic(), goal=goal)


def test_what_is_masked_was_not_measured():
    """What lay under the mask was taken for the place."""
    masked = np.ma.masked_array([0.0, -4.0], mask=[False, True])
    planner = Planner(robot=Holonomic(), goal=(0.0, 5.0), horizon=4)
    here = RobotState(position=(0.0, -5.0))
    hidden = PersonObservation(id="a", position=masked, velocity=masked, position_covariance=np.ma.masked_all((2, 2)))
    assert np.isnan(hidden.position[1])
    plan = planner.step(time=0.0, robot=here, people=[hidden])
    assert (plan.status, plan.reason) == ("stopped", "person 'a': position is [0.0, nan]")
    lost = planner.step(time=0.5, robot=RobotState(position=masked), people=[])
    assert (lost.status, lost.reason) == ("stopped", "robot position is [0.0, nan]")
    whole = np.ma.masked_array([0.0, -4.0], mask=False)
    assert PersonObservation(id="a", position=whole).position.tolist() == [0.0, -4.0]
    with pytest.raises(InvalidInput, match=r"planner\.goal"):
        planner.goal = masked
    with pytest.raises(InvalidInput, match=r"obstacles\.polygons\[0\]"):
        Obstacles(polygons=[np.ma.masked_array(SQUARE, mask=[[0, 0], [0, 1], [0, 0]])])
    with pytest.raises(InvalidInput, match=r"obstacles\.grid\.occupied"):
        OccupancyGrid(occupied=np.ma.masked_array([[True, False]], mask=[[False, True]]), resolution=0.1)
