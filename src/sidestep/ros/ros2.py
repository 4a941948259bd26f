"""The node for ROS 2: `python -m sidestep.ros.ros2`; parameters: docs/start/ros.md. Thin: topics, tf, time."""

from __future__ import annotations

import array
import signal
import sys
import threading
from collections.abc import Callable, Mapping
from types import FrameType
from typing import Any

import numpy as np

from sidestep.errors import InvalidInput
from sidestep.ros.assembly import assemble
from sidestep.ros.frames import no_lookup
from sidestep.ros.geometry import Pose2
from sidestep.ros.messages import read_transform
from sidestep.ros.packages import PackagedMessages, message_class
from sidestep.ros.publisher import TOPICS
from sidestep.ros.settings import NodeSettings

_NOT_OURS = ("use_sim_time", "qos_overrides", "start_type_description_service")


class Ros2Maker(PackagedMessages):
    """Makes ROS 2 messages."""

    def stamp(self, seconds: float) -> Any:
        """Return a builtin_interfaces/Time."""
        whole = round(seconds * 1e9)
        return self("builtin_interfaces/Time", sec=whole // 10**9, nanosec=whole % 10**9)

    def duration(self, seconds: float) -> Any:
        """Return a builtin_interfaces/Duration."""
        whole = round(seconds * 1e9)
        return self("builtin_interfaces/Duration", sec=whole // 10**9, nanosec=whole % 10**9)

    def numbers(self, kind: str, values: Any) -> Any:
        """Return an array of the machine's own numbers; sequences of fixed length want numpy."""
        found = np.asarray(values, dtype=kind)
        return found if kind == "float64" else array.array(found.dtype.char, found.tobytes())

    def level(self, value: int) -> Any:
        """Return a byte."""
        return bytes([value])


def nested(flat: Mapping[str, Any]) -> dict[str, Any]:
    """Parameters "robot.radius": 0.2 → {"robot": {"radius": 0.2}}; arrays become lists."""
    tree: dict[str, Any] = {}
    for name, value in flat.items():
        *above, last = name.split(".")
        if name.split(".")[0] in _NOT_OURS:
            continue
        place = tree
        for part in above:
            place = place.setdefault(part, {})
        place[last] = value if isinstance(value, str | bytes) or not hasattr(value, "__iter__") else list(value)
    return tree


def main(arguments: list[str] | None = None) -> int:
    """Run until interrupted or terminated; return the exit status (2: a parameter is wrong)."""
    try:
        import rclpy  # pyright: ignore[reportMissingImports]
        from rclpy.node import Node  # pyright: ignore[reportMissingImports]
        from rclpy.signals import SignalHandlerOptions  # pyright: ignore[reportMissingImports]
    except ImportError:
        sys.exit("the ROS 2 node needs a Python that has rclpy; tools/install-ros2.sh makes one (docs/start/ros.md)")
    # Our own handlers: rclpy's would close the topics before the last command, to stand still, is out.
    rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    ending = threading.Event()

    def end(number: int, frame: FrameType | None) -> None:
        del number, frame
        ending.set()

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, end)
    ros = Node("sidestep", automatically_declare_parameters_from_overrides=True)
    try:
        return _run(rclpy, ros, ending)
    finally:
        ros.destroy_node()
        rclpy.shutdown()


def _run(rclpy: Any, ros: Any, ending: threading.Event) -> int:
    from rclpy.duration import Duration  # pyright: ignore[reportMissingImports]

    logger = ros.get_logger()
    try:
        settings = NodeSettings.parse(
            nested({name: p.value for name, p in ros.get_parameters_by_prefix("").items()}), source="parameters"
        )
    except InvalidInput as error:
        logger.fatal(str(error))
        return 2
    publishers = {
        topic: ros.create_publisher(message_class(kind), topic, _quality("latched" if "occup" in topic else "order"))
        for topic, kind in TOPICS.items()
    }

    def send(topic: str, message: Any) -> None:
        publishers[topic].publish(message)

    node = assemble(
        settings,
        make=Ros2Maker(),
        send=send,
        clock=lambda: ros.get_clock().now().nanoseconds * 1e-9,
        lookup=_lookup(ros),
    )
    try:
        node.runner.start()
    except OSError as error:
        logger.fatal(f"node.remote: cannot listen: {error}")
        return 2
    for s in node.subscriptions:
        ros.create_subscription(message_class(s.type), s.topic, s.take, _quality(s.kind))
    logger.info("sidestep listens to " + ", ".join(s.topic for s in node.subscriptions))
    while not ending.is_set():
        rclpy.spin_once(ros, timeout_sec=0.1)
    node.runner.stop()
    publishers["cmd_vel"].wait_for_all_acked(Duration(seconds=1))  # a closed topic forgets what it has not yet sent
    return 0


def _quality(kind: str) -> Any:
    from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy  # pyright: ignore[reportMissingImports]

    return QoSProfile(
        depth=1 if kind == "latched" else 5,
        reliability=ReliabilityPolicy.BEST_EFFORT if kind == "stream" else ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if kind == "latched" else DurabilityPolicy.VOLATILE,
    )


def _lookup(ros: Any) -> Callable[[str, str], Pose2 | None]:
    try:
        import tf2_ros  # pyright: ignore[reportMissingImports]
        from rclpy.time import Time  # pyright: ignore[reportMissingImports]
    except ImportError:
        ros.get_logger().warning("tf2_ros is not installed: frames come from parameters (node.mount, node.same_frames)")
        return no_lookup
    buffer = tf2_ros.Buffer()
    listener = tf2_ros.TransformListener(buffer, ros)

    def lookup(parent: str, child: str, _keep: Any = listener) -> Pose2 | None:
        try:
            return read_transform(buffer.lookup_transform(parent, child, Time()))
        except tf2_ros.TransformException:
            return None

    return lookup


if __name__ == "__main__":
    sys.exit(main())
