"""Signs of the sides by the gyro, and that of the accelerations."""

import numpy as np
import pytest

from andabata.records.decoding.wheel_signs import is_force_negated, mirrored_side
from andabata.records.decoding.yaw_increments import YawIncrements

RNG = np.random.default_rng(0)
TURN, DRIVE = RNG.normal(0, 0.2, 40), np.full(40, 1.0) + RNG.normal(0, 0.1, 40)


def judged(signs, gyro=TURN):
    """Return the side that is judged mirrored, of wheels that drive and turn."""
    left, right = signs[0] * (DRIVE - TURN) / 2, signs[1] * (DRIVE + TURN) / 2
    turns, mirrored = (YawIncrements(gyro, 0 * gyro, r - left) for r in (right, -right))
    return mirrored_side(turns, mirrored, np.column_stack([0 * left, left, right]))


@pytest.mark.parametrize(
    ("signs", "side"), [((1, 1), None), ((-1, -1), None), ((-1, 1), 0), ((1, -1), 1)]
)
def test_a_side_that_turns_backwards_is_found_by_the_gyro(signs, side):
    """A whole robot that counts backwards has no mirrored side."""
    assert judged(signs) == side


@pytest.mark.parametrize(("signs", "side"), [((1, 1), None), ((-1, 1), 0), ((1, -1), 1)])
def test_without_turns_most_driving_is_ahead(signs, side):
    """A gyro that sees no turn makes wheels that report one mirrored."""
    assert judged(signs, 1e-3 * TURN) == side


def test_turns_that_the_gyro_sees_are_turns():
    """A robot that turns on the spot has no mirrored side."""
    spin = YawIncrements(0.8 * TURN, 0 * TURN, TURN)
    still = YawIncrements(0.8 * TURN, 0 * TURN, 0.1 * DRIVE)
    assert mirrored_side(spin, still, np.zeros((40, 3))) is None


@pytest.mark.parametrize(
    ("slope", "up", "expected"), [(-0.8, -9.8, True), (0.8, -9.8, False), (-0.8, 9.8, False)]
)
def test_gravity_that_makes_the_gyro_turn_against_the_wheels_is_negated(slope, up, expected):
    """An IMU that hangs upside down turns with them."""
    assert is_force_negated(slope, np.tile([0.1, 0, up], (9, 1))) is expected
    assert not is_force_negated(None, np.tile([0.1, 0, up], (9, 1)))
