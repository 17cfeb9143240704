"""Simulated worlds: ground, objects, starts, goals and the true map of where a robot may drive.

In: a preset's name and a seed. Out: a ``World``, its ``RayScene`` and its bodies (pybullet).
Read ``world.py`` first.
"""
