"""Learning to steer: observations, rewards, networks, a curriculum and policies.

In: environments that satisfy ``environment.py``. Out: a ``Policy``. This package knows no world and
    no robot.
"""
