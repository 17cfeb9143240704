"""Nodes of a live ROS 1 graph: ``navigator_node`` steers, ``robot_node`` simulates a robot."""
