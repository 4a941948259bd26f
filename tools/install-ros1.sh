#!/usr/bin/env bash
# ROS 1 as Debian ships it, and .venv-ros1: a virtual environment that sees the system's rospy beside our own packages.
set -euo pipefail
cd "$(dirname "$0")/.."
tools/install_apt.sh "ROS 1" ros-core python3-rospy python3-roslaunch python3-rosbag python3-tf2-ros \
    python3-sensor-msgs python3-geometry-msgs python3-nav-msgs python3-visualization-msgs python3-venv
system=/usr/bin/python3
if ! "$system" -c 'import rospy' 2>/dev/null; then
    echo "ROS 1: skipped, $system has no rospy" >&2
    exit 0
fi
[ -x .venv-ros1/bin/python ] || "$system" -m venv --system-site-packages .venv-ros1
[ -x .venv-ros1/bin/uv ] || .venv-ros1/bin/python -m pip install --quiet "uv>=0.5"
.venv-ros1/bin/uv pip install --quiet --python .venv-ros1/bin/python -r requirements/run.txt
.venv-ros1/bin/uv pip install --quiet --python .venv-ros1/bin/python --no-deps --no-build-isolation --editable .
echo "ROS 1: ready in .venv-ros1"
