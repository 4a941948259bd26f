"""What may be sent to the wheels: only while everything it rests on is fresh, and always with a word why not."""

from __future__ import annotations

import logging
import math
from dataclasses import replace

import numpy as np
import pytest

from ros_stand_ins import Eyes, StraightPlanner, Wheels, plan_of
from sidestep import DifferentialDrive, PersonObservation, RobotState
from sidestep.errors import InvalidInput
from sidestep.human.model import HumanModel
from sidestep.io.human_models import write_human_model
from sidestep.io.scenarios import load_scenario, write_scenario
from sidestep.perception.scan import Beams
from sidestep.ros.assembly import PlannerSource, brain
from sidestep.ros.core import Core
from sidestep.ros.frames import Frames, no_lookup
from sidestep.ros.geometry import Pose2
from sidestep.ros.inputs import Inputs
from sidestep.ros.messages import LaserScan, Map, Odometry, People, Target
from sidestep.ros.settings import NodeSettings
from sidestep.ros.status import STANDSTILL, Motion


class Robot:
    """A core with stand-ins around it."""

    def __init__(self, *, frame: str = "odom", lookup=lambda parent, child: None, **robot) -> None:
        self.settings = NodeSettings.parse(
            {
                "robot": {"kind": "holonomic", **robot},
                "node": {"people_from": "poses", "timeout": 0.5, "planner_rate": 5.0, "frame": frame},
            }
        )
        self.frames = Frames(planning=frame, base="base_link", mount=Pose2(), lookup=lookup)
        self.eyes = Eyes()
        self.inputs = Inputs(self.settings, sensing=self.eyes, frames=self.frames)
        self.made: list[tuple[np.ndarray, Map | None]] = []
        self.planner = StraightPlanner()
        self.core = Core(self.settings, inputs=self.inputs, wheels=Wheels(), make_planner=self._make)

    def _make(self, goal, grid):
        self.made.append((goal, grid))
        return self.planner

    def odometry(self, now: float, place: Pose2 | None = None, frame: str = "odom") -> None:
        self.inputs.take_odometry(
            Odometry(time=0.0, frame=frame, pose=place or Pose2(), velocity=np.zeros(2), turn_rate=0.0), now
        )

    def people(self, now: float) -> None:
        self.inputs.take_people(People(time=0.0, frame="", ids=None, positions=np.zeros((0, 2))), now)

    def goal(self, x: float = 5.0, y: float = 0.0, frame: str = "") -> None:
        self.inputs.take_goal(Target(frame=frame, position=np.array([x, y])))

    def ready(self, now: float = 10.0, place: Pose2 | None = None) -> Motion:
        """Everything has come, a plan is made; return the motion."""
        self.odometry(now, place)
        self.people(now)
        self.goal()
        assert self.core.plan(now) is not None
        return self.core.motion(now, now)

    def reason(self, now: float) -> str:
        return self.core.report(now).summary


def test_it_waits_and_says_for_what():
    robot = Robot()
    assert robot.core.plan(0.0) is None
    assert robot.core.motion(0.0, 0.0) == STANDSTILL
    assert robot.reason(0.0) == "waiting: no odom yet"
    robot.odometry(0.0)
    robot.core.motion(0.1, 0.1)
    assert robot.reason(0.1) == "waiting: no people yet"
    robot.people(0.1)
    robot.core.motion(0.2, 0.2)
    assert robot.reason(0.2) == "waiting: no goal"
    robot.goal()
    robot.core.motion(0.3, 0.3)
    assert robot.reason(0.3) == "waiting: no plan yet"


def test_it_drives_when_everything_is_there():
    robot = Robot()
    assert robot.ready() == Motion(forward=0.4)
    assert robot.reason(10.0) == "driving"


@pytest.mark.parametrize("missing", ["odom", "people"])
def test_a_missing_input_stops_it_and_its_return_lets_it_go_on(missing):
    robot = Robot()
    robot.ready(10.0)
    for k in range(1, 8):
        now = 10.0 + 0.1 * k
        if missing != "odom":
            robot.odometry(now)
        if missing != "people":
            robot.people(now)
        robot.core.plan(now)
        motion = robot.core.motion(now, now)
        assert (motion == STANDSTILL) == (k > 5), f"after {k / 10} s"
    assert robot.reason(10.7).startswith(f"stopped: no {missing} for 0.")
    robot.odometry(10.8)
    robot.people(10.8)
    robot.core.plan(10.8)
    assert robot.core.motion(10.8, 10.8) != STANDSTILL


