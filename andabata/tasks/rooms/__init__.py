"""Drives to a goal in rooms by a planar laser: batch simulator, environment and tasks.

``env.py`` is the environment of every such task; ``spn.py`` and ``td3.py`` give it values of their
own, and ``catalogue.py`` names them.
"""
