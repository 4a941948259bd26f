"""A recorded run, planned over again; predictions scored against where people went."""

from __future__ import annotations

import json

import numpy as np
import pytest

pytest.importorskip("rosbags")

from sidestep.cli import execute
from sidestep.errors import InvalidFile, InvalidInput
from sidestep.io.recordings import RecordingWriter, read_messages
from sidestep.io.scenarios import load_scenario
from sidestep.ros import messages, outgoing
from sidestep.ros.geometry import Pose2
from sidestep.ros.recorded import START, record_messages
from sidestep.ros.tree import TransformTree
from sidestep.simulation.loop import simulate
from sidestep.studies.replay import choose_topics, replay
from sidestep.studies.replay_score import Forecast, Track, score


@pytest.fixture(scope="module")
def record():
    return simulate(load_scenario("crossing", ["duration=5.0", "planner.horizon=4", "stop_at_goal=false"]))


def recorded(record, path):
    with RecordingWriter(path) as writer:
        for message in record_messages(record, writer.make):
            writer.write(*message)
    return path


@pytest.fixture(scope="module")
def recording(record, tmp_path_factory):
    return recorded(record, tmp_path_factory.mktemp("recording") / "run.mcap")


@pytest.mark.parametrize("name", ["run.mcap", "run.bag"])
def test_a_run_comes_back_from_its_messages(record, name, tmp_path):
    found = list(read_messages(recorded(record, tmp_path / name)))
    robots = [messages.read_odometry(m.message) for m in found if m.topic == "/odom"]
    assert np.allclose([r.pose.position for r in robots], record.robot_positions)
    assert np.allclose([r.velocity for r in robots[:-1]], record.robot_velocities, atol=1e-9)
    people = [messages.read_markers(m.message) for m in found if m.topic == "/people_markers"]
    assert np.allclose([p.positions for p in people], record.people_positions)
    assert np.allclose([m.time - START for m in found if m.topic == "/odom"], record.time)
    plans = [m.message for m in found if m.topic == "/plan"]
    assert np.allclose([p.pose.position.x for p in plans[0].poses], record.plans[0, :, 0])
    grids = [np.asarray(m.message.data) for m in found if m.topic == "/predicted_occupancy"]
    assert len(grids) == len({s.step for s in record.snapshots})
    assert max(g.max() for g in grids) > 20


def test_planning_over_it_uses_its_own_parameters_and_goal(record, recording):
    found = replay(recording, {}, topics={})
    assert found.topics["people_markers"] == "/people_markers"
    assert found.goal == pytest.approx(record.robot_goal)
    assert len(found.plans) == len(record.time)
    assert len(found.plans[0].positions) == 5
    assert {f.person for f in found.forecasts} == {f"{record.people[0]}/0"}
    assert found.forecasts[0].actual[1] == pytest.approx(record.people_positions[1, 0], abs=0.05)


def test_parameters_and_goals_can_be_changed(recording):
    found = replay(recording, {"planner": {"horizon": 2}, "node": {"planner_rate": 1.0}}, goal=(3.0, 0.0), topics={})
    assert found.goal.tolist() == [3.0, 0.0]
    assert len(found.plans) <= 6
    assert len(found.plans[0].positions) == 3
    poses = replay(recording, {"node": {"people_from": "poses"}}, topics={})
    assert poses.topics["people"] == "/people"


def test_topics_are_chosen_by_name_or_named(recording, tmp_path):
    assert choose_topics(recording, {"odom": "/odom"})["odom"] == "/odom"
    with pytest.raises(InvalidFile, match="/nowhere"):
        choose_topics(recording, {"odom": "/nowhere"})
    with pytest.raises(InvalidInput, match="topic: got 'laser'; allowed: one of"):
        choose_topics(recording, {"laser": "/scan"})
    with pytest.raises(InvalidFile, match="scan"):
        replay(recording, {"node": {"people_from": "scan"}}, topics={})
    with pytest.raises(InvalidInput, match=r"planner\.horizon"):
        replay(recording, {"planner": {"horizon": 0}}, topics={})
    blind = tmp_path / "blind.mcap"
    with RecordingWriter(blind) as writer:
        robot = outgoing.odometry(writer.make, "odom", "base", 1.0, Pose2(), np.zeros(2), 0.0)
        writer.write("/odom", "nav_msgs/Odometry", 1.0, robot)
    with pytest.raises(InvalidFile, match="people_markers, people or scan"):
        choose_topics(blind, {})


