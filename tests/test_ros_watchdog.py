"""Nothing old passes for new: arrivals, stamps, clocks; and where frames lie between two odometry messages."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sidestep.ros.frames import Frames
from sidestep.ros.geometry import Pose2
from sidestep.ros.messages import Odometry
from sidestep.ros.watchdog import Beat, Watchdog


def fed(now: float = 10.0, stamp: float = 0.0) -> Watchdog:
    dog = Watchdog(("odom", "scan"), 0.5)
    dog.fed("odom", now=now, stamp=stamp)
    dog.fed("scan", now=now)
    return dog


def test_it_names_what_never_came():
    dog = Watchdog(("odom", "scan"), 0.5)
    assert dog.complaint(0.0, 0.0) == "no odom yet"
    dog.fed("odom", now=0.0)
    assert dog.complaint(0.1, 0.1) == "no scan yet"
    assert dog.waits()


def test_it_is_content_until_the_timeout_and_then_names_the_input_and_its_age():
    dog = fed(10.0)
    assert dog.complaint(10.5, 0.0) == ""
    dog.fed("odom", now=10.9)
    assert dog.complaint(11.0, 0.5) == "no scan for 1.0 s"
    dog.fed("scan", now=11.0)
    assert dog.complaint(11.1, 0.6) == ""


def test_what_comes_and_cannot_be_used_is_missing_and_named():
    dog = fed(10.0)
    dog.refused("scan")
    dog.fed("odom", now=11.0)
    assert dog.complaint(10.4, 0.0) == ""
    assert dog.complaint(11.0, 0.5).startswith("no scan for 1.0 s; 1 came that could not be used: not finite, or")
    dog.fed("scan", now=11.0)
    assert dog.complaint(12.0, 1.0) == "no odom for 1.0 s"
    dog.fed("odom", now=12.4)
    assert dog.complaint(12.4, 1.4) == "no scan for 1.4 s"  # what could be used has come since
    dog.refused("odom")
    dog.clear()
    assert dog.complaint(12.0, 1.0) == "no odom yet"
    dog.refused("odom")
    assert dog.complaint(12.0, 1.0).startswith("no odom yet; 1 came that")


def test_old_messages_at_full_rate_do_not_pass_for_a_sensor_that_works():
    assert "0.9 s behind now" in fed(10.0, stamp=9.1).complaint(10.0, 0.0)


def test_stamps_from_a_clock_that_is_ahead_are_told_too():
    assert "ahead of now" in fed(10.0, stamp=12.0).complaint(10.0, 0.0)


def test_a_clock_that_stands_still_stops_the_robot():
    dog = fed(10.0)
    assert dog.complaint(10.1, 100.0) == ""
    assert dog.complaint(10.1, 100.4) == ""
    assert "clock has stood still" in dog.complaint(10.1, 100.6)
    assert dog.complaint(10.2, 100.7) == ""


def test_ages_count_the_worse_of_arrival_and_stamp():
    dog = fed(10.0, stamp=9.8)
    assert dog.age("odom", 10.1) == pytest.approx(0.3)
    assert dog.age("scan", 10.1) == pytest.approx(0.1)
    assert dog.age("map", 10.1) == math.inf


def test_a_rate_falls_when_nothing_comes_and_is_forgotten_in_the_end():
    beat = Beat()
    for k in range(30):
        beat.beat(0.1 * k)
    assert beat.rate(2.95) == pytest.approx(10.0)
    assert beat.rate(3.9) == pytest.approx(1.0, rel=1e-6)
    assert beat.rate(9.0) == 0.0


def odometry(x: float, yaw: float, frame: str = "odom") -> Odometry:
    return Odometry(time=0.0, frame=frame, pose=Pose2(x, 0.0, yaw), velocity=np.zeros(2), turn_rate=0.0)


def test_the_scanner_is_where_the_robot_was_when_it_measured():
    frames = Frames(planning="odom", base="base_link", mount=Pose2(0.2, 0.0, 0.0))
    frames.note(odometry(0.0, 0.0), 1.0)
    frames.note(odometry(1.0, math.pi / 2), 2.0)
    halfway = frames.scanner("laser", 1.5)
    assert halfway is not None
    assert np.allclose([halfway.x, halfway.y], [0.5 + 0.2 * math.cos(math.pi / 4), 0.2 * math.sin(math.pi / 4)])
    assert halfway.yaw == pytest.approx(math.pi / 4)


def at(x: float, y: float) -> Odometry:
    return Odometry(time=0.0, frame="odom", pose=Pose2(x, y), velocity=np.zeros(2), turn_rate=0.0)


def test_between_two_odometry_messages_the_robot_is_between_their_places():
    frames = Frames(planning="odom", base="base_link", mount=Pose2())
    for time, place in ((1.0, (1.0, 4.0)), (2.0, (2.0, 2.0)), (3.0, (5.0, -1.0))):
        frames.note(at(*place), time)
    for time, there in ((0.5, (1.0, 4.0)), (1.25, (1.25, 3.5)), (2.5, (3.5, 0.5)), (9.0, (5.0, -1.0))):
        robot = frames.robot(time)
        assert robot is not None
        assert (robot.x, robot.y) == pytest.approx(there)


def test_where_odometry_starts_again_what_was_before_does_not_count():
    """A driver that starts anew, or a recording played again: places of two runs were mixed."""
    frames = Frames(planning="odom", base="base_link", mount=Pose2())
    for time in (5.0, 6.0, 7.0):
        frames.note(at(9.0, 9.0), time)
    frames.note(at(0.0, 0.0), 1.0)
    frames.note(at(1.0, 0.0), 2.0)
    robot = frames.robot(1.5)
    assert robot is not None
    assert (robot.x, robot.y) == pytest.approx((0.5, 0.0))
    frames.clear()
    assert frames.robot() is None


def test_the_shorter_way_round_is_taken_between_two_headings():
    frames = Frames(planning="odom", base="base_link", mount=Pose2())
    frames.note(odometry(0.0, 3.0), 1.0)
    frames.note(odometry(0.0, -3.0), 2.0)
    robot = frames.robot(1.5)
    assert robot is not None
    assert abs(robot.yaw) == pytest.approx(math.pi)


def test_frames_come_from_tf_where_it_knows_them():
    known = {("map", "odom"): Pose2(10.0, 0.0, 0.0), ("base_link", "laser"): Pose2(0.0, 0.1, math.pi)}
    frames = Frames(
        planning="map", base="base_link", mount=Pose2(), lookup=lambda parent, child: known.get((parent, child))
    )
    pose = frames.note(odometry(1.0, 0.0), 1.0)
    assert pose is not None
    assert pose.x == 11.0
    scanner = frames.scanner("laser", 1.0)
    assert scanner is not None
    assert (scanner.x, scanner.y) == pytest.approx((11.0, 0.1))
    assert frames.locate("kitchen") is None


def test_odometry_in_an_unknown_frame_is_not_used():
    frames = Frames(planning="map", base="base_link", mount=Pose2())
    assert frames.note(odometry(1.0, 0.0), 1.0) is None
    assert frames.robot() is None
    alias = Frames(planning="map", base="base_link", mount=Pose2(), same=("odom",))
    assert alias.note(odometry(1.0, 0.0), 1.0) is not None
