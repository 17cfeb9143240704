"""The robot's nodes on a live ROS 1 graph. Read ``nodes.py`` first."""
