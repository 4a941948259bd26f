"""ros2 launch sidestep_ros sidestep.launch.py robot:=turtlebot3 [cmd_vel:=…] [scan:=…] [rviz:=true]."""

from pathlib import Path

import yaml
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch_ros.actions import Node

SHARE = Path(__file__).resolve().parents[1]
TOPICS = ("scan", "odom", "cmd_vel", "goal", "map", "people", "people_markers")


def nodes(context):
    """Return the nodes, once the arguments are known."""

    def chosen(name):
        return context.launch_configurations[name]

    file = Path(chosen("parameters") or SHARE / "config" / f"{chosen('robot')}.yaml")
    node = Node(
        package="sidestep_ros",
        executable="sidestep_node",
        name="sidestep",
        namespace=chosen("ns"),
        output="screen",
        parameters=[yaml.safe_load(file.read_text())],
        remappings=[(name, chosen(name)) for name in TOPICS if chosen(name) != name],
    )
    view = Node(package="rviz2", executable="rviz2", arguments=["-d", str(SHARE / "rviz" / "ros2.rviz")])
    return [node, view] if chosen("rviz") == "true" else [node]


def generate_launch_description():
    """Return what `ros2 launch` asks for."""
    arguments = {
        "robot": ("turtlebot3", "a file in config/, without .yaml"),
        "parameters": ("", "a parameter file of your own, instead of robot"),
        "ns": ("", "namespace of the robot's topics"),
        "rviz": ("false", "open a view"),
        **{name: (name, "topic") for name in TOPICS},
    }
    declared = [DeclareLaunchArgument(n, default_value=d, description=text) for n, (d, text) in arguments.items()]
    return LaunchDescription([*declared, OpaqueFunction(function=nodes)])
