"""The window of ground around a robot: it follows, and its surface is the ground's."""

import pytest

from tests.support.plants import module_needs_bullet

module_needs_bullet()

from andabata.machine.bullet_ground import GroundWindow
from worlds.quiet_pybullet import pybullet


@pytest.fixture
def client():
    """Return a physics client."""
    number = pybullet.connect(pybullet.DIRECT)
    yield number
    pybullet.disconnect(number)


def height(client, x, y):
    """Return the height of the first contact from above [m], None without any."""
    ((body, _, _, place, _),) = pybullet.rayTest([x, y, 90], [x, y, -90], physicsClientId=client)
    return None if body < 0 else place[2]


def test_a_window_follows_and_has_the_grounds_heights(make_ground, client):
    """Within 8 m of where it was made there is ground, beyond 16 m none; 4 m on it is made anew."""
    world = make_ground(lambda x, y: 0.3 * x - 0.1 * y, size=60.0, cell=0.5)
    window = GroundWindow(world.ground, client)
    assert not window.follow(3.9, -3.9)
    assert height(client, 5.0, 2.0) == pytest.approx(1.3, abs=1e-3)
    assert height(client, 12.0, 2.0) is None
    assert window.follow(4.2, 0.0)
    assert pybullet.getNumBodies(physicsClientId=client) == 1
    assert height(client, 12.0, 2.0) == pytest.approx(3.4, abs=1e-3)


def test_at_the_border_the_window_ends_with_the_ground(make_ground, client):
    """A robot at the corner stands on ground, and there is none beyond."""
    world = make_ground(lambda x, y: 0.0 * x, size=30.0, cell=0.5)
    window = GroundWindow(world.ground, client)
    assert window.follow(14.0, 14.0)
    assert height(client, 14.9, 14.9) == pytest.approx(0.0, abs=1e-6)
    assert height(client, 15.2, 14.0) is None
    assert window.follow(40.0, 40.0)
