"""Scenes to drive in: ground, objects, starts, goals and the truth about where a robot may go.

In: a preset's name and a seed. Out: a ``World``, its ray scene (Embree) and its bodies (pybullet).
Read ``world.py`` first.
"""
