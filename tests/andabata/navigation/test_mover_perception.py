"""Movers off-road: a walker before a standing robot, what sways, slopes, and a pose that jumps."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.navigation.mover_perception import MoverPerception, MoverPerceptionConfig
from tests.support.still_scenes import (
    EYE,
    NOWHERE,
    frame_readings,
    standing_track,
    turning_readings,
)

POSTS = np.array([[4.5, 3.0, 0.15, 3.0], [3.0, -3.5, 0.2, 3.0], [-3.0, 2.0, 0.1, 3.0]])
VELOCITY = np.array([0.0, 0.7])
LASERS = pytest.mark.parametrize("laser", [turning_readings, frame_readings], ids=["2d", "3d"])


def walker(begin, start=(3.0, -1.0), velocity=VELOCITY, height=1.7):
    """Return a function of the bodies at a time: posts, and a walker from a time on."""

    def bodies(stamp):
        if stamp < begin:
            return POSTS
        place = np.array(start) + (stamp - begin) * velocity
        return np.vstack([POSTS, [*place, 0.25, height]])

    return bodies


def follow(laser, seconds, bodies, track=None, **scene):
    """Return the perception after a time, and how many movers it had at most."""
    perception = MoverPerception(MoverPerceptionConfig(), EYE)
    track, most = track or standing_track(seconds), 0
    for readings in laser(seconds, bodies, **scene):
        perception.update(readings, track)
        most = max(most, len(perception.movers.radii))
    return perception, most


@LASERS
@pytest.mark.parametrize("slope", [0.0, 0.25])
def test_a_walker_before_a_standing_robot_is_followed(laser, slope):
    """Place and velocity are its own, on flat ground and on a slope."""
    seconds, begin = (16.0, 7.0) if laser is turning_readings else (4.0, 1.5)
    perception, most = follow(laser, seconds, walker(begin), slope=slope)
    assert most == 1
    movers = perception.movers
    place = np.array([3.0, -1.0]) + (seconds - begin) * VELOCITY
    np.testing.assert_allclose(movers.places, [place], atol=0.2)
    np.testing.assert_allclose(movers.velocities, [VELOCITY], atol=0.1)
    np.testing.assert_allclose(movers.radii, [0.25], atol=0.1)
    perception.reset()
    assert not len(perception.movers.radii)


@pytest.mark.parametrize(
    ("laser", "times", "found"),
    [(turning_readings, (16.0, 7.0), 0), (frame_readings, (4.0, 1.5), 1)],
    ids=["2d", "3d"],
)
def test_an_animal_of_ninety_centimetres_is_sought_by_a_3d_laser_alone(laser, times, found):
    """What is low and seen once in seconds is a shrub as often."""
    seconds, begin = times
    assert follow(laser, seconds, walker(begin, height=0.9))[1] == found


@LASERS
@pytest.mark.parametrize("slope", [0.0, 0.25])
def test_nothing_moves_where_nothing_does(laser, slope):
    """Posts and slopes are no movers."""
    seconds = 12.0 if laser is turning_readings else 3.0
    assert follow(laser, seconds, lambda stamp: POSTS, slope=slope)[1] == 0


@LASERS
def test_leaves_that_stop_beams_at_random_are_no_movers(laser):
    """A tree whose leaves sway is seen elsewhere in each look."""
    leaves = np.array([[3.0, 1.0, 0.8, 2.5], [-2.0, -2.0, 0.3, 2.0]])
    scene = {"leaves": leaves, "rng": np.random.default_rng(0)}
    seconds = 14.0 if laser is turning_readings else 3.0
    assert follow(laser, seconds, lambda stamp: POSTS, **scene)[1] == 0


@LASERS
def test_a_pose_that_jumps_moves_nothing(laser):
    """When all that stands is seen elsewhere none of it is believed."""
    angles = np.arange(0.0, 2 * np.pi, 0.5)
    circle = [3.0 * np.cos(angles), 3.0 * np.sin(angles), 0 * angles + 0.15, 0 * angles + 3.0]
    seconds, jump = (16.0, 9.0) if laser is turning_readings else (3.0, 2.0)
    track = standing_track(seconds, (0.9, 0.4, 0.0), before=(jump, (0.0, 0.0, 0.0)))
    perception, most = follow(laser, seconds, lambda stamp: np.stack(circle, axis=1), track)
    assert most == 0
    assert perception.jumps >= 1


@LASERS
def test_a_believed_walker_is_no_wall_and_posts_are(laser):
    """The map keeps neither the cells that it stands in nor those that it left; posts stay."""
    is_turning = laser is turning_readings
    seconds, begin = (15.0, 7.0) if is_turning else (4.0, 1.5)
    perception, _ = follow(laser, seconds, walker(begin))
    places, movers = perception.transient_places, perception.movers
    away = np.hypot(*(places - movers.places[0]).T)
    # Where a turning laser saw it last.
    assert away.min() < (2.6 if is_turning else 0.5)
    assert np.abs(places[:, 0] - 3.0).max() < 0.6
    for post in POSTS:
        assert np.hypot(*(places - post[:2]).T).min() > post[2] + 0.1
    perception.movers = movers.select(np.zeros(1, dtype=np.bool_))
    assert len(perception.transient_places) < len(places)


def test_what_stands_a_while_is_no_mover_when_it_goes_unseen():
    """A laser that sends nothing changes nothing."""
    perception = MoverPerception(MoverPerceptionConfig(), EYE)
    for readings in turning_readings(0.3, lambda stamp: NOWHERE):
        perception.update(readings, standing_track(1.0))
    assert not len(perception.movers.radii)


def test_a_walker_on_open_ground_is_followed_by_the_rows_of_its_laser():
    """Where the ground falls away nothing returns from behind it."""
    rows = tuple(np.linspace(-22.5, 22.5, 40).tolist())
    begin, seconds = 2.5, 5.0
    numbers = []
    for known in (rows, ()):
        perception = MoverPerception(MoverPerceptionConfig(), EYE, rows_deg=known)
        for readings in frame_readings(seconds, walker(begin)):
            cloud = readings.frames[0]
            near = np.hypot(*cloud.points[:, :2].T) < 3.6
            seen = replace(readings, frames=(cloud.select(near),))
            perception.update(seen, standing_track(seconds))
        numbers.append(len(perception.movers.radii))
    assert numbers == [1, 0]
