#!/usr/bin/env bash
# Make a virtual environment with ROS 2's own Python client, a peer of the live graph's tests.
# Importing it starts Python anew, so it has to stay out of every other environment.
# Usage: .ci/rclpy.sh PYTHON VENV
set -euo pipefail
python=$1
venv=$2

command -v "$python" >/dev/null || python=python3
[ -x "$venv/bin/python" ] || "$python" -m venv "$venv"
echo "installing rclpy with Fast DDS into $venv (266 MB)"
"$venv/bin/python" -m pip install --quiet 'ros-rclpy[fastrtps]' ros-sensor-msgs ros-nav-msgs
"$venv/bin/python" -c 'import rclpy, sensor_msgs.msg'
