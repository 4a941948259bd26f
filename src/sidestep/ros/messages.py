"""Standard messages → plain values. Knows the fields of messages, not ROS: any object with these fields will do.

ROS 1, ROS 2 and recordings name the same things alike, except for the two parts of a stamp. What arrives may be wrong
in any way a driver can be wrong; a message that cannot be used gives None, never an exception.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sidestep.perception.scan import Beams
from sidestep.ros.geometry import Pose2, yaw_of
from sidestep.types import LARGEST, BoolArray, FloatArray, Vector, plausible

_ADD = 0
_BODIES = (1, 2, 3, 10)  # Marker: CUBE, SPHERE, CYLINDER, MESH_RESOURCE: one body each; the rest is decoration
FINEST, WIDEST, LONGEST_TURN = 1e-5, 4 * math.pi, 10.0
"""rad between beams, rad between the first and the last, s: what a scan can say of itself and be believed."""
OCCUPIED = 65
"""Cells of an OccupancyGrid from this value on are walls (the map server's convention)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Odometry:
    """Where the robot is and how it moves.

    Attributes:
        time: s, stamp; 0 where the driver sends none.
        frame: name of the frame of `pose` and `velocity`.
        pose: of the robot.
        velocity: (2,) m/s in `frame`.
        turn_rate: rad/s.
    """

    time: float
    frame: str
    pose: Pose2
    velocity: Vector
    turn_rate: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LaserScan:
    """One scan in the scanner's own frame.

    Attributes:
        time: s, stamp, of beam 0.
        frame: name of the scanner's frame.
        beams: how the scanner looks.
        ranges: (B,) m; +inf for no return, NaN for a failed measurement.
    """

    time: float
    frame: str
    beams: Beams
    ranges: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class People:
    """Measured people.

    Attributes:
        time: s, stamp.
        frame: name of the frame.
        ids: one per person, or None where the message has no identities.
        positions: (P, 2) m.
    """

    time: float
    frame: str
    ids: tuple[str, ...] | None
    positions: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Target:
    """Where the robot shall go.

    Attributes:
        frame: name of the frame.
        position: (2,) m.
    """

    frame: str
    position: Vector


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Map:
    """A static map.

    Attributes:
        frame: name of the frame.
        origin: pose of the corner of cell [0, 0].
        resolution: m per cell.
        occupied: (rows, columns), row 0 at the origin, rows along y.
        walls: (rows, columns) what of it somebody has seen to be occupied; None: all of it.
    """

    frame: str
    origin: Pose2
    resolution: float
    occupied: BoolArray
    walls: BoolArray | None = None

    def same_as(self, other: Map | None) -> bool:
        """Whether it says what another one, in any frame's name, says."""
        if other is None or (self.origin, self.resolution) != (other.origin, other.resolution):
            return False
        if self.walls is None or other.walls is None:
            return self.walls is other.walls and np.array_equal(self.occupied, other.occupied)
        return np.array_equal(self.occupied, other.occupied) and np.array_equal(self.walls, other.walls)

    @property
    def as_seen(self) -> Map:
        """The map without cells that count as occupied only because nobody has seen them."""
        return self if self.walls is None else replace(self, occupied=self.walls, walls=None)


def seconds_of(stamp: Any) -> float:
    """Return a ROS 1 stamp (secs, nsecs) or a ROS 2 stamp (sec, nanosec) in s."""
    if hasattr(stamp, "nanosec"):
        return float(stamp.sec) + 1e-9 * float(stamp.nanosec)
    return float(stamp.secs) + 1e-9 * float(stamp.nsecs)


def read_odometry(message: Any) -> Odometry | None:
    """nav_msgs/Odometry; its twist is given in the body's frame."""
    pose = _pose(message.pose.pose)
    twist = message.twist.twist
    ahead, turn_rate = np.array([float(twist.linear.x), float(twist.linear.y)]), float(twist.angular.z)
    if not (pose.plausible and plausible(ahead) and abs(turn_rate) <= LARGEST):
        return None
    return Odometry(
        time=seconds_of(message.header.stamp),
        frame=_name(message.header.frame_id),
        pose=pose,
        velocity=pose.rotation @ ahead,
        turn_rate=turn_rate,
    )


def read_scan(message: Any) -> LaserScan | None:
    """sensor_msgs/LaserScan, beams counter-clockwise; beyond the scanner's reach is no return, too near has failed.

    None where all beams have failed: a scanner that is covered sees nobody because it sees nothing.
    """
    ranges = np.asarray(message.ranges, dtype=np.float64)
    numbers = tuple(
        float(getattr(message, name))
        for name in ("angle_min", "angle_increment", "range_min", "range_max", "time_increment")
    )
    if ranges.ndim != 1 or ranges.size == 0 or not np.isfinite(numbers).all():
        return None
    if not (FINEST <= abs(numbers[1]) <= WIDEST / ranges.size and numbers[4] * ranges.size <= LONGEST_TURN):
        return None
    if numbers[1] < 0:  # a scanner hung upside down turns the other way
        ranges = ranges[::-1]
    beams = Beams(
        count=ranges.size,
        angle_min=min(numbers[0], numbers[0] + (ranges.size - 1) * numbers[1]),
        angle_increment=abs(numbers[1]),
        range_min=numbers[2],
        range_max=numbers[3],
        time_increment=max(numbers[4], 0.0),
    )
    ranges = np.where(ranges > beams.range_max, np.inf, np.where(ranges < beams.range_min, np.nan, ranges))
    if np.isnan(ranges).all():
        return None
    return LaserScan(
        time=seconds_of(message.header.stamp), frame=_name(message.header.frame_id), beams=beams, ranges=ranges
    )


def read_pose_array(message: Any) -> People | None:
    """geometry_msgs/PoseArray: people without identity. None when somebody is there, but nobody can say where."""
    positions = _places(message.poses)
    if positions is None:
        return None
    return People(
        time=seconds_of(message.header.stamp), frame=_name(message.header.frame_id), ids=None, positions=positions
    )


def read_markers(message: Any) -> People | None:
    """visualization_msgs/MarkerArray: one body (cube, sphere, cylinder, mesh) per person, identity from ns and id.

    Text, arrows and removals are skipped. None when bodies disagree about their frame, or one is nowhere. An array
    without any body says that nobody is there; it then has neither stamp nor frame.
    """
    bodies = [m for m in message.markers if int(m.action) == _ADD and int(m.type) in _BODIES]
    positions = _places([m.pose for m in bodies])
    frames = {_name(m.header.frame_id) for m in bodies}
    if positions is None or len(frames) > 1:
        return None
    return People(
        time=max((seconds_of(m.header.stamp) for m in bodies), default=0.0),
        frame=frames.pop() if frames else "",
        ids=_told_apart([f"{m.ns}/{int(m.id)}" if m.ns else str(int(m.id)) for m in bodies]),
        positions=positions,
    )


def read_goal(message: Any) -> Target | None:
    """geometry_msgs/PoseStamped; the heading is not used."""
    pose = _pose(message.pose)
    return Target(frame=_name(message.header.frame_id), position=pose.position) if pose.plausible else None


def read_map(message: Any, *, unknown_is_free: bool = True) -> Map | None:
    """nav_msgs/OccupancyGrid; −1 is unknown."""
    info = message.info
    rows, columns = int(info.height), int(info.width)
    values = np.asarray(message.data, dtype=np.int16)
    origin, resolution = _pose(info.origin), float(info.resolution)
    if not (
        origin.plausible and 0 < resolution <= LARGEST and min(rows, columns) > 0 and values.size == rows * columns
    ):
        return None
    walls = values.reshape(rows, columns) >= OCCUPIED
    occupied = walls if unknown_is_free else walls | (values.reshape(rows, columns) < 0)
    frame = _name(message.header.frame_id)
    return Map(frame=frame, origin=origin, resolution=resolution, occupied=occupied, walls=walls)


def read_transform(message: Any) -> Pose2 | None:
    """geometry_msgs/TransformStamped: the child's pose in the parent frame, flattened to the plane."""
    move = message.transform.translation
    pose = Pose2(float(move.x), float(move.y), yaw_of(message.transform.rotation))
    return pose if pose.plausible else None


def _told_apart(names: Iterable[str]) -> tuple[str, ...]:
    """The same names, each followed by as many primes as it came before."""
    seen: Counter[str] = Counter()
    apart: list[str] = []
    for name in names:
        apart.append(name + "'" * seen[name])
        seen[name] += 1
    return tuple(apart)


def _places(poses: Iterable[Any]) -> FloatArray | None:
    """(P, 2) m; None where one is no place."""
    positions = np.array([(float(p.position.x), float(p.position.y)) for p in poses], dtype=np.float64).reshape(-1, 2)
    return positions if plausible(positions.ravel()) else None


def _pose(message: Any) -> Pose2:
    return Pose2(float(message.position.x), float(message.position.y), yaw_of(message.orientation))


def _name(frame: str) -> str:
    return frame.removeprefix("/")  # ROS 1 before tf2 wrote "/odom"
