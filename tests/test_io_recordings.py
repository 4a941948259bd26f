"""Recordings: what was written is read, by us and by others; nothing half-written appears."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("rosbags")

from sidestep.errors import InvalidFile, InvalidInput, OutputError
from sidestep.io.recordings import RecordingWriter, read_messages
from sidestep.ros import messages, outgoing
from sidestep.ros.geometry import Pose2

ENDINGS = ["run.mcap", "run.bag"]


def write_some(path, count: int = 3):
    with RecordingWriter(path) as recording:
        make = recording.make
        for k in range(count):
            time = 100.0 + 0.1 * k
            robot = outgoing.odometry(make, "odom", "base_link", time, Pose2(k, 2.0, 0.5), np.array([1.0, 0.5]), 0.2)
            recording.write("/odom", "nav_msgs/Odometry", time, robot)
            people = outgoing.pose_array(make, "odom", time, np.array([[k, 1.0], [3.0, 4.0]]))
            recording.write("/people", "geometry_msgs/PoseArray", time, people)
            place = outgoing.transform(make, "odom", "base_link", time, Pose2(k, 2.0, 0.5))
            recording.write("/tf", "tf2_msgs/TFMessage", time, place)
            probability = np.array([[0.0, 0.5], [1.0, 0.25]])
            grid = outgoing.grid(make, "odom", time, np.zeros(2), 0.1, probability)
            recording.write("/predicted_occupancy", "nav_msgs/OccupancyGrid", time, grid)
            words = outgoing.diagnostics(make, time, level=2, message="stopped", values={"why": "test"})
            recording.write("/diagnostics", "diagnostic_msgs/DiagnosticArray", time, words)
            marks = outgoing.marker_array(make, [make("visualization_msgs/Marker", ns="people", id=4, type=3)])
            recording.write("/beliefs", "visualization_msgs/MarkerArray", time, marks)


@pytest.mark.parametrize("name", ENDINGS)
def test_what_was_written_is_read(tmp_path, name):
    path = tmp_path / name
    write_some(path)
    assert [p.name for p in tmp_path.iterdir()] == [name]
    found = list(read_messages(path))
    assert len(found) == 18
    robots = [messages.read_odometry(r.message) for r in found if r.type == "nav_msgs/Odometry"]
    assert [round(r.pose.x) for r in robots if r] == [0, 1, 2]
    assert robots[1] is not None
    assert np.allclose(robots[1].velocity, [1.0, 0.5])
    assert robots[1].time == pytest.approx(100.1)
    people = [messages.read_pose_array(r.message) for r in found if r.topic == "/people"]
    assert people[2].positions.tolist() == [[2, 1], [3, 4]]
    grid = next(r.message for r in found if r.topic == "/predicted_occupancy")
    assert np.asarray(grid.data).tolist() == [0, 50, 100, 25]
    marker = next(r.message for r in found if r.topic == "/beliefs").markers[0]
    assert (marker.ns, marker.id) == ("people", 4)


@pytest.mark.parametrize("name", ENDINGS)
def test_types_select(tmp_path, name):
    path = tmp_path / name
    write_some(path)
    assert {r.topic for r in read_messages(path, types=("nav_msgs/Odometry",))} == {"/odom"}
    assert list(read_messages(path, types=("sensor_msgs/LaserScan",))) == []


@pytest.mark.parametrize("name", ENDINGS)
def test_nothing_appears_when_the_run_fails_and_the_old_file_stays(tmp_path, name):
    path = tmp_path / name
    path.write_text("old")
    with pytest.raises(RuntimeError, match="halfway"), RecordingWriter(path):
        raise RuntimeError("halfway")
    assert path.read_text() == "old"
    assert len(list(tmp_path.iterdir())) == 1


def test_endings_and_places_are_checked_first(tmp_path):
    with pytest.raises(InvalidInput, match=r"\.mcap"):
        RecordingWriter(tmp_path / "run.txt")
    with pytest.raises(OutputError):
        RecordingWriter(tmp_path / "nowhere" / "run.bag")


@pytest.mark.parametrize("name", [*ENDINGS, "run.db3"])
def test_what_is_no_recording_is_named(tmp_path, name):
    path = tmp_path / name
    with pytest.raises(InvalidFile, match="no such file"):
        list(read_messages(path))
    path.write_bytes(b"no recording at all")
    with pytest.raises(InvalidFile, match=name):
        list(read_messages(path))
    path.write_bytes(b"")
    with pytest.raises(InvalidFile, match=name):
        list(read_messages(path))
