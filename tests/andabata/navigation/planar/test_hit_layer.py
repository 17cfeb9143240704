"""Hit layer: known log odds of hits and misses, and what neither order nor grazing beams change."""

import numpy as np
import pytest

from andabata.navigation.planar.hit_layer import HitLayer, HitLayerConfig, LaserPose

FAR = 5.0
HERE = LaserPose()


def make(**settings):
    """Return an empty layer."""
    return HitLayer(HitLayerConfig(**{"cells": 128, **settings}))


def scanned(layer, beams, times=1, laser=HERE):
    """Return what a layer finds new in the last of some equal scans of (bearing, range) beams."""
    bearings, ranges = np.array(beams, dtype=float).reshape(-1, 2).T
    for _ in range(times):
        layer.follow(np.array(laser[:2]))
        found = layer.update(laser, bearings, ranges, FAR)
    return found


def at(layer, x, y):
    """Return the log odds at a place [m]."""
    i, j = np.floor(np.array([x, y]) / layer.config.cell).astype(int)
    return float(layer.log_odds[i % layer.config.cells, j % layer.config.cells])


def test_a_hit_adds_its_log_odds_up_to_the_largest():
    """One scan adds 1, and more than two add nothing."""
    layer = make()
    for expected in (1.0, 2.0, 2.0):
        scanned(layer, [(0.0, 1.23)])
        assert at(layer, 1.23, 0.0) == expected
    assert np.count_nonzero(layer.log_odds) == 1


def test_many_hits_of_a_scan_in_a_cell_count_once_and_the_nearest_stays():
    """A near cell is not surer because more beams meet it."""
    layer = make()
    scanned(layer, [(0.001, 1.27), (0.002, 1.24), (0.003, 1.29)])
    assert at(layer, 1.25, 0.0) == 1.0
    expected = [[1.24 * np.cos(0.002), 1.24 * np.sin(0.002)]]
    np.testing.assert_allclose(layer.obstacles, expected, atol=1e-6)


def test_a_beam_through_a_hit_takes_its_log_odds_down_to_none():
    """Two hits are gone after four misses, and no ground becomes freer than free."""
    layer = make()
    scanned(layer, [(0.0, 1.23)], 2)
    for expected in (1.5, 1.0, 0.5, 0.0, 0.0):
        scanned(layer, [(0.0, FAR)])
        assert at(layer, 1.23, 0.0) == expected
    assert layer.log_odds.min() == 0.0


@pytest.mark.parametrize(
    "beam",
    [
        (0.0, 1.0),  # It ends before the hit.
        (0.0, 2.13),  # It ends behind it, but within the margin.
        (0.0, np.nan),
        (0.0, 0.0),
        (0.0, -1.0),
        (0.02, FAR),  # It passes 4 cm beside it.
        (np.pi, FAR),
    ],
)
def test_other_beams_take_nothing(beam):
    """A hit stays unless a beam goes through it and well on."""
    layer = make()
    scanned(layer, [(0.0, 2.0)])
    scanned(layer, [beam], 20)
    assert at(layer, 2.0, 0.0) == 1.0


def test_a_hit_that_a_laser_cannot_see_behind_stays():
    """No beam reaches the margin behind a hit at the largest range, without an echo neither."""
    layer = make()
    scanned(layer, [(0.0, 4.9)])
    scanned(layer, [(0.0, np.inf)], 20)
    assert at(layer, 4.9, 0.0) == 1.0


@pytest.mark.parametrize("yaw", [0.7, -3.0, 9.0])
def test_hits_are_cleared_from_any_pose(yaw):
    """A beam from elsewhere, by a laser that is turned, goes through the same place."""
    layer = make()
    scanned(layer, [(0.0, 2.0)])
    bearing = np.arctan2(-1.0, 1.0) - yaw
    scanned(layer, [(bearing - 0.3, FAR), (bearing, FAR)], 2, LaserPose(1.0, 1.0, yaw))
    assert not layer.log_odds.any()


def test_one_beam_that_ends_keeps_a_hit_that_others_pass():
    """Along a wall some beams near a hit go on and some end before it."""
    layer = make()
    scanned(layer, [(0.0, 2.0)])
    scanned(layer, [(0.008, FAR), (-0.008, 1.5), (-0.009, FAR)], 20)
    assert at(layer, 2.0, 0.0) == 1.0
    scanned(layer, [(0.008, FAR), (-0.008, np.nan), (-0.009, FAR)], 2)
    assert at(layer, 2.0, 0.0) == 0.0


def test_a_grazing_beam_does_not_clear_what_the_same_scan_has_hit():
    """A thin post that one of two close beams meets stays, in any of its cells."""
    layer = make()
    scanned(layer, [(0.0, 2.0), (0.005, FAR)], 20)
    assert at(layer, 2.0, 0.0) == 2.0