def test_who_has_been_told_of_is_told_of_once():
    """Told again, they would be taken to have been measured where they were only expected."""
    robot = Robot()
    robot.ready(10.0)
    for k, news in enumerate([False, True, False]):
        if news:
            robot.people(10.1 + 0.1 * k)
        robot.core.plan(10.1 + 0.1 * k)
    assert [people is not None for _, _, people in robot.planner.calls] == [True, False, True, False]


def test_a_planner_that_hangs_does_not_leave_the_last_command_on():
    robot = Robot()
    robot.ready(10.0)
    for k in range(1, 6):
        robot.odometry(10.0 + 0.1 * k)
        robot.people(10.0 + 0.1 * k)
    assert robot.core.motion(10.39, 10.39) != STANDSTILL  # two planning periods
    assert robot.core.motion(10.5, 10.5) == STANDSTILL
    assert "plan is 0.5 s old" in robot.reason(10.5)


def test_a_planner_that_fails_stops_the_robot_not_the_node(caplog):
    robot = Robot()
    robot.ready(10.0)

    def fail(**_):
        raise ZeroDivisionError("by the test")

    robot.planner.step = fail
    with caplog.at_level(logging.ERROR):
        assert robot.core.plan(10.1) is None
    assert robot.core.motion(10.1, 10.1) == STANDSTILL
    assert robot.reason(10.1) == "stopped: planning failed: by the test"
    del robot.planner.step
    robot.core.plan(10.2)
    assert robot.core.motion(10.2, 10.2) != STANDSTILL


def test_a_new_goal_voids_the_old_plan_at_once():
    robot = Robot()
    robot.ready(10.0)
    robot.goal(0.0, 5.0)
    assert robot.inputs.renewed.is_set()
    assert robot.core.motion(10.05, 10.05) == STANDSTILL
    robot.core.plan(10.1)
    assert robot.core.motion(10.1, 10.1) != STANDSTILL
    assert [tuple(goal) for goal, _ in robot.made] == [(5.0, 0.0), (0.0, 5.0)]


def test_a_plan_made_while_the_goal_changed_is_not_followed():
    robot = Robot()
    robot.ready(10.0)
    step = robot.planner.step

    def interrupted(**given):
        robot.goal(0.0, 5.0)
        return step(**given)

    robot.planner.step = interrupted
    robot.core.plan(10.1)
    assert robot.core.motion(10.1, 10.1) == STANDSTILL


def test_it_arrives_and_stays():
    robot = Robot(goal_tolerance=0.2)
    robot.ready(10.0)
    robot.odometry(10.1, Pose2(4.9, 0.0, 0.0))
    assert robot.core.motion(10.1, 10.1) == STANDSTILL
    assert robot.reason(10.1) == "arrived"
    robot.odometry(10.2, Pose2(4.5, 0.0, 0.0))  # pushed away: it does not set off again by itself
    robot.people(10.2)
    assert robot.core.plan(10.2) is None
    assert robot.core.motion(10.2, 10.2) == STANDSTILL


def test_holds_are_kept_until_every_one_lets_go():
    robot = Robot()
    robot.ready(10.0)
    robot.core.hold("remote", "stopped by the operator")
    robot.core.hold("enable", "switched off")
    assert robot.core.motion(10.1, 10.1) == STANDSTILL
    assert robot.reason(10.1) == "stopped: stopped by the operator"
    robot.core.hold("remote", "")
    assert robot.core.motion(10.1, 10.1) == STANDSTILL
    robot.core.hold("enable", "")
    assert robot.core.motion(10.1, 10.1) != STANDSTILL


def test_a_velocity_in_the_world_is_sent_in_the_frame_of_the_robot():
    motion = Robot().ready(10.0, Pose2(0.0, 0.0, math.pi / 2))
    assert motion.forward == pytest.approx(0.0)
    assert motion.sideways == pytest.approx(-0.4)


def test_a_differential_base_gets_its_own_command():
    robot = Robot(kind="differential")
    assert robot.ready(10.0) == Motion(forward=0.4, turn_rate=0.0)


def test_a_command_that_is_no_number_becomes_a_standstill():
    robot = Robot()
    robot.planner.velocity = (math.nan, 0.0)
    assert robot.ready() == STANDSTILL


@pytest.mark.parametrize(("rule", "name", "told"), [("mass", "largest", "0.0300"), ("trajectory", "summed", "0.0500")])
def test_the_risk_that_is_told_is_the_one_that_is_limited(rule, name, told):
    robot = Robot()
    robot.ready()
    plan = replace(plan_of(10.1, (0.4, 0.0)), risk=np.array([0.02, 0.03]), risk_rule=rule)
    robot.planner.step = lambda **_: plan
    robot.core.plan(10.1)
    values = robot.core.report(10.1).values()
    assert {what: value for what, value in values.items() if what.endswith(" risk")} == {f"{name} risk": told}


