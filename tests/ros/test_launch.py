"""What an owner starts: launch files, tf, and recordings read by ROS's own tools."""

from __future__ import annotations

import json
import math
import runpy
import subprocess
import sys
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from stack import BASE, PROJECT, Stack, merged, message, moving

from sidestep.io.recordings import RecordingWriter
from sidestep.ros import outgoing
from sidestep.ros.geometry import Pose2


@pytest.fixture(scope="module")
def stack(tmp_path_factory):
    with Stack(1, tmp_path_factory.mktemp("launch")) as up:
        up.environment["ROS_PACKAGE_PATH"] = f"{PROJECT / 'ros'}:/usr/share"
        up.start_world(tf=True)
        yield up


def test_roslaunch_starts_a_node_that_drives_to_a_goal_on_the_map_by_tf(stack):
    settings = merged(BASE, {"node": {"frame": "map", "base_frame": "base_link"}})
    file = stack.folder / "robot.yaml"
    file.write_text(json.dumps(settings))
    stack.order(do="origin", pose=[10.0, 0.0, math.pi / 2])  # the odometry's x axis is the map's y axis
    stack.order(do="reset", eyes="people")
    stack.node = stack._start(["roslaunch", "sidestep_ros", "sidestep.launch", f"parameters:={file}"], "roslaunch")
    stack.until(lambda told: "no goal" in message(told), "the node does not get ready")
    stack.order(do="goal", at=[10.0, 3.0], frame="map")
    stack.until(moving, "it does not set off")
    told = stack.until(lambda told: message(told).startswith("arrived"), "it does not arrive")
    assert math.dist(told["pose"][:2], (3.0, 0.0)) < 0.6
    assert told["plan"]["frame"] == "map"


@pytest.mark.parametrize("name", ["turtlebot3", "locobot"])
def test_the_shipped_parameters_are_taken(stack, name):
    said = stack.run("roslaunch", "--dump-params", "sidestep_ros", "sidestep.launch", f"robot:={name}")
    assert said.returncode == 0, said.stderr
    code = (
        "import sys, yaml; from sidestep.ros.settings import NodeSettings as N;"
        "tree = {}\n"
        "for key, value in yaml.safe_load(sys.stdin).items():\n"
        "    *above, last = key.split('/')[2:]\n"
        "    place = tree\n"
        "    for part in above: place = place.setdefault(part, {})\n"
        "    place[last] = value\n"
        "print(N.parse(tree).robot.kind)"
    )
    read = subprocess.run(
        [stack.python, "-c", code], input=said.stdout, env=stack.environment, capture_output=True, text=True
    )
    assert read.stdout.strip() == "differential", read.stderr


def test_our_bags_are_read_by_rosbag(stack, tmp_path):
    path = tmp_path / "run.bag"
    with RecordingWriter(path) as recording:
        for k in range(10):
            time = 1000.0 + 0.1 * k
            place, velocity = Pose2(0.1 * k), np.array([1.0, 0.0])
            robot = outgoing.odometry(recording.make, "odom", "base_link", time, place, velocity, 0.0)
            recording.write("/odom", "nav_msgs/Odometry", time, robot)
    code = (
        "import sys, rosbag\n"
        "bag = rosbag.Bag(sys.argv[1])\n"
        "found = [(m.header.stamp.to_sec(), m.pose.pose.position.x) for _, m, _ in bag.read_messages('/odom')]\n"
        "print(len(found), round(found[-1][0], 1), round(found[-1][1], 1))"
    )
    said = stack.run("/usr/bin/python3", "-c", code, str(path))
    assert said.stdout.split() == ["10", "1000.9", "0.9"], said.stderr


def test_the_ros2_launch_file_asks_for_the_right_things(monkeypatch):
    """The wheels bring no `launch`: what the file asks of it is recorded by stand-ins."""
    made = []
    launch, actions = ModuleType("launch"), ModuleType("launch.actions")
    ros, ros_actions = ModuleType("launch_ros"), ModuleType("launch_ros.actions")
    yaml = ModuleType("yaml")
    yaml.safe_load = lambda text: {"text": text}
    launch.LaunchDescription = list
    actions.DeclareLaunchArgument = lambda name, default_value, description: (name, default_value)
    actions.OpaqueFunction = lambda function: function
    ros_actions.Node = lambda **asked: made.append(asked) or asked
    for module in (launch, actions, ros, ros_actions, yaml):
        monkeypatch.setitem(sys.modules, module.__name__, module)
    described = runpy.run_path(str(PROJECT / "ros" / "launch" / "sidestep.launch.py"))["generate_launch_description"]()
    *arguments, function = described
    chosen = dict(arguments) | {"cmd_vel": "base/cmd_vel", "rviz": "true", "robot": "locobot"}
    function(SimpleNamespace(launch_configurations=chosen))
    node, view = made
    assert (node["package"], node["executable"]) == ("sidestep_ros", "sidestep_node")
    assert node["remappings"] == [("cmd_vel", "base/cmd_vel")]
    assert "0.177" in node["parameters"][0]["text"]
    assert view["arguments"][1].endswith("rviz/ros2.rviz")
