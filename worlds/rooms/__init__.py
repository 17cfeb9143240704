"""Rooms in the plane: plans, random and benchmark rooms, moving obstacles, shortest ways.

``room.py`` comes first; ``catalogue.py`` makes rooms by name, from plans in ``plans`` and by seeds.
"""