def test_a_plan_to_stop_is_told_as_a_stop():
    robot = Robot()
    robot.planner.status, robot.planner.velocity = "stopped", (0.0, 0.0)
    assert robot.ready() == STANDSTILL
    assert robot.reason(10.0) == "stopped: stopped for the test"


def test_a_clock_that_jumps_back_forgets_what_was_measured_and_keeps_the_goal():
    robot = Robot()
    robot.ready(100.0)
    assert robot.core.motion(3.0, 100.1) == STANDSTILL
    assert robot.eyes.cleared == 1
    assert "no odom yet" in robot.reason(3.0)
    robot.odometry(3.1)
    robot.people(3.1)
    robot.core.plan(3.1)
    assert robot.core.motion(3.1, 100.2) != STANDSTILL


def test_a_goal_that_is_refused_is_refused_once_until_the_goal_or_the_map_is_another(caplog):
    robot = Robot()
    asked = []

    def refusing(goal, grid):
        asked.append(tuple(goal))
        if goal[0] > 4.0:
            raise InvalidInput("planner.goal", goal, "a place away from walls")
        return robot.planner

    robot.core._make_planner = refusing
    robot.odometry(10.0)
    robot.people(10.0)
    robot.goal(5.0)
    for k in range(5):
        assert robot.core.plan(10.0 + 0.01 * k) is None
        assert robot.core.motion(10.0 + 0.01 * k, 10.0) == STANDSTILL
        assert "away from walls" in robot.reason(10.0)
    assert asked == [(5.0, 0.0)]
    assert [(r.levelname, r.exc_info) for r in caplog.records] == [("ERROR", False)]  # a line, and no traceback
    robot.goal(3.0)
    assert robot.core.plan(10.1) is not None
    assert asked == [(5.0, 0.0), (3.0, 0.0)]


def test_a_frozen_clock_stops_it():
    robot = Robot()
    robot.ready(10.0)
    assert robot.core.motion(10.0, 10.4) != STANDSTILL
    assert robot.core.motion(10.0, 10.6) == STANDSTILL
    assert "clock" in robot.reason(10.0)


def test_one_stamp_far_ahead_stops_it_and_what_comes_after_it_is_looked_at():
    _, inputs = brain(NodeSettings.parse({"node": {"people_from": "poses", "timeout": 0.5}}), no_lookup)

    def look(now: float, stamp: float, place: float) -> None:
        inputs.take_odometry(Odometry(time=0.0, frame="odom", pose=Pose2(), velocity=np.zeros(2), turn_rate=0.0), now)
        inputs.take_people(People(time=stamp, frame="", ids=None, positions=np.array([[place, 0.0]])), now)

    look(10.0, 60.0, 3.0)
    assert "ahead of now" in inputs.complaint(10.0, 10.0)
    for k in range(1, 21):
        look(10.0 + 0.1 * k, 10.0 + 0.1 * k, 3.0 - 0.1 * k)
    assert not inputs.complaint(12.0, 12.0)
    (person,) = inputs.seen(12.0)
    assert person.position == pytest.approx([1.0, 0.0], abs=0.2)


def test_a_scan_stamped_far_ahead_is_not_looked_at():
    robot = Robot()
    robot.odometry(10.0)
    beams = Beams(count=4, angle_min=0.0, angle_increment=0.1, range_min=0.1, range_max=10.0)
    for stamp in (60.0, 10.1, 0.0):
        robot.inputs.take_scan(LaserScan(time=stamp, frame="", beams=beams, ranges=np.ones(4)), 10.0)
    assert [time for _, _, time in robot.eyes.shown] == [10.1, 10.0]


def test_a_goal_in_another_frame_waits_for_that_frame():
    known: dict[tuple[str, str], Pose2] = {}
    robot = Robot(lookup=lambda parent, child: known.get((parent, child)))
    robot.odometry(10.0)
    robot.people(10.0)
    robot.goal(1.0, 0.0, frame="map")
    assert robot.core.motion(10.0, 10.0) == STANDSTILL
    assert "'map', unknown" in robot.reason(10.0)
    known["odom", "map"] = Pose2(2.0, 0.0, math.pi / 2)
    assert robot.core.plan(10.1) is not None
    assert np.allclose(robot.made[0][0], [2.0, 1.0])


