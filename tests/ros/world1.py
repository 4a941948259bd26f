"""The small world as a ROS 1 node."""

import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped
from world import HEARD, SAID, World

from sidestep.ros import outgoing
from sidestep.ros.ros1 import Ros1Maker, message_class

rospy.init_node("world", disable_signals=True)
make = Ros1Maker(rospy)
publishers = {
    topic: rospy.Publisher(topic, message_class(kind), queue_size=10, latch=topic in ("goal", "map", "enable"))
    for topic, kind in SAID.items()
}
tf = tf2_ros.TransformBroadcaster() if rospy.get_param("~tf", False) else None


def broadcast(parent, child, pose):
    stamped = outgoing.transform(make, parent, child, rospy.get_time(), pose).transforms[0]
    assert isinstance(stamped, TransformStamped)
    tf.sendTransform(stamped)


world = World(make, lambda topic, m: publishers[topic].publish(m), rospy.get_time, broadcast if tf else None)
kept = [
    rospy.Subscriber(topic, message_class(kind), lambda m, topic=topic: world.listen(topic, m), queue_size=10)
    for topic, kind in HEARD.items()
]
world.run(lambda: not rospy.is_shutdown())
