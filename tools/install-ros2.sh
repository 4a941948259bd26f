#!/usr/bin/env bash
# ROS 2 (Jazzy) from its wheels, in an environment of its own: .venv-ros2. No root and no apt needed.
# Its .pth re-executes the interpreter to set library paths, so it must not be mixed into .venv.
# Run again at any time; what is there already is kept. A full ROS 2 installation serves as well (docs/ros.md).
set -euo pipefail
cd "$(dirname "$0")/.."
python=${PYTHON:-$(command -v python3.11 || command -v python3)}
[ -x .venv-ros2/bin/python ] || "$python" -m venv .venv-ros2
[ -x .venv-ros2/bin/uv ] || .venv-ros2/bin/python -m pip install --quiet --disable-pip-version-check "uv>=0.5"
install=(.venv-ros2/bin/uv pip install --quiet --python .venv-ros2/bin/python)
"${install[@]}" -r requirements/run.txt
"${install[@]}" ros-jazzy-rclpy ros-jazzy-rmw-fastrtps-cpp ros-jazzy-geometry-msgs ros-jazzy-sensor-msgs \
    ros-jazzy-nav-msgs ros-jazzy-visualization-msgs ros-jazzy-diagnostic-msgs
"${install[@]}" --no-deps --no-build-isolation --editable .
ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST .venv-ros2/bin/python - <<'PYTHON'
import diagnostic_msgs.msg, geometry_msgs.msg, nav_msgs.msg, numba, rclpy, sensor_msgs.msg, visualization_msgs.msg
import sidestep
rclpy.init()
rclpy.shutdown()
print(f"ROS 2: ready in .venv-ros2 (numba {numba.__version__})")
PYTHON
