"""Nodes of a live graph of ROS 1 or 2: ``navigator_node`` steers, ``robot_node`` simulates."""
