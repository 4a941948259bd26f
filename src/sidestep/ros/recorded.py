"""A record of a run → the standard messages that a robot on that run would have sent and received."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from sidestep.errors import InvalidInput
from sidestep.lattice import Lattice
from sidestep.obstacles import Obstacles
from sidestep.planning.plan import limited_name
from sidestep.prediction.collision import PersonMass, RiskField
from sidestep.ros import outgoing
from sidestep.ros.geometry import Pose2, wrapped
from sidestep.ros.outgoing import Maker
from sidestep.simulation.record import Record, Snapshot

START = 1000.0
"""s, stamp of the first instant: a stamp of 0 would mean that there is none."""
FRAME, BASE = "odom", "base_link"
SCENARIO_TOPIC = "/sidestep/scenario"
"""std_msgs/String: every number of the run, as JSON."""
_MAP_RESOLUTION = 0.05  # m
_GRID_RESOLUTION, _GRID_CELLS = 0.1, 80


class Message(NamedTuple):
    """One message of a recording: topic, type, time (s), and the message itself."""

    topic: str
    type: str
    time: float
    message: Any


def record_messages(record: Record, make: Maker) -> Iterator[Message]:
    """Yield the messages of a run in the order of time.

    odom, tf, people (PoseArray), people_markers (with identities), goal, map, cmd_vel, plan, beliefs, predicted
    occupancy at the recorded snapshots, diagnostics, and the scenario itself.

    Raises:
        InvalidInput: the run is not in two dimensions.
    """
    if record.robot_positions.shape[1] != 2:
        dimension = record.robot_positions.shape[1]
        raise InvalidInput("record", f"a run in {dimension} dimensions", "a run in 2 dimensions; messages are flat")
    text = make("std_msgs/String", data=json.dumps(dict(record.settings)))
    yield Message(SCENARIO_TOPIC, "std_msgs/String", START, text)
    goal = Pose2(float(record.robot_goal[0]), float(record.robot_goal[1]))
    yield Message("/goal", "geometry_msgs/PoseStamped", START, outgoing.pose_stamped(make, FRAME, START, goal))
    if record.walls:
        yield Message("/map", "nav_msgs/OccupancyGrid", START, _map(record, make))
    snapshots: dict[int, list[Snapshot]] = {}
    for snapshot in record.snapshots:
        snapshots.setdefault(snapshot.step, []).append(snapshot)
    for step in range(len(record.time)):
        yield from _measured(record, make, step)
        if step < len(record.status):
            yield from _decided(record, make, step)
        if step in snapshots:
            yield _predicted(record, make, step, snapshots[step])


def _measured(record: Record, make: Maker, step: int) -> Iterator[Message]:
    """What sensors say."""
    time = START + float(record.time[step])
    place, velocity, turn = _robot(record, step)
    robot = outgoing.odometry(make, FRAME, BASE, time, place, velocity, turn)
    yield Message("/odom", "nav_msgs/Odometry", time, robot)
    yield Message("/tf", "tf2_msgs/TFMessage", time, outgoing.transform(make, FRAME, BASE, time, place))
    there = np.flatnonzero(np.isfinite(record.people_positions[step]).all(axis=1))
    positions = record.people_positions[step][there]
    poses = outgoing.pose_array(make, FRAME, time, positions)
    yield Message("/people", "geometry_msgs/PoseArray", time, poses)
    bodies = [_body(record, make, int(p), time, positions[i]) for i, p in enumerate(there)]
    markers = outgoing.marker_array(make, bodies)
    yield Message("/people_markers", "visualization_msgs/MarkerArray", time, markers)


def _decided(record: Record, make: Maker, step: int) -> Iterator[Message]:
    """What the planner says."""
    time = START + float(record.time[step])
    place, velocity, turn = _robot(record, step)
    forward, sideways = velocity @ place.rotation
    command = outgoing.twist(make, float(forward), float(sideways), turn)
    yield Message("/cmd_vel", "geometry_msgs/Twist", time, command)
    if record.plan_age[step] > 0:
        return
    if np.isfinite(record.plans[step]).all():
        path = outgoing.path(make, FRAME, time, record.plans[step], record.time_step)
        yield Message("/plan", "nav_msgs/Path", time, path)
    known = np.flatnonzero(np.isfinite(record.beliefs[step]))
    texts = outgoing.marker_array(make, [_belief(record, make, int(p), time, step) for p in known])
    yield Message("/beliefs", "visualization_msgs/MarkerArray", time, texts)
    values = {
        "plan status": record.status[step],
        "planning time (ms)": f"{1e3 * record.planning_time[step]:.2f}",
        "largest P_coll": f"{_largest(record.collision_probability[step]):.4f}",
        limited_name(record.risk_rule): f"{np.nan_to_num(record.limited_risk[step]):.4f}",
    }
    level = outgoing.OK if record.status[step] == "certified" else outgoing.WARN
    words = outgoing.diagnostics(make, time, level=level, message=record.status[step], values=values)
    yield Message("/diagnostics", "diagnostic_msgs/DiagnosticArray", time, words)


def _predicted(record: Record, make: Maker, step: int, snapshots: list[Snapshot]) -> Message:
    time = START + float(record.time[step])
    people = [
        PersonMass.of(
            lattice=Lattice(
                origin=s.origin, spacing=s.spacing, radius=s.probability.shape[1] // 2, rotation=s.rotation
            ),
            steps=np.concatenate([s.probability[:1], s.probability]),  # the first counts as "now", a single cell
            reach=s.probability.shape[1],  # whatever the instants are, no cell is dropped
        )
        for s in snapshots
    ]
    half = _GRID_CELLS // 2
    middle = record.robot_positions[step]
    field = RiskField(people=people, distances=record.people_radii[[s.person for s in snapshots]], midway=False)
    instants = range(min(len(s.instants) for s in snapshots))
    rasters = [field.raster(2 * (k + 1), middle, _GRID_RESOLUTION, half) for k in instants]
    corner = middle - _GRID_RESOLUTION * (half + 0.5)
    message = outgoing.grid(make, FRAME, time, corner, _GRID_RESOLUTION, np.max(rasters, axis=0).T.astype(np.float64))
    return Message("/predicted_occupancy", "nav_msgs/OccupancyGrid", time, message)


def _robot(record: Record, step: int) -> tuple[Pose2, Any, float]:
    """Pose, velocity (2,) m/s and turn rate (rad/s) from this instant on."""
    x, y = record.robot_positions[step]
    now = min(step, len(record.robot_velocities) - 1)
    headings = np.nan_to_num(record.robot_headings)
    turn = wrapped(float(headings[now + 1] - headings[now])) / record.control_step if len(headings) > 1 else 0.0
    velocity = record.robot_velocities[now] if step < len(record.robot_velocities) else np.zeros(2)
    return Pose2(float(x), float(y), float(headings[step])), velocity, turn


def _body(record: Record, make: Maker, person: int, time: float, position: Any) -> Any:
    radius = float(record.people_radii[person])
    return outgoing.marker(
        make, FRAME, time, namespace=record.people[person], number=0, kind=outgoing.CYLINDER,
        place=Pose2(float(position[0]), float(position[1])), height=0.85, size=(2 * radius, 2 * radius, 1.7),
        colour=(0.6, 0.6, 0.7, 0.6), lifetime=1.5 * record.control_step,
    )  # fmt: skip


def _belief(record: Record, make: Maker, person: int, time: float, step: int) -> Any:
    x, y = np.nan_to_num(record.people_positions[step, person])
    belief = float(record.beliefs[step, person])
    name = record.people[person]
    return outgoing.marker(
        make, FRAME, time, namespace="beliefs", number=person, kind=outgoing.TEXT,
        place=Pose2(float(x), float(y)), height=1.9, size=(0.0, 0.0, 0.25),
        colour=(1.0 - belief, belief, 0.2, 1.0), text=f"{name}: concerned {belief:.2f}",
        lifetime=1.5 * record.time_step,
    )  # fmt: skip


def _map(record: Record, make: Maker) -> Any:
    corners = np.concatenate([*record.walls, record.robot_positions])
    low, high = corners.min(axis=0) - 1.0, corners.max(axis=0) + 1.0
    columns, rows = np.ceil((high - low) / _MAP_RESOLUTION).astype(int)
    i, j = np.meshgrid(np.arange(columns), np.arange(rows))
    points = low + _MAP_RESOLUTION * (np.stack([i, j], axis=-1) + 0.5)
    inside = Obstacles(polygons=record.walls).distance(points) < _MAP_RESOLUTION / 2
    return outgoing.grid(make, FRAME, START, low, _MAP_RESOLUTION, inside.astype(np.float64))


def _largest(values: Any) -> float:
    known = values[np.isfinite(values)]
    return float(known.max()) if known.size else 0.0
