"""Clock of robot and simulation: the tick, the control period, and how they divide each other.

A tick is the period of the fastest sensors (IMU, encoders, magnetometer) and of the recorded true
poses. A control period is a whole number of ticks: the navigator runs once in it.

Stamps are computed as ``tick / TICK_HZ``, never summed up and never multiplied by ``TICK``: a
quotient of whole numbers is the float64 nearest to the true time, so that stamps do not drift and
survive a message's whole nanoseconds unchanged.
"""

TICK_HZ = 100
"""Number of ticks per second [Hz]."""

TICK = 1 / TICK_HZ
"""Period of a tick [s]."""

TICKS_PER_STEP = 10
"""Number of ticks in a control period."""

CONTROL_PERIOD = TICKS_PER_STEP / TICK_HZ
"""Control period [s] (paper: 0.1 s)."""
