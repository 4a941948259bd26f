"""The node for ROS 1: `python -m sidestep.ros.ros1`; parameters: docs/start/ros.md. Thin: topics, tf, time."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import numpy as np

from sidestep.errors import InvalidInput
from sidestep.ros.assembly import assemble
from sidestep.ros.geometry import Pose2
from sidestep.ros.messages import read_transform
from sidestep.ros.packages import PackagedMessages, message_class
from sidestep.ros.publisher import TOPICS
from sidestep.ros.settings import NodeSettings


class Ros1Maker(PackagedMessages):
    """Makes ROS 1 messages."""

    def __init__(self, rospy: Any) -> None:
        super().__init__()
        self._rospy = rospy

    def stamp(self, seconds: float) -> Any:
        """Return a rospy.Time."""
        return self._rospy.Time.from_sec(seconds)

    def duration(self, seconds: float) -> Any:
        """Return a rospy.Duration."""
        return self._rospy.Duration.from_sec(seconds)

    def numbers(self, kind: str, values: Any) -> Any:
        """Return a list."""
        return np.asarray(values, dtype=kind).tolist()

    def level(self, value: int) -> Any:
        """Return a byte, which is a number here."""
        return value


def main(arguments: list[str] | None = None) -> int:
    """Run until ROS shuts the node down; return the exit status (2: a parameter is wrong)."""
    try:
        import rospy  # pyright: ignore[reportMissingImports]
    except ImportError:
        sys.exit("the ROS 1 node needs a Python that has rospy; tools/install-ros1.sh makes one (docs/start/ros.md)")
    rospy.init_node("sidestep", argv=sys.argv if arguments is None else ["sidestep", *arguments])
    try:
        settings = NodeSettings.parse(rospy.get_param("~", {}))
    except InvalidInput as error:
        rospy.logfatal(str(error))
        return 2
    make = Ros1Maker(rospy)
    publishers = {
        topic: rospy.Publisher(topic, message_class(kind), queue_size=1, latch=topic == "predicted_occupancy")
        for topic, kind in TOPICS.items()
    }

    def send(topic: str, message: Any) -> None:
        publishers[topic].publish(message)

    node = assemble(
        settings,
        make=make,
        send=send,
        clock=lambda: float(rospy.get_time()),
        lookup=_lookup(rospy),
    )
    try:
        node.runner.start()
    except OSError as error:
        rospy.logfatal(f"node.remote: cannot listen: {error}")
        return 2
    rospy.on_shutdown(node.runner.stop)
    kept = [rospy.Subscriber(s.topic, message_class(s.type), s.take, queue_size=1) for s in node.subscriptions]
    rospy.loginfo("sidestep listens to %s", ", ".join(s.resolved_name for s in kept))
    rospy.spin()
    return 0


def _lookup(rospy: Any) -> Callable[[str, str], Pose2 | None]:
    import tf2_ros  # pyright: ignore[reportMissingImports]

    buffer = tf2_ros.Buffer()
    listener = tf2_ros.TransformListener(buffer)

    def lookup(parent: str, child: str, _keep: Any = listener) -> Pose2 | None:
        try:
            return read_transform(buffer.lookup_transform(parent, child, rospy.Time(0)))
        except tf2_ros.TransformException:
            return None

    return lookup


if __name__ == "__main__":
    sys.exit(main())
