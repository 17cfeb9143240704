"""Mountings that the user gives by options."""

import pytest

from andabata.app.mountings import laser_mounting, read_mountings
from andabata.app.usage import UsageError
from tests.edited_bags import turn


@pytest.mark.parametrize("pitch", [90, -90])
def test_a_pitch_of_90_degrees_keeps_its_rotation(pitch):
    """Upright mountings, whose angles are not unique, keep their rotation."""
    given = read_mountings([f"laser=0.1,0.2,0.3,30,{pitch},40"])
    found = laser_mounting(given, 0.72)
    apart = found.rotation.inv() * turn((30, pitch, 40))
    assert apart.magnitude() == pytest.approx(0, abs=1e-6)
    assert (found.x, found.y, found.z) == (0.1, 0.2, 0.3)


def test_angles_over_half_a_turn_are_wrapped():
    """270 degrees are -90; over 360 is an error."""
    (given,) = read_mountings(["0,0,0,0,270"]).values()
    assert given.z is None
    assert given.rotation.as_euler("ZYX", degrees=True)[0] == pytest.approx(-90)
    with pytest.raises(UsageError, match="yaw within 360 degrees, got 400"):
        read_mountings(["0,0,0,0,400"])
