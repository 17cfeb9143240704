"""Clock: ticks, control period, and stamps that survive nanoseconds."""

from andabata.machine.clock import CONTROL_PERIOD, TICK, TICK_HZ, TICKS_PER_STEP


def test_the_control_period_is_the_papers():
    """Ten ticks of 10 ms make the paper's 0.1 s, exactly."""
    assert TICK == 0.01
    assert CONTROL_PERIOD == 0.1
    assert TICKS_PER_STEP / TICK_HZ == CONTROL_PERIOD


def test_stamps_survive_whole_nanoseconds():
    """A quotient of whole numbers returns unchanged from whole nanoseconds, a product may not."""
    stamps = [tick / TICK_HZ for tick in range(100_000)]
    assert all(round(stamp * 1e9) / 1e9 == stamp for stamp in stamps)
    assert any(tick * TICK != tick / TICK_HZ for tick in range(100))
