"""Clock of the simulation: period of its ticks, and of the control steps that they make up."""

TICK_HZ = 100
"""Poses of the true track a second."""


TICK = 1 / TICK_HZ
"""Time between two poses of the true track [s]; the fastest senses run at this period."""


TICKS_PER_STEP = 10
"""Ticks of one control period (paper: 0.1 s)."""
