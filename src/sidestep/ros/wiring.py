"""What a node listens to, and what it does with each message. The same for ROS 1 and ROS 2."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from sidestep.ros import messages
from sidestep.ros.core import Core
from sidestep.ros.inputs import Inputs
from sidestep.ros.settings import NodeSettings

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class Subscription:
    """One topic.

    Attributes:
        topic: relative name.
        type: such as "nav_msgs/Odometry".
        take: called with each message; never raises.
        kind: "stream": only the latest counts, and it may be lost; "order": must arrive; "latched": the last one is
            given to late comers.
    """

    topic: str
    type: str
    take: Callable[[Any], None]
    kind: str = "stream"


def subscriptions(
    settings: NodeSettings, *, core: Core, inputs: Inputs, clock: Callable[[], float]
) -> list[Subscription]:
    """Return everything that a node with these settings listens to."""
    node = settings.node

    def odometry(message: Any) -> None:
        inputs.take_odometry(messages.read_odometry(message), clock())

    def scan(message: Any) -> None:
        inputs.take_scan(messages.read_scan(message), clock())

    def poses(message: Any) -> None:
        inputs.take_people(messages.read_pose_array(message), clock())

    def markers(message: Any) -> None:
        inputs.take_people(messages.read_markers(message), clock())

    def goal(message: Any) -> None:
        inputs.take_goal(messages.read_goal(message))

    def grid(message: Any) -> None:
        inputs.take_map(messages.read_map(message, unknown_is_free=node.unknown_is_free))

    def enable(message: Any) -> None:
        core.hold("enable", "" if message.data else "switched off by topic 'enable'")

    eyes = {
        "scan": Subscription(topic="scan", type="sensor_msgs/LaserScan", take=scan),
        "poses": Subscription(topic="people", type="geometry_msgs/PoseArray", take=poses),
        "markers": Subscription(topic="people_markers", type="visualization_msgs/MarkerArray", take=markers),
    }
    every = [
        Subscription(topic="odom", type="nav_msgs/Odometry", take=odometry),
        eyes[node.people_from],
        Subscription(topic="goal", type="geometry_msgs/PoseStamped", take=goal, kind="order"),
        Subscription(topic="map", type="nav_msgs/OccupancyGrid", take=grid, kind="latched"),
        Subscription(topic="enable", type="std_msgs/Bool", take=enable, kind="order"),
    ]
    return [Subscription(topic=s.topic, type=s.type, kind=s.kind, take=_guarded(s.topic, s.take)) for s in every]


def _guarded(topic: str, take: Callable[[Any], None]) -> Callable[[Any], None]:
    """Let nothing that arrives end the thread it arrives on; what is not taken is missed by the watchdogs."""

    def guarded(message: Any) -> None:
        try:
            take(message)
        except Exception:
            _LOG.exception("a message on %s could not be used", topic)

    return guarded
