"""Navigators on flat ground: laser and odometry in, speed and yaw rate out, without a map.

Each is a ``PlanarNavigator``; ``catalogue.py`` names them all.
"""
