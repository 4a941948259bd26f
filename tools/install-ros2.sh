#!/usr/bin/env bash
# ROS 2 (Jazzy) from its wheels, in an environment of its own: .venv-ros2. No root and no apt needed.
# Its .pth re-executes the interpreter, so it must not be mixed into .venv.
set -euo pipefail
cd "$(dirname "$0")/.."
python=${PYTHON:-$(command -v python3.11 || command -v python3)}
[ -x .venv-ros2/bin/python ] || "$python" -m venv .venv-ros2
[ -x .venv-ros2/bin/uv ] || .venv-ros2/bin/python -m pip install --quiet "uv>=0.5"
.venv-ros2/bin/uv pip install --quiet --python .venv-ros2/bin/python -r requirements/run.txt
.venv-ros2/bin/uv pip install --quiet --python .venv-ros2/bin/python \
    ros-jazzy-rclpy ros-jazzy-rmw-fastrtps-cpp ros-jazzy-geometry-msgs ros-jazzy-sensor-msgs ros-jazzy-nav-msgs ros-jazzy-visualization-msgs
.venv-ros2/bin/uv pip install --quiet --python .venv-ros2/bin/python --no-deps --no-build-isolation --editable .
echo "ROS 2: ready in .venv-ros2"