def test_bearings_go_round():
    """Beams on either side of straight behind are neighbours, and 3 pi / 2 is -pi / 2."""
    layer = make()
    scanned(layer, [(np.pi, 2.0), (1.5 * np.pi, 1.0)])
    np.testing.assert_allclose(sorted(layer.obstacles[:, 0]), [-2.0, 0.0], atol=1e-6)
    scanned(layer, [(-np.pi + 0.01, FAR)], 2)
    assert at(layer, -2.0, 1e-9) + at(layer, -2.0, -1e-9) == 0.0
    scanned(layer, [(-0.5 * np.pi, FAR)], 2)
    assert not layer.log_odds.any()


def test_beams_without_a_return_are_no_hits():
    """Neither at the largest range, nor beyond, nor what is no number."""
    layer = make()
    found = scanned(layer, [(0.0, FAR), (1.0, np.inf), (2.0, np.nan), (3.0, 0.0), (-1.0, -2.0)])
    assert not layer.log_odds.any()
    assert found.shape == (0, 2)


def test_a_scan_without_beams_changes_nothing():
    """No beam, no hit and no miss."""
    layer = make()
    scanned(layer, [(0.0, 2.0)])
    scanned(layer, [], 5)
    assert at(layer, 2.0, 0.0) == 1.0


@pytest.mark.parametrize("seed", range(3))
def test_the_order_of_the_beams_changes_nothing(seed):
    """Log odds, places and what is new are the same to the bit after several scans."""
    rng = np.random.default_rng(seed)
    one, other = make(), make()
    for _ in range(6):
        laser = LaserPose(*rng.uniform(-1.0, 1.0, 3))
        bearings = rng.uniform(-np.pi, np.pi, 400)
        ranges = np.where(rng.random(400) < 0.3, FAR, rng.uniform(0.3, 2.0, 400))
        order = rng.permutation(400)
        found = one.update(laser, bearings, ranges, FAR)
        np.testing.assert_array_equal(
            found, other.update(laser, bearings[order], ranges[order], FAR)
        )
    assert np.count_nonzero(one.log_odds) > 100
    np.testing.assert_array_equal(one.log_odds, other.log_odds)
    np.testing.assert_array_equal(one.places, other.places)


def test_hits_keep_their_place_while_the_robot_moves():
    """The square moves with the robot; what it leaves is forgotten."""
    layer = make()
    scanned(layer, [(0.0, 2.05)], laser=LaserPose(0.3, -0.2, 0.5))
    place = [0.3 + 2.05 * np.cos(0.5), -0.2 + 2.05 * np.sin(0.5)]
    np.testing.assert_allclose(layer.obstacles, [place], atol=1e-6)
    for x in (1.0, 3.3, -2.7, 7.9):
        layer.follow(np.array([x, 0.4]))
        np.testing.assert_allclose(layer.obstacles, [place], atol=1e-6)
    layer.follow(np.array([8.7, 0.4]))
    layer.follow(np.array([0.0, 0.0]))
    assert layer.obstacles.shape == (0, 2)


def test_hits_beyond_the_square_are_left_out():
    """A laser that sees farther than the square changes no cell of it."""
    layer = make(cells=64)
    bearings = np.linspace(-np.pi, np.pi, 50)
    layer.update(HERE, bearings, np.full(50, 7.0), 30.0)
    assert not layer.log_odds.any()


def test_new_obstacles_are_those_that_this_scan_made():
    """A hit is new until it is an obstacle, and again after it was cleared."""
    layer = make(lethal_log_odds=1.5)
    assert len(scanned(layer, [(0.0, 2.0)])) == 0
    np.testing.assert_allclose(scanned(layer, [(0.0, 2.0)]), [[2.0, 0.0]], atol=1e-6)
    assert len(scanned(layer, [(0.0, 2.0)])) == 0
    scanned(layer, [(0.0, FAR)])
    assert len(scanned(layer, [(0.0, 2.0)])) == 1


def test_clearing_forgets_hits_within_the_radius():
    """Ground that the robot stands on is free; hits beside it stay."""
    layer = make()
    scanned(layer, [(0.0, 0.15), (1.0, 0.17), (2.0, 0.19)])
    layer.clear(np.zeros(2), 0.18)
    assert np.hypot(*layer.obstacles.T) == pytest.approx([0.19], abs=1e-6)


def test_reset_forgets_everything():
    """A layer that was reset is as a new one."""
    layer = make()
    scanned(layer, [(0.0, 2.0)], laser=LaserPose(30.0, -20.0, 1.0))
    layer.reset()
    assert not layer.log_odds.any()
    np.testing.assert_array_equal(layer.centre, [0, 0])


def test_a_laser_on_the_robot_has_its_pose_in_the_robots_frame():
    """Its place turns with the robot, and yaws add up."""
    pose = LaserPose(0.3, 0.1, 0.2).on(LaserPose(1.0, 2.0, np.pi / 2))
    assert pose == pytest.approx((0.9, 2.3, 0.2 + np.pi / 2))
