"""ROS 2 (ament_python). The node itself is the Python package sidestep; here is only what ROS wants to find by name."""

from glob import glob

from setuptools import setup

NAME = "sidestep_ros"

setup(
    name=NAME,
    version="0.1.0",
    packages=[],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        *((f"share/{NAME}/{folder}", glob(f"{folder}/*")) for folder in ("launch", "rviz", "config")),
    ],
    entry_points={"console_scripts": ["sidestep_node = sidestep.ros.ros2:main"]},
)