def test_it_is_said_why_nothing_could_be_planned(recording, tmp_path, capsys):
    """It was "waiting", whatever the reason: a frame that nobody knows, a goal that is no place, one in a wall."""
    elsewhere = tmp_path / "elsewhere.bag"
    with RecordingWriter(elsewhere) as writer:
        for time in (1.0, 1.5):
            robot = outgoing.odometry(writer.make, "odom", "base", time, Pose2(), np.zeros(2), 0.0)
            writer.write("/odom", "nav_msgs/Odometry", time, robot)
            people = outgoing.pose_array(writer.make, "map", time, np.ones((1, 2)))
            writer.write("/people", "geometry_msgs/PoseArray", time, people)
    with pytest.raises(InvalidFile, match=r"waiting: no people yet; 2 came .* unknown frame"):
        replay(elsewhere, {}, topics={})
    around = [[-9.0, 1.0], [9.0, 1.0], [9.0, 2.0], [-9.0, 2.0]]
    with pytest.raises(InvalidFile, match=r"planner\.goal: got \[0\.0, 1\.5\]; allowed: .* away from walls"):
        replay(recording, {"walls": [around]}, goal=(0.0, 1.5), topics={})
    assert "Traceback" not in capsys.readouterr().err
    with pytest.raises(InvalidInput, match=r"goal: got \(nan, 0\.0\); allowed: 2 finite numbers"):
        replay(recording, {}, goal=(float("nan"), 0.0), topics={})
    with pytest.raises(InvalidInput, match="node: got 3; allowed: a table"):
        replay(recording, {"node": 3}, topics={})


def test_the_goal_of_the_parameters_counts_where_none_was_recorded(tmp_path):
    bag = tmp_path / "standing.bag"
    with RecordingWriter(bag) as writer:
        robot = outgoing.odometry(writer.make, "odom", "base", 1.0, Pose2(), np.zeros(2), 0.0)
        writer.write("/odom", "nav_msgs/Odometry", 1.0, robot)
        people = outgoing.pose_array(writer.make, "odom", 1.0, np.full((1, 2), 3.0))
        writer.write("/people", "geometry_msgs/PoseArray", 1.0, people)
    assert replay(bag, {"robot": {"goal": [0.0, 3.0]}}, topics={}).goal.tolist() == [0.0, 3.0]
    assert replay(bag, {}, topics={}).goal.tolist() == [0.0, 0.0]


def test_a_track_is_only_known_while_it_was_seen():
    track = Track(np.array([[0.0, 0.0, 0.0], [0.5, 1.0, 0.0], [3.0, 2.0, 0.0]]))
    found = track.at(np.array([-0.1, 0.25, 1.0, 3.0, 3.1]))
    assert np.isnan(found[[0, 2, 4]]).all()
    assert found[1].tolist() == [0.5, 0.0]


def test_scores_are_means_over_what_could_be_compared():
    def forecast(offset, actual):
        straight = np.zeros((3, 2))
        return Forecast(
            person="a",
            time=0.0,
            predicted=straight + np.array([offset, 0.0]),
            straight=straight,
            actual=np.array(actual),
            nearby=np.where(np.isfinite(np.array(actual)[1:, 0]), 0.5, np.nan),
        )

    nan = float("nan")
    found = score([forecast(1.0, [[0, 0], [0, 0], [0, 0]]), forecast(3.0, [[0, 0], [0, 0], [nan, nan]])], 0.5)
    assert found.lead.tolist() == [0.5, 1.0]
    assert found.count.tolist() == [2.0, 1.0]
    assert found.error.tolist() == [2.0, 1.0]
    assert found.straight.tolist() == [0.0, 0.0]
    assert found.nearby.tolist() == [0.5, 0.5]


def test_transforms_are_joined_through_their_common_frame():
    from ros_stand_ins import NamespaceMaker

    tree, make = TransformTree(), NamespaceMaker()
    tree.take(outgoing.transform(make, "map", "odom", 0.0, Pose2(1.0, 0.0, np.pi / 2)))
    tree.take(outgoing.transform(make, "odom", "base", 0.0, Pose2(2.0, 0.0, 0.0)))
    tree.take(outgoing.transform(make, "base", "laser", 0.0, Pose2(0.0, 0.5, 0.0)))
    there = tree.lookup("map", "laser")
    assert there is not None
    assert (there.x, there.y) == pytest.approx((0.5, 2.0))
    back = tree.lookup("laser", "odom")
    assert back is not None
    assert (back.x, back.y) == pytest.approx((-2.0, -0.5))
    assert tree.lookup("map", "kitchen") is None
    tree.take(outgoing.transform(make, "laser", "map", 0.0, Pose2()))  # a circle must not turn for ever
    assert tree.lookup("map", "kitchen") is None


def test_the_command_tells_it_as_json_and_complains_in_one_line(recording, tmp_path, capsys):
    assert (
        execute(["replay", str(recording), "--json", "--out", str(tmp_path / "out"), "--set", "planner.horizon=3"]) == 0
    )
    told = json.loads(capsys.readouterr().out)
    assert told["plans"] == sum(told["status"].values())
    assert len(told["lead_s"]) == 3
    assert (tmp_path / "out" / "figure.png").stat().st_size > 10_000
    assert execute(["replay", str(tmp_path / "none.bag")]) == 2
    assert execute(["replay", str(recording), "--set", "planner"]) == 2
    assert execute(["run", "--record", str(tmp_path / "run.txt")]) == 2
    errors = capsys.readouterr().err.splitlines()
    assert len(errors) == 3
    assert "no such file" in errors[0]
    assert ".mcap" in errors[2]
