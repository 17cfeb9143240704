"""The ground and what stands on it.

In: a configuration, a difficulty and a random generator. Out: a ``Heightfield`` and ``SceneObject``
    meshes,
each with a semantic class. Read ``heightfield.py`` first.
"""
