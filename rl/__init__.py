"""Learning to steer: observations, rewards, networks, the curriculum and policies that survive without it.

In: environments that satisfy ``environment.py``. Out: a ``Policy``. This package knows no world and no robot.
"""
