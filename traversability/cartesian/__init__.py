"""Cartesian grids around the robot: rolling grid, elevation grid, and the ground classifier."""
