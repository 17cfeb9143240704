"""Ways of drives and the troubles on them."""

import numpy as np

from andabata.datasets.drive_path import DriveLabelsConfig, DrivePath, Trouble, find_troubles
from tests.support.driven_ground import SPEED, period, straight

CONFIG = DriveLabelsConfig()


def troubles(periods, config=CONFIG):
    """Return the troubles of some periods."""
    return find_troubles(DrivePath.of(periods), config)


def test_a_drive_that_follows_its_commands_has_no_trouble():
    """Wheels, estimate and command agree: nothing is found, also in a turn on the spot."""
    assert not troubles(straight(20)).any()
    turn = [period(0.1 * k, 0.0, yaw=0.03 * k, commanded=0.0, wheels=0.0) for k in range(1, 80)]
    assert not troubles(turn).any()


def test_wheels_that_stand_under_a_command_are_a_stop():
    """Still wheels under a command are a stop from its least time on, and only these periods."""

    def halted(k, last):
        still = 50 < k <= last
        return period(0.1 * k, 0.03 * min(k, 50), wheels=0.0 if still else SPEED)

    long, short = ([halted(k, last) for k in range(1, 61)] for last in (61, 58))
    expected = np.zeros(60, dtype=np.uint8)
    assert (troubles(short) == expected).all()
    long += [halted(61, 61)]
    found = troubles(long)
    assert (found[50:] == Trouble.STOPPED).all()
    assert not found[:50].any()


def test_a_robot_that_is_not_told_to_drive_is_not_stopped():
    """Still wheels without a command, with an unknown one or at a standstill are no trouble."""
    for commanded in (0.0, 0.05, np.nan):
        assert not troubles(
            [period(0.1 * k, 0.0, commanded=commanded, wheels=0.0) for k in range(1, 60)]
        ).any()


def test_wheels_that_go_further_than_the_robot_are_slip():
    """Turning wheels of a robot that stays are slip, forward and backward, whatever the command."""
    for speed in (SPEED, -SPEED):
        stuck = straight(20, stop=10.0, commanded=np.nan, wheels=speed)
        found = troubles(stuck)
        assert (found[105:] == Trouble.SLIPPED).all()
        assert not found[:85].any()


def test_errors_of_the_estimate_are_no_slip():
    """An estimate that jumps by half a metre and back, as with the first fixes, is no slip."""
    drive, jump = straight(20), np.array([0.8, 0.0])
    drive[:20] = [each._replace(position=each.position + jump) for each in drive[:20]]
    assert not troubles(drive).any()
    assert not troubles(straight(3, stop=0.0)).any()  # 0.9 m of the wheels: too little to tell.


def test_half_of_the_wheels_way_is_the_limit_of_slip():
    """A robot that makes 60 % of its wheels' way has not slipped; at 40 % it has."""
    for share, slipped in ((0.6, False), (0.4, True)):
        drive = [period(0.1 * k, 0.03 * share * k) for k in range(1, 150)]
        assert (troubles(drive) == Trouble.SLIPPED).any() == slipped


def test_a_body_beyond_the_tilt_is_trouble():
    """Tilt counts from the limit on, nose up or down."""
    limit = CONFIG.max_tilt
    for pitch in (-limit - 0.01, limit + 0.01):
        assert (troubles(straight(3, pitch=pitch)) == Trouble.TILTED).all()
    assert not troubles(straight(3, pitch=limit - 0.01)).any()


def test_the_direction_is_the_commands_or_else_the_wheels():
    """A robot backs up if its command is negative; without a command its wheels decide."""
    drive = [
        period(0.1, 0.0, commanded=-0.3, wheels=0.3),
        period(0.2, 0.0, commanded=np.nan, wheels=-0.3),
        period(0.3, 0.0, commanded=0.3, wheels=-0.3),
        period(0.4, 0.0, commanded=np.nan, wheels=np.nan),
    ]
    assert DrivePath.of(drive).direction.tolist() == [-1, -1, 1, 1]
