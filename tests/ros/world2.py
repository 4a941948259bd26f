"""The small world as a ROS 2 node."""

import threading

import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from world import HEARD, SAID, World

from sidestep.ros.ros2 import Ros2Maker, message_class

rclpy.init()
node = Node("world")
sensor = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
plain = QoSProfile(depth=10)
quality = {"odom": plain, "scan": sensor, "map": latched, "goal": latched, "enable": latched}
publishers = {
    topic: node.create_publisher(message_class(kind), topic, quality.get(topic, plain)) for topic, kind in SAID.items()
}
world = World(
    Ros2Maker(),
    lambda topic, m: publishers[topic].publish(m),
    lambda: node.get_clock().now().nanoseconds * 1e-9,
)
for topic, kind in HEARD.items():
    node.create_subscription(message_class(kind), topic, lambda m, topic=topic: world.listen(topic, m), plain)
threading.Thread(target=lambda: rclpy.spin(node), daemon=True).start()
world.run(rclpy.ok)