def test_a_map_reaches_the_planner_in_the_planning_frame():
    robot = Robot(
        frame="map", lookup=lambda parent, child: {("map", "odom"): Pose2(1.0, 0.0, 0.0)}.get((parent, child))
    )
    robot.ready(10.0)
    occupied = np.array([[True, False]])
    robot.inputs.take_map(Map(frame="odom", origin=Pose2(0.5, 0.0, 0.0), resolution=0.1, occupied=occupied))
    robot.core.plan(10.1)
    grid = robot.made[-1][1]
    assert grid is not None
    assert grid.origin.x == 1.5
    assert grid.frame == "map"
    assert robot.eyes.maps == [grid]


def drawn(*walls: tuple[int, int], x: float = -1.0) -> Map:
    """A map of 8 m by 8 m, occupied at these cells of 0.1 m."""
    occupied = np.zeros((80, 80), dtype=np.bool_)
    for row, column in walls:
        occupied[row, column] = True
    return Map(frame="odom", origin=Pose2(x, -4.0, 0.0), resolution=0.1, occupied=occupied)


def test_a_map_that_says_the_same_again_changes_nothing_and_another_one_does_not_stop_the_robot():
    robot = Robot()
    robot.inputs.take_map(drawn((0, 0)))
    robot.ready(10.0)
    task = robot.inputs.task
    robot.inputs.take_map(drawn((0, 0)))
    assert robot.inputs.task is task
    assert len(robot.eyes.maps) == 1
    for other in (drawn((0, 1)), drawn((0, 1), x=-1.1), replace(drawn((0, 1), x=-1.1), walls=drawn((0, 1)).occupied)):
        robot.inputs.take_map(other)
        assert robot.inputs.task.map is not task.map
        assert robot.core.motion(10.1, 10.1) == Motion(forward=0.4)  # by the plan that there is, while it is fresh
        task = robot.inputs.task
    robot.core.plan(10.2)
    assert robot.made[-1][1] is task.map
    assert len(robot.eyes.maps) == 4
    robot.inputs.take_map(drawn((0, 2)))
    robot.odometry(10.9)
    robot.people(10.9)
    assert robot.core.motion(10.9, 10.9) == STANDSTILL
    assert robot.reason(10.9) == "stopped: the plan is 0.7 s old"


def test_a_planner_forgets_nobody_when_the_map_changes():
    settings = NodeSettings.parse({"robot": {"kind": "holonomic"}, "node": {"people_from": "poses"}})
    source, goal = PlannerSource(settings), np.array([5.0, 0.0])
    planner = source(goal, None)
    for k in range(20):
        person = PersonObservation(id="7", position=(2.0 - 0.1 * k, 1.0))
        before = planner.step(time=0.1 * k, robot=RobotState(position=(0.0, 0.0)), people=[person])
    walled = source(goal, drawn((75, 75)))
    assert walled is planner
    assert walled.obstacles is not None
    person = PersonObservation(id="7", position=(0.0, 1.0))
    after = walled.step(time=2.0, robot=RobotState(position=(0.0, 0.0)), people=[person])
    assert after.people["7"].belief == pytest.approx(before.people["7"].belief, abs=0.1)
    assert np.allclose(after.people["7"].velocity, before.people["7"].velocity, atol=0.01)
    with pytest.raises(InvalidInput, match="away from walls"):
        source(goal, drawn((40, 60)))
    assert walled.obstacles.free(goal[None], 0.1)[0]  # as it was
    moved = source(np.array([3.0, 1.0]), drawn((40, 60)))  # both at once: neither fits the other one's predecessor
    assert moved is planner
    assert np.allclose(moved.goal, [3.0, 1.0])
    assert not moved.obstacles.free(goal[None], 0.1)[0]
    assert source(moved.goal, None).obstacles is None


def test_messages_that_cannot_be_used_are_counted_and_do_not_feed_the_watchdog():
    robot = Robot()
    robot.ready(10.0)
    for k in range(8):
        robot.inputs.take_odometry(None, 10.0 + 0.1 * k)
        robot.people(10.0 + 0.1 * k)
    robot.core.plan(10.7)
    assert robot.core.motion(10.7, 10.7) == STANDSTILL
    report = robot.core.report(10.7)
    assert report.refused == {"odom": 8}
    assert report.values()["odom refused"] == 8


