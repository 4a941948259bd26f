"""A recording, planned over again: what would have been planned, and where people went instead of where predicted."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sidestep.checks import one_of
from sidestep.errors import InvalidFile, InvalidInput
from sidestep.io.recordings import Recorded, read_messages, recorded_topics
from sidestep.planning.plan import Plan
from sidestep.ros import messages
from sidestep.ros.assembly import brain
from sidestep.ros.geometry import Pose2
from sidestep.ros.inputs import Inputs
from sidestep.ros.messages import Odometry, Target
from sidestep.ros.recorded import SCENARIO_TOPIC
from sidestep.ros.settings import NodeSettings
from sidestep.ros.tree import TransformTree
from sidestep.studies.replay_score import Forecast, Track, forecasts_of
from sidestep.types import LARGEST, FloatArray, Vector, plausible

KINDS = {
    "odom": "nav_msgs/Odometry",
    "people_markers": "visualization_msgs/MarkerArray",
    "people": "geometry_msgs/PoseArray",
    "scan": "sensor_msgs/LaserScan",
    "goal": "geometry_msgs/PoseStamped",
    "map": "nav_msgs/OccupancyGrid",
}
"""What a recording may hold, and under which type."""
EYES = {"people_markers": "markers", "people": "poses", "scan": "scan"}
"""Where people may come from, best first, and what the node calls it."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Replay:
    """What planning over a recording gave. N steps of the horizon.

    Attributes:
        topics: what was used, input → topic.
        goal: (2,) m, the last one.
        plans: every plan that was made.
        robot: (T, 3) s, m, m, where the robot was.
        tracks: id → where that person was seen.
        forecasts: each prediction whose instants the recording still saw.
    """

    topics: Mapping[str, str]
    goal: Vector
    plans: tuple[Plan, ...]
    robot: FloatArray
    tracks: Mapping[str, Track]
    forecasts: tuple[Forecast, ...]

    @property
    def statuses(self) -> dict[str, int]:
        """Status → number of plans."""
        return dict(Counter(plan.status for plan in self.plans))


def replay(
    path: Path, parameters: Mapping[str, Any], *, goal: tuple[float, float] | None = None, topics: Mapping[str, str]
) -> Replay:
    """Plan over a recording, at the planner's rate and in the time of its stamps.

    Args:
        path: of the recording.
        parameters: of the node, nested; where they say nothing, those under which the run was recorded count.
        goal: (x, y) m; None: the recorded ones, or else that of the parameters, or else where the robot was at last.
        topics: input → topic, where names do not tell.

    Raises:
        InvalidFile: it is no recording, holds neither people nor scans, or nothing that can be planned with.
        InvalidInput: a parameter, the goal or an input's name is not allowed.
    """
    if goal is not None and not plausible(np.array(goal)):
        raise InvalidInput("goal", goal, f"2 finite numbers (m), none beyond ±{LARGEST:g}")
    chosen = choose_topics(path, topics)
    node = parameters.get("node")
    wish = node.get("people_from") if isinstance(node, Mapping) else None
    eyes = next((name for name in EYES if name in chosen and wish in (None, EYES[name])), "")
    if not eyes:
        raise InvalidFile(str(path), f"node.people_from = {wish}", "what the recording holds: " + ", ".join(chosen))
    chosen = {name: topic for name, topic in chosen.items() if name == eyes or name not in EYES}
    frame, last_place = _driven(path, chosen)
    settings = _settings(path, parameters, frame, EYES[eyes])
    tree = TransformTree()
    core, inputs = brain(settings, tree.lookup)
    told = "goal" in chosen or settings.robot.first_goal is not None
    wanted = goal if goal is not None else (None if told else last_place)
    if wanted is not None:
        inputs.take_goal(Target(frame="", position=np.array(wanted, dtype=float)))
        chosen = {name: topic for name, topic in chosen.items() if name != "goal"}
    plans: list[Plan] = []
    robot: list[tuple[float, float, float]] = []
    seen: dict[str, list[tuple[float, float, float]]] = {}
    now, due, period = -np.inf, -np.inf, 1.0 / settings.node.planner_rate
    for now, name in _fed(path, chosen, inputs, tree, eyes):
        state = inputs.robot(now)
        if state is not None and (not robot or now > robot[-1][0]):
            robot.append((now, float(state.position[0]), float(state.position[1])))
        if name != eyes:
            continue
        for person in inputs.seen(now):
            seen.setdefault(person.id, []).append((now, float(person.position[0]), float(person.position[1])))
        if now >= due - 1e-6:
            due = (due if now - due < period else now) + period
            plan = core.plan(now)
            if plan is not None:
                plans.append(plan)
    if not plans:
        core.motion(now, now)  # says why not
        raise InvalidFile(str(path), "no plan", "a recording that can be planned over", core.report(now).summary)
    tracks = {name: Track(np.array(rows)) for name, rows in seen.items()}
    return Replay(
        topics=chosen,
        goal=inputs.task.goal if inputs.task.goal is not None else np.zeros(2),
        plans=tuple(plans),
        robot=np.array(robot),
        tracks=tracks,
        forecasts=tuple(f for plan in plans for f in forecasts_of(plan, tracks)),
    )


