#!/usr/bin/env bash
# ROS 1 as Debian 12 ships it, and .venv-ros1: a virtual environment over the system's Python that sees its rospy beside
# our own, current numerical libraries. Run again at any time; what is there already is kept.
set -euo pipefail
cd "$(dirname "$0")/.."
tools/install_apt.sh "ROS 1" ros-core python3-rospy python3-roslaunch python3-rosbag python3-tf2-ros python3-tf2-msgs \
    python3-std-msgs python3-geometry-msgs python3-sensor-msgs python3-nav-msgs python3-visualization-msgs \
    python3-diagnostic-msgs python3-venv
system=/usr/bin/python3
if ! "$system" -c 'import rospy' 2>/dev/null; then
    echo "ROS 1: not installed, $system has no rospy (Debian 12 has it as a package; other systems: docs/ros.md)" >&2
    exit 1
fi
[ -x .venv-ros1/bin/python ] || "$system" -m venv --system-site-packages .venv-ros1
[ -x .venv-ros1/bin/uv ] || .venv-ros1/bin/python -m pip install --quiet --disable-pip-version-check "uv>=0.5"
install=(.venv-ros1/bin/uv pip install --quiet --python .venv-ros1/bin/python)
"${install[@]}" -r requirements/run.txt
"${install[@]}" --no-deps --no-build-isolation --editable .
.venv-ros1/bin/python - <<'PYTHON'
import diagnostic_msgs.msg, geometry_msgs.msg, nav_msgs.msg, numba, rospy, sensor_msgs.msg, tf2_ros, visualization_msgs.msg
import sidestep
print(f"ROS 1: ready in .venv-ros1 (numba {numba.__version__})")
PYTHON
