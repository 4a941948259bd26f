"""Plain values → standard messages. A `Maker` knows the dialect: ROS 1, ROS 2, or a recording."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from sidestep.ros.geometry import Pose2, quaternion_of
from sidestep.types import FloatArray, Vector

OK, WARN, ERROR = 0, 1, 2
"""Levels of diagnostic_msgs/DiagnosticStatus."""
ARROW, CYLINDER, TEXT = 0, 3, 9
"""Types of visualization_msgs/Marker."""


class Maker(Protocol):
    """Makes messages of one dialect."""

    def __call__(self, name: str, /, **fields: Any) -> Any:
        """Return a message such as "geometry_msgs/Twist"; fields not given keep their defaults."""
        ...

    def stamp(self, seconds: float) -> Any:
        """Return a time stamp."""
        ...

    def duration(self, seconds: float) -> Any:
        """Return a duration."""
        ...

    def numbers(self, kind: str, values: Any) -> Any:
        """Return a field that is an array of primitives; `kind` is a numpy name such as "int8"."""
        ...

    def level(self, value: int) -> Any:
        """Return a `byte` field."""
        ...


def header(make: Maker, frame: str, time: float) -> Any:
    """std_msgs/Header."""
    return make("std_msgs/Header", frame_id=frame, stamp=make.stamp(time))


def twist(make: Maker, forward: float, sideways: float, turn_rate: float) -> Any:
    """geometry_msgs/Twist in the robot's frame: m/s ahead, m/s to the left, rad/s counter-clockwise."""
    return make(
        "geometry_msgs/Twist",
        linear=make("geometry_msgs/Vector3", x=float(forward), y=float(sideways), z=0.0),
        angular=make("geometry_msgs/Vector3", x=0.0, y=0.0, z=float(turn_rate)),
    )


def pose(make: Maker, place: Pose2, height: float = 0.0) -> Any:
    """geometry_msgs/Pose."""
    x, y, z, w = quaternion_of(place.yaw)
    return make(
        "geometry_msgs/Pose",
        position=make("geometry_msgs/Point", x=float(place.x), y=float(place.y), z=float(height)),
        orientation=make("geometry_msgs/Quaternion", x=x, y=y, z=z, w=w),
    )


def pose_stamped(make: Maker, frame: str, time: float, place: Pose2) -> Any:
    """geometry_msgs/PoseStamped."""
    return make("geometry_msgs/PoseStamped", header=header(make, frame, time), pose=pose(make, place))


def pose_array(make: Maker, frame: str, time: float, positions: FloatArray) -> Any:
    """geometry_msgs/PoseArray of (P, 2) m."""
    return make(
        "geometry_msgs/PoseArray",
        header=header(make, frame, time),
        poses=[pose(make, Pose2(float(x), float(y))) for x, y in positions],
    )


def path(make: Maker, frame: str, time: float, positions: FloatArray, time_step: float) -> Any:
    """nav_msgs/Path of (N+1, 2) m; each pose is stamped with the instant at which the robot shall be there."""
    ahead = np.diff(positions, axis=0)
    yaws = np.arctan2(ahead[:, 1], ahead[:, 0]) if len(ahead) else np.zeros(0)
    yaws = np.append(yaws, yaws[-1] if yaws.size else 0.0)
    return make(
        "nav_msgs/Path",
        header=header(make, frame, time),
        poses=[
            pose_stamped(make, frame, time + k * time_step, Pose2(float(x), float(y), float(yaw)))
            for k, ((x, y), yaw) in enumerate(zip(positions, yaws, strict=True))
        ],
    )


def grid(make: Maker, frame: str, time: float, corner: Vector, resolution: float, probability: FloatArray) -> Any:
    """nav_msgs/OccupancyGrid of (rows, columns) probabilities, rows along y; rounded up, so that little is not nothing.

    Args:
        make: dialect.
        frame: of the grid.
        time: s.
        corner: (2,) m, of cell [0, 0].
        resolution: m per cell.
        probability: in [0, 1].
    """
    rows, columns = probability.shape
    percent = np.ceil(100 * np.clip(probability, 0.0, 1.0) - 0.5e-3).astype(np.int8)
    info = make(
        "nav_msgs/MapMetaData",
        map_load_time=make.stamp(time),
        resolution=float(resolution),
        width=columns,
        height=rows,
        origin=pose(make, Pose2(float(corner[0]), float(corner[1]))),
    )
    return make(
        "nav_msgs/OccupancyGrid",
        header=header(make, frame, time),
        info=info,
        data=make.numbers("int8", percent.reshape(-1)),
    )


def odometry(make: Maker, frame: str, base: str, time: float, place: Pose2, velocity: Vector, turn_rate: float) -> Any:
    """nav_msgs/Odometry; `velocity` (2,) m/s in `frame` is written in the robot's own, as the message wants."""
    forward, sideways = velocity @ place.rotation
    covariance = make.numbers("float64", np.zeros(36))
    return make(
        "nav_msgs/Odometry",
        header=header(make, frame, time),
        child_frame_id=base,
        pose=make("geometry_msgs/PoseWithCovariance", pose=pose(make, place), covariance=covariance),
        twist=make(
            "geometry_msgs/TwistWithCovariance",
            twist=twist(make, float(forward), float(sideways), turn_rate),
            covariance=covariance,
        ),
    )


def transform(make: Maker, parent: str, child: str, time: float, place: Pose2) -> Any:
    """tf2_msgs/TFMessage with one transform."""
    x, y, z, w = quaternion_of(place.yaw)
    stamped = make(
        "geometry_msgs/TransformStamped",
        header=header(make, parent, time),
        child_frame_id=child,
        transform=make(
            "geometry_msgs/Transform",
            translation=make("geometry_msgs/Vector3", x=float(place.x), y=float(place.y), z=0.0),
            rotation=make("geometry_msgs/Quaternion", x=x, y=y, z=z, w=w),
        ),
    )
    return make("tf2_msgs/TFMessage", transforms=[stamped])


def marker_array(make: Maker, markers: Iterable[Any]) -> Any:
    """visualization_msgs/MarkerArray."""
    return make("visualization_msgs/MarkerArray", markers=list(markers))


def marker(
    make: Maker,
    frame: str,
    time: float,
    *,
    namespace: str,
    number: int,
    kind: int,
    place: Pose2,
    size: tuple[float, float, float],
    colour: Sequence[float],
    lifetime: float,
    height: float = 0.0,
    text: str = "",
) -> Any:
    """visualization_msgs/Marker; it vanishes by itself after `lifetime` s, so that nobody lingers."""
    r, g, b, a = (float(c) for c in colour)
    return make(
        "visualization_msgs/Marker",
        header=header(make, frame, time),
        ns=namespace,
        id=number,
        type=kind,
        action=0,
        pose=pose(make, place, height),
        scale=make("geometry_msgs/Vector3", x=size[0], y=size[1], z=size[2]),
        color=make("std_msgs/ColorRGBA", r=r, g=g, b=b, a=a),
        lifetime=make.duration(lifetime),
        text=text,
    )


def diagnostics(make: Maker, time: float, *, level: int, message: str, values: Mapping[str, object]) -> Any:
    """diagnostic_msgs/DiagnosticArray with the one status "sidestep: planner"."""
    status = make(
        "diagnostic_msgs/DiagnosticStatus",
        level=make.level(level),
        name="sidestep: planner",
        hardware_id="sidestep",
        message=message,
        values=[make("diagnostic_msgs/KeyValue", key=key, value=str(value)) for key, value in values.items()],
    )
    return make("diagnostic_msgs/DiagnosticArray", header=header(make, "", time), status=[status])