def choose_topics(path: Path, given: Mapping[str, str]) -> dict[str, str]:
    """Return input → topic: as given, by the usual name, or the only one of its type.

    Raises:
        InvalidFile: a given topic does not exist, or nothing shows people.
        UnknownName: there is no such input.
    """
    one_of("topic", given, KINDS)
    there = recorded_topics(path)
    chosen: dict[str, str] = {}
    for name, kind in KINDS.items():
        of_kind = sorted(topic for topic, type_ in there.items() if type_ == kind)
        named = [topic for topic in of_kind if topic.rsplit("/", 1)[-1] == name]
        alone = of_kind if len(of_kind) == 1 and name in ("odom", "scan") else []
        if name in given and given[name] not in of_kind:
            raise InvalidFile(f"{path}: {given[name]}", "missing", f"a topic of type {kind}: {', '.join(of_kind)}")
        choice = [given[name]] if name in given else named or alone
        chosen |= {name: choice[0]} if choice else {}
    if not any(name in chosen for name in EYES):
        raise InvalidFile(
            str(path), f"topics {', '.join(sorted(there))}", "people_markers, people or scan", "name one with --topic"
        )
    return chosen


def _driven(path: Path, chosen: Mapping[str, str]) -> tuple[str, tuple[float, float]]:
    """Frame of the odometry and the robot's last place; the scanner's own frame where there is no odometry."""
    frame, place = "", (0.0, 0.0)
    for item in read_messages(path, topics=[chosen["odom"]]) if "odom" in chosen else ():
        odometry = messages.read_odometry(item.message)
        if odometry is not None:
            frame, place = odometry.frame, (odometry.pose.x, odometry.pose.y)
    return frame or "odom", place


def _settings(path: Path, parameters: Mapping[str, Any], frame: str, people_from: str) -> NodeSettings:
    """The parameters, over those of the recorded run, over what the recording itself suggests."""
    recorded: dict[str, Any] = {}
    for item in read_messages(path, topics=[SCENARIO_TOPIC]):
        recorded = json.loads(item.message.data)
    base = {name: recorded[name] for name in ("planner", "human") if name in recorded}
    if "robot" in recorded:
        base["robot"] = {k: v for k, v in recorded["robot"].items() if k not in ("start", "goal", "heading")}
    base["node"] = {"frame": frame, "people_from": people_from}
    for table, values in parameters.items():
        base[table] = {**base.get(table, {}), **values} if isinstance(values, Mapping) else values
    return NodeSettings.parse(base)


def _fed(
    path: Path, chosen: Mapping[str, str], inputs: Inputs, tree: TransformTree, eyes: str
) -> Iterator[tuple[float, str]]:
    """Give a recording to the inputs; yield the time (s, of the stamps) and the input after each message."""
    names = {topic: name for name, topic in chosen.items()}
    now = -np.inf
    for item in read_messages(path, topics=[*names, "/tf", "/tf_static"]):
        if item.type == "tf2_msgs/TFMessage":
            tree.take(item.message)
            continue
        name = names[item.topic]
        now = max(now, _time_of(item))
        if name == eyes and "odom" not in chosen:
            inputs.take_odometry(_at_rest(now), now)
        _give(name, item.message, inputs, now)
        yield now, name


def _give(name: str, message: Any, inputs: Inputs, now: float) -> None:
    if name == "odom":
        inputs.take_odometry(messages.read_odometry(message), now)
    elif name == "scan":
        inputs.take_scan(messages.read_scan(message), now)
    elif name == "people":
        inputs.take_people(messages.read_pose_array(message), now)
    elif name == "people_markers":
        inputs.take_people(messages.read_markers(message), now)
    elif name == "goal":
        inputs.take_goal(messages.read_goal(message))
    else:
        inputs.take_map(messages.read_map(message))


def _time_of(item: Recorded) -> float:
    """The stamp where there is one, else when it was recorded."""
    header = getattr(item.message, "header", None)
    stamp = 0.0 if header is None else messages.seconds_of(header.stamp)
    if header is None and getattr(item.message, "markers", None):
        stamp = max(messages.seconds_of(marker.header.stamp) for marker in item.message.markers)
    return stamp if stamp > 0 else item.time


def _at_rest(now: float) -> Odometry:
    return Odometry(time=now, frame="", pose=Pose2(), velocity=np.zeros(2), turn_rate=0.0)
