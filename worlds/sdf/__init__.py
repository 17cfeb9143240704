"""Worlds of Gazebo: SDF files read into rooms and worlds of terrain.

``world.py`` reads what collides, ``room.py`` and ``ground.py`` make rooms and worlds of it, and
``barn.py`` reads the folders of the BARN benchmark.
"""
