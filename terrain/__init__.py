"""Terrain: heightfields and the objects on them, generated from random streams.

In: sizes, densities and a random generator. Out: a ``Heightfield`` and ``SceneObject`` meshes, each
with a semantic class. Read ``heightfield.py`` first.
"""
