"""Robots on flat ground: dynamics, planar lasers, outlines and contacts.

``vehicle.py`` comes first; tasks and evaluations in rooms drive it.
"""