def test_the_robot_is_carried_forward_to_the_time_of_the_plan():
    robot = Robot()
    robot.people(10.0)
    robot.goal()
    moving = Odometry(time=9.8, frame="odom", pose=Pose2(), velocity=np.array([0.5, 0.0]), turn_rate=1.0)
    robot.inputs.take_odometry(moving, 10.0)
    robot.core.plan(10.0)
    _, state, _ = robot.planner.calls[0]
    assert np.allclose(state.position, [0.1, 0.0])
    assert state.heading == pytest.approx(0.2)


@pytest.mark.parametrize("delay", [0.0, 0.2])
def test_the_planner_is_told_how_a_base_with_two_wheels_drives_and_turns(delay):
    robot = {"kind": "differential", "max_speed": 1.0, "max_turn_rate": 4.0, "reference_offset": 0.3}
    _, inputs = brain(NodeSettings.parse({"robot": robot, "node": {"people_from": "poses"}}), no_lookup)
    ahead = np.array([0.0, 0.5])  # it looks along y
    inputs.take_odometry(
        Odometry(time=10.0, frame="odom", pose=Pose2(yaw=math.pi / 2), velocity=ahead, turn_rate=2.0), 10.0
    )
    state = inputs.robot(10.0 + delay)
    base = DifferentialDrive(**{name: value for name, value in robot.items() if name != "kind"})
    assert base.command(state.velocity, state) == pytest.approx([0.5, 2.0])


def test_what_stations_are_told_is_plain_json():
    import json

    robot = Robot()
    assert json.loads(json.dumps(robot.core.report(0.0).as_json(), allow_nan=False))["robot"] is None
    robot.ready(10.0)
    told = json.loads(json.dumps(robot.core.report(10.0).as_json(), allow_nan=False))
    assert told["motion"] == [0.4, 0.0, 0.0]
    assert told["goal"] == [5.0, 0.0]
    assert told["status"] == "certified"


@pytest.mark.parametrize(
    ("data", "field"),
    [
        ({"node": {"timeout": 0.0}}, "node.timeout"),
        ({"node": {"people_form": "scan"}}, "node.people_form"),
        ({"planner": {"risk_limit": 2.0}}, "planner.risk_limit"),
        ({"robot": {"radius": "big"}}, "robot.radius"),
        ({"robot": {"goal": [1.0, 2.0, 3.0]}}, "robot.goal"),
        ({"node": {"remote": {"enabled": True, "host": "0.0.0.0"}}}, "node.remote.token"),
        ({"scenario": "/nowhere.toml"}, r"/nowhere.toml: got 'no such file'; allowed: a scenario file"),
        ({"human": "/nowhere.toml"}, r"/nowhere.toml: got 'no such file'; allowed: .* table \[human\]"),
    ],
)
def test_wrong_parameters_are_named(data, field):
    with pytest.raises(InvalidInput, match=field):
        NodeSettings.parse(data)


def test_parameters_change_a_scenario_file(tmp_path):
    file = tmp_path / "s.toml"
    file.write_text(
        "[robot]\nstart=[0.0,0.0]\ngoal=[1.0,1.0]\nradius=0.25\nmax_speed=0.9\n[planner]\nhorizon=6\n"
        "[[people]]\nstart=[3.0,3.0]\n"
    )
    settings = NodeSettings.parse({"scenario": str(file), "robot": {"max_speed": 0.4}})
    assert (settings.robot.radius, settings.robot.max_speed, settings.planner.horizon) == (0.25, 0.4, 6)
    assert settings.robot.first_goal is None  # where the simulated robot went is not where this one shall go


def test_a_scenario_file_means_the_same_to_a_node_as_to_a_run(tmp_path):
    """What `sidestep run` wrote was refused, and neither file nor parameter could switch anything off."""
    model = HumanModel(radius=0.26)
    write_human_model(model, tmp_path / "fitted.toml")
    file = tmp_path / "mine.toml"
    file.write_text(
        'human = "fitted.toml"\n[robot]\nstart=[0.0,0.0]\ngoal=[1.0,1.0]\nmax_acceleration="none"\n'
        '[planner]\nrecourse="none"\n'
    )
    chosen = NodeSettings.parse({"scenario": str(file), "planner": {"detour_after": "none"}})
    assert (chosen.planner.recourse, chosen.planner.detour_after, chosen.robot.max_acceleration) == (None, None, None)
    assert chosen.human == model
    assert NodeSettings.parse({"human": str(tmp_path / "fitted.toml")}).human == model
    scenario = load_scenario(file)
    write_scenario(scenario, tmp_path / "written.toml")
    again = NodeSettings.parse({"scenario": str(tmp_path / "written.toml")})
    assert (again.planner, again.human) == (scenario.planner, scenario.human)
