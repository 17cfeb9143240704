"""Hills: what looks too steep from afar is dear where nobody has been near."""

import math

import numpy as np
import pytest

from andabata.machine.robot import RobotModel
from andabata.navigation.evidence import Evidence
from andabata.navigation.hills import Hills, HillsConfig
from andabata.navigation.local_map import LocalMapConfig
from andabata.navigation.local_plan import EVERYWHERE, LocalPlan, Prices
from andabata.navigation.view import Recent
from traversability.cloud import PointCloud
from traversability.grid import PolarGrid

CELL = 0.2
ORIGIN = np.zeros(2)


def ground(height, around=ORIGIN, far=20.0, count=20_000):
    """Return points of ground of a height [m] by x and y, as far as that."""
    xy = (np.random.default_rng(1).uniform(-far, far, (count, 2)) + around).astype(np.float32)
    return np.column_stack([xy, height(xy[:, 0], xy[:, 1])]).astype(np.float32)


def plane(degrees, towards):
    gx, gy = math.tan(math.radians(degrees)) * np.array([math.cos(towards), math.sin(towards)])
    return lambda x, y: gx * x + gy * y


def steep(hills, x, y):
    """Return whether the patch of a place is too steep."""
    n = len(hills.steep)
    return bool(hills.steep[math.floor(x) & (n - 1), math.floor(y) & (n - 1)])


def seen(*clouds, here=ORIGIN):
    hills = Hills(CELL, HillsConfig())
    for points in clouds:
        hills.take(points, here)
    return hills


@pytest.mark.parametrize("towards", [0.0, 0.8, 2.4, -1.3])
def test_a_plane_is_as_steep_whichever_way_it_falls(towards):
    places = [(15.0, 3.0), (-12.0, -9.0), (0.5, 11.0)]
    for degrees, expected in ((0.0, False), (15.0, False), (26.0, True)):
        hills = seen(ground(plane(degrees, towards)))
        assert [steep(hills, *place) for place in places] == [expected] * 3, degrees


def test_a_hillside_is_where_it_is_and_nowhere_else():
    hills = seen(ground(lambda x, y: 0.5 * np.clip(x - 10.0, 0.0, 6.0)))
    along = [steep(hills, x + 0.5, 2.5) for x in range(6, 19)]
    # The patches at its foot and on its brow are half as steep.
    assert along == [False] * 5 + [True] * 5 + [False] * 3


def test_trunks_and_crowns_are_no_hills():
    rng = np.random.default_rng(0)
    trunks, heights = rng.uniform(-20.0, 20.0, (400, 2)), rng.uniform(1.5, 4.0, 400)
    crowns = np.column_stack([trunks, heights]).astype(np.float32)
    assert not seen(np.concatenate([ground(plane(5.0, 0.3)), crowns])).steep.any()


def test_what_is_near_or_no_number_tells_nothing():
    near = ground(plane(40.0, 0.0), far=3.0)
    wild = np.full((10, 3), np.nan, dtype=np.float32)
    hills = seen(near, np.array([[9.0, 9.0, np.inf]], dtype=np.float32), wild)
    assert not hills.steep.any()
    assert not seen(np.zeros((0, 3), dtype=np.float32)).steep.any()


def test_it_goes_with_the_robot_and_forgets_what_is_left_behind():
    hills = seen(ground(plane(26.0, 0.0)))
    assert steep(hills, 15.0, 0.0)
    there = np.array([30.0, 0.0])
    hills.take(ground(plane(0.0, 0.0), around=there, far=2.0), there)
    assert steep(hills, 15.0, 0.0)
    assert not steep(hills, -15.0, 0.0)
    assert not steep(hills, -15.0 + 64.0, 0.0)  # It wraps around.
    hills.reset()
    assert not hills.steep.any()


def test_heights_that_drift_from_cloud_to_cloud_make_no_hill():
    level = ground(plane(0.0, 0.0))
    hills = Hills(CELL, HillsConfig())
    halves = level[level[:, 0] > 0], level[level[:, 0] < 0]
    for k in range(200):
        drifted = halves[k % 2] + np.array([0.0, 0.0, 0.02 * k], dtype=np.float32)
        hills.take(drifted, ORIGIN)
        assert not hills.steep.any()


def test_a_metre_of_it_is_dear_until_somebody_has_been_near():
    config = LocalMapConfig()
    prices = Prices(**{name: getattr(config, name) for name in Prices._fields})
    plan = LocalPlan(128, CELL, prices, spans=(1.5, 5.0), around=8.0, passage=(0.4, 0.25, 0.7))
    hills = seen(ground(lambda x, y: 0.5 * np.clip(x - 4.0, 0.0, 6.0)))
    evidence = np.zeros((128, 128), dtype=np.float32)
    evidence[:, 30:] = -1.0  # Beside y = 6 m squares have seen the ground.
    centre, goal = np.zeros(2, dtype=np.int64), np.array([12.0, 1.0])
    plan.make(evidence, centre, EVERYWHERE, ORIGIN, goal, hills.side)
    cells = [
        tuple(np.floor((np.array(p) - plan.corner) / CELL).astype(int))
        for p in ((8.5, 1.0), (1.0, 1.0), (8.5, 8.0))
    ]
    unseen = 1.0 + prices.unseen
    assert [float(plan.costs[cell]) for cell in cells] == [unseen + prices.steep, unseen, 1.0]
    assert prices.most >= unseen + prices.steep


def test_a_map_takes_hills_from_what_was_measured_last():
    evidence = Evidence(PolarGrid(), LocalMapConfig(), RobotModel())
    points = ground(plane(26.0, 0.0))
    stamps = np.linspace(0.0, 1.0, len(points))
    evidence.look_down(Recent((PointCloud(points, "odom", stamps),), 1.0), ORIGIN)
    assert steep(evidence.hills, 15.0, 3.0)
    evidence.reset()
    assert not evidence.hills.steep.any()
