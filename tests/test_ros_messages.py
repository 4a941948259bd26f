"""Messages ↔ values: both dialects of stamps, frames, angles, and everything a driver may get wrong."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ros_stand_ins import NamespaceMaker, namespace_pose, plan_of, stamp1
from sidestep.ros import messages, outgoing
from sidestep.ros.geometry import Pose2, quaternion_of, wrapped, yaw_of
from sidestep.ros.publisher import belief_markers

MAKE = NamespaceMaker()
angles = st.floats(-20, 20)
places = st.floats(-50, 50)


def header(frame: str = "odom", time: float = 12.25):
    return SimpleNamespace(frame_id=frame, stamp=MAKE.stamp(time))


@given(angles)
def test_a_yaw_survives_its_quaternion(yaw):
    x, y, z, w = quaternion_of(yaw)
    assert math.isclose(wrapped(yaw_of(SimpleNamespace(x=x, y=y, z=z, w=w)) - yaw), 0.0, abs_tol=1e-9)


def test_a_quaternion_of_zeros_is_no_rotation_and_length_does_not_matter():
    assert yaw_of(SimpleNamespace(x=0.0, y=0.0, z=0.0, w=0.0)) == 0.0
    assert yaw_of(SimpleNamespace(x=0.0, y=0.0, z=3.0, w=3.0)) == pytest.approx(math.pi / 2)


def test_roll_and_pitch_do_not_leak_into_the_yaw():
    half = math.pi / 6
    roll_only = SimpleNamespace(x=math.sin(half), y=0.0, z=0.0, w=math.cos(half))
    assert yaw_of(roll_only) == pytest.approx(0.0)


@given(places, places, angles, places, places, angles)
def test_poses_compose_and_invert(x, y, yaw, u, v, turn):
    a, b = Pose2(x, y, yaw), Pose2(u, v, turn)
    point = np.array([0.7, -1.3])
    assert np.allclose(a.after(b).apply(point), a.apply(b.apply(point)))
    back = a.inverse().after(a)
    assert np.allclose([back.x, back.y, wrapped(back.yaw)], 0.0, atol=1e-9)


@pytest.mark.parametrize("stamp", [stamp1(3.5), MAKE.stamp(3.5)])
def test_both_dialects_of_stamps(stamp):
    assert messages.seconds_of(stamp) == pytest.approx(3.5)


@given(places, places, angles, st.floats(-2, 2), st.floats(-2, 2), st.floats(-3, 3))
def test_odometry_comes_back_as_it_was_written(x, y, yaw, vx, vy, turn_rate):
    velocity = np.array([vx, vy])
    message = outgoing.odometry(MAKE, "odom", "base_link", 12.25, Pose2(x, y, yaw), velocity, turn_rate)
    odometry = messages.read_odometry(message)
    assert odometry is not None
    assert (odometry.time, odometry.frame) == (12.25, "odom")
    assert np.allclose(odometry.velocity, velocity, atol=1e-9)  # the message holds it in the robot's own frame
    assert np.allclose([odometry.pose.x, odometry.pose.y, wrapped(odometry.pose.yaw - yaw)], [x, y, 0.0], atol=1e-9)
    assert odometry.turn_rate == turn_rate


def test_a_robot_that_looks_along_y_and_drives_ahead_moves_along_y():
    message = outgoing.odometry(MAKE, "odom", "base", 0.0, Pose2(0, 0, math.pi / 2), np.array([0.0, 0.5]), 0.0)
    assert message.twist.twist.linear.x == pytest.approx(0.5)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_odometry_that_is_no_number_is_refused(bad):
    message = outgoing.odometry(MAKE, "odom", "base", 0.0, Pose2(bad, 0, 0), np.zeros(2), 0.0)
    assert messages.read_odometry(message) is None
    message = outgoing.odometry(MAKE, "odom", "base", 0.0, Pose2(), np.zeros(2), 0.0)
    message.twist.twist.linear.x = bad
    assert messages.read_odometry(message) is None


def scan_message(ranges, **changes):
    fields = {
        "angle_min": -1.0, "angle_increment": 0.5, "range_min": 0.1, "range_max": 10.0, "time_increment": 0.0,
    }  # fmt: skip
    return SimpleNamespace(header=header("laser"), ranges=ranges, **(fields | changes))


def test_a_scan_tells_no_return_from_a_failed_beam():
    scan = messages.read_scan(scan_message([1.0, math.inf, 12.0, 0.0, math.nan]))
    assert scan is not None
    assert scan.ranges[0] == 1.0
    assert np.isposinf(scan.ranges[1:3]).all()
    assert np.isnan(scan.ranges[3:]).all()
    assert scan.beams.count == 5


def test_a_scanner_hung_upside_down_sees_the_same_points():
    ranges = [1.0, 2.0, 3.0, 4.0]
    plain = messages.read_scan(scan_message(ranges, angle_min=-1.0, angle_increment=0.5))
    turned = messages.read_scan(scan_message(ranges[::-1], angle_min=0.5, angle_increment=-0.5))
    assert plain is not None
    assert turned is not None
    assert np.allclose(plain.ranges, turned.ranges)
    assert np.allclose(plain.beams.bearings, turned.beams.bearings)


@pytest.mark.parametrize(
    "changes",
    [
        {"angle_increment": 0.0},
        {"angle_increment": 5e-324},
        {"angle_increment": 13.0},
        {"range_max": math.nan},
        {"time_increment": 1e9},
    ],
)
def test_a_scan_without_geometry_is_refused(changes):
    assert messages.read_scan(scan_message([1.0], **changes)) is None
    assert messages.read_scan(scan_message([])) is None


@pytest.mark.parametrize("failed", [math.nan, 0.0, 0.05, -math.inf])
def test_a_scanner_that_is_covered_tells_nothing_of_whether_somebody_is_there(failed):
    assert messages.read_scan(scan_message([failed, failed])) is None
    assert messages.read_scan(scan_message([failed, math.inf])) is not None
    assert messages.read_scan(scan_message([math.inf, math.inf])) is not None


def test_poses_of_people_have_no_identity_and_need_no_heading():
    poses = [namespace_pose(1, 2, (math.nan, 0.0, 0.0, 1.0)), namespace_pose(3, 4)]
    people = messages.read_pose_array(SimpleNamespace(header=header(), poses=poses))
    assert people is not None
    assert people.ids is None
    assert people.positions.tolist() == [[1, 2], [3, 4]]


def test_markers_of_one_name_are_as_many_people():
    people = messages.read_markers(SimpleNamespace(markers=[marker(1, 2), marker(3, 4), marker(5, 6, ns="a")]))
    assert people is not None
    assert people.ids == ("0", "0'", "a/0")


@pytest.mark.parametrize("nowhere", [math.nan, math.inf])
def test_people_of_whom_one_is_nowhere_are_not_people_without_that_one(nowhere):
    poses = [namespace_pose(1, 2), namespace_pose(nowhere, 0)]
    assert messages.read_pose_array(SimpleNamespace(header=header(), poses=poses)) is None
    assert messages.read_markers(SimpleNamespace(markers=[marker(1, 2), marker(0, nowhere, number=1)])) is None


def marker(x, y, *, number=0, ns="", kind=3, action=0, frame="odom"):
    return SimpleNamespace(header=header(frame), ns=ns, id=number, type=kind, action=action, pose=namespace_pose(x, y))


def test_markers_are_people_with_identities_and_decoration_is_none():
    array = SimpleNamespace(
        markers=[
            marker(1, 2, number=7),
            marker(3, 4, ns="people", number=1),
            marker(0, 0, kind=9),
            marker(0, 0, action=2),
        ]
    )
    people = messages.read_markers(array)
    assert people is not None
    assert people.ids == ("7", "people/1")
    assert people.positions.tolist() == [[1, 2], [3, 4]]


def test_markers_may_say_that_nobody_is_there_but_not_disagree_about_the_frame():
    nobody = messages.read_markers(SimpleNamespace(markers=[]))
    assert nobody is not None
    assert nobody.positions.shape == (0, 2)
    assert messages.read_markers(SimpleNamespace(markers=[marker(0, 0), marker(1, 1, frame="map")])) is None


def test_what_we_publish_about_people_can_be_read_as_people():
    plan = plan_of(5.0, people=1)
    markers = list(belief_markers(MAKE, "odom", 5.0, "a", plan.people["p0"], radius=0.3, lifetime=0.4))
    people = messages.read_markers(SimpleNamespace(markers=markers))
    assert people is not None
    assert len(people.ids or ()) == 1  # cylinder counts, arrow and text do not
    assert np.allclose(people.positions, [[1.0, 1.0]])
    assert any("0.75" in m.text for m in markers)


@pytest.mark.parametrize("x", [1e10, math.inf, math.nan])
def test_no_place_is_beyond_reckoning(x):
    nobody = SimpleNamespace(linear=SimpleNamespace(x=0.0, y=0.0), angular=SimpleNamespace(z=0.0))
    where = SimpleNamespace(pose=namespace_pose(x, 0))
    assert (
        messages.read_odometry(SimpleNamespace(header=header(), pose=where, twist=SimpleNamespace(twist=nobody)))
        is None
    )
    assert messages.read_goal(SimpleNamespace(header=header(), pose=namespace_pose(x, 0))) is None
    info = SimpleNamespace(height=1, width=1, resolution=abs(x), origin=namespace_pose(0, 0))
    assert messages.read_map(SimpleNamespace(header=header(), info=info, data=[0])) is None


def test_a_map_has_rows_along_y_and_a_turned_origin():
    info = SimpleNamespace(height=2, width=3, resolution=0.5, origin=namespace_pose(1, 2, quaternion_of(math.pi / 2)))
    grid = messages.read_map(SimpleNamespace(header=header("/map"), info=info, data=[0, 100, -1, 65, 64, 0]))
    assert grid is not None
    assert grid.frame == "map"
    assert grid.occupied.tolist() == [[False, True, False], [True, False, False]]
    assert grid.origin.yaw == pytest.approx(math.pi / 2)
    strict = messages.read_map(
        SimpleNamespace(header=header("map"), info=info, data=[0, 100, -1, 65, 64, 0]), unknown_is_free=False
    )
    assert strict is not None
    assert strict.occupied[0, 2]
    assert strict.as_seen.occupied.tolist() == grid.occupied.tolist()


def test_a_map_whose_size_lies_is_refused():
    info = SimpleNamespace(height=2, width=3, resolution=0.5, origin=namespace_pose(0, 0))
    assert messages.read_map(SimpleNamespace(header=header(), info=info, data=[0] * 5)) is None


def test_a_path_looks_ahead_and_is_stamped_with_its_instants():
    plan = plan_of(10.0, velocity=(0.0, 0.4))
    path = outgoing.path(MAKE, "odom", plan.time, plan.positions, plan.time_step)
    assert [messages.seconds_of(p.header.stamp) for p in path.poses] == pytest.approx([10.0, 10.5, 11.0, 11.5])
    assert all(yaw_of(p.pose.orientation) == pytest.approx(math.pi / 2) for p in path.poses)
    assert path.poses[2].pose.position.y == pytest.approx(0.4)


@settings(max_examples=50)
@given(st.lists(st.floats(0, 1), min_size=6, max_size=6))
def test_the_published_grid_never_hides_a_probability_that_matters(values):
    probability = np.array(values).reshape(2, 3)
    grid = outgoing.grid(MAKE, "odom", 0.0, np.array([-1.0, 2.0]), 0.1, probability)
    percent = np.asarray(grid.data).reshape(2, 3)
    assert (percent >= 100 * probability - 1e-3).all()
    assert (percent <= 100 * probability + 1).all()
    assert (grid.info.width, grid.info.height) == (3, 2)
    assert (percent <= 100).all()
