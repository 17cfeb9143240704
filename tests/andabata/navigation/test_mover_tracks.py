"""Tracks: prediction, gates that grow, ages, and the bits that rooms were measured with."""

import numpy as np
import pytest

from andabata.navigation.mover_tracks import MoverTracks, TrackedMovers, TrackLaw

LAW = TrackLaw(0.3, 0.2, 0.5, 40, 0.1, first_speed=1.5, drift_speed=0.4)
EMPTY = np.empty((0, 3))


def disc(x, y, radius=0.25):
    return np.array([[x, y, radius]])


def tracked(law=LAW, confirmation=1, min_speed=0.0):
    return MoverTracks(law, confirmation, min_speed)


def test_two_looks_seconds_apart_give_the_velocity():
    """Between them the track stays where it was, and its doubt grows."""
    tracks = tracked()
    first = tracks.update(disc(0.0, 0.0))
    np.testing.assert_allclose(first.doubts, [0.3])
    for _ in range(29):
        between = tracks.update(EMPTY)
    np.testing.assert_allclose(between.places, [(0.0, 0.0)])
    np.testing.assert_allclose(between.doubts, [0.3 + 1.5 * 2.9])
    second = tracks.update(disc(3.0, -1.5))
    np.testing.assert_allclose(second.velocities, [(1.0, -0.5)])
    np.testing.assert_allclose(second.ages, [3.0])
    after = tracks.update(EMPTY)
    np.testing.assert_allclose(after.places, [(3.1, -1.55)])
    np.testing.assert_allclose(after.doubts, [0.3 + 0.4 * 0.1])


@pytest.mark.parametrize(("away", "joined"), [(0.74, True), (0.76, False)])
def test_the_gate_of_a_first_look_grows_with_time(away, joined):
    """After 0.3 s it is 0.3 m and 1.5 m/s times that."""
    tracks = tracked()
    for discs in (disc(0.0, 0.0), EMPTY, EMPTY):
        tracks.update(discs)
    assert len(tracks.update(disc(away, 0.0)).radii) == (1 if joined else 2)


@pytest.mark.parametrize(("off", "joined"), [(0.41, True), (0.43, False)])
def test_the_gate_of_a_known_velocity_grows_slowly(off, joined):
    """After 0.3 s it is 0.3 m and 0.4 m/s times that, from where the track is expected."""
    tracks = tracked()
    for discs in (disc(0.0, 0.0), disc(0.1, 0.0), EMPTY, EMPTY):
        tracks.update(discs)
    assert len(tracks.update(disc(0.4, off)).radii) == (1 if joined else 2)


@pytest.mark.parametrize(("scans", "joined"), [(5, False), (6, True)])
def test_what_is_seen_too_soon_is_another(scans, joined):
    """A laser that turns once in seconds has not looked at the same mover again."""
    tracks = tracked(LAW._replace(least_interval=0.55))
    tracks.update(disc(0.0, 0.0))
    for _ in range(scans - 1):
        tracks.update(EMPTY)
    assert len(tracks.update(disc(0.1, 0.0)).radii) == (1 if joined else 2)


def test_another_radius_is_another_track_and_numbers_tell_them_apart():
    """The longest followed comes first; numbers begin anew after a reset."""
    tracks = tracked()
    tracks.update(disc(0.0, 0.0))
    both = tracks.update(np.concatenate([disc(0.0, 0.0, 0.5), disc(0.0, 0.1)]))
    np.testing.assert_array_equal(both.numbers, [0, 1])
    np.testing.assert_allclose(both.radii, [0.25, 0.5])
    np.testing.assert_allclose(both.ages, [0.1, 0.0])
    tracks.reset()
    np.testing.assert_array_equal(tracks.update(disc(0.0, 0.0)).numbers, [0])


def test_longer_steps_are_several_scans():
    """A step of three periods predicts, ages and loses a track as three steps do."""
    many, one = tracked(), tracked()
    for tracks in (many, one):
        tracks.update(disc(0.0, 0.0))
        tracks.update(disc(0.1, 0.0))
    for _ in range(3):
        expected = many.update(EMPTY)
    for left, right in zip(expected, one.update(EMPTY, 3.0), strict=True):
        np.testing.assert_allclose(left, right)
    np.testing.assert_allclose(one.update(disc(0.6, 0.0), 2.0).velocities, [(1.0, 0.0)])
    for _ in range(2):
        one.update(EMPTY, 30.0)
    assert not len(one.update(EMPTY).radii)


def test_tracks_count_when_confirmed_and_moving():
    """Neither one look nor a speed below the least is enough."""
    tracks = tracked(confirmation=2, min_speed=0.5)
    assert not len(tracks.update(disc(0.0, 0.0)).radii)
    assert not len(tracks.update(disc(0.04, 0.0)).radii)
    assert len(tracks.update(disc(0.2, 0.0)).radii) == 1


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("column", [0, 1, 2])
def test_detections_that_are_no_numbers_begin_and_move_no_track(bad, column):
    """The others are followed as without them."""
    tracks, plain = tracked(), tracked()
    for k in range(4):
        wrong = disc(1.0, 1.0)
        wrong[0, column] = bad
        found = tracks.update(np.concatenate([wrong, disc(0.1 * k, 0.0)]))
        expected = plain.update(disc(0.1 * k, 0.0))
    for left, right in zip(found, expected, strict=True):
        np.testing.assert_array_equal(left, right)


def test_what_goes_farther_than_the_gate_between_two_looks_gets_no_velocity():
    """At 6 m/s it is another one in each scan: no track of it counts as moving."""
    tracks = tracked(confirmation=2, min_speed=0.3)
    for k in range(20):
        assert not len(tracks.update(disc(0.6 * k, 0.0)).radii)


def test_five_hundred_movers_are_followed_each():
    """A grid of bodies a metre apart that all walk: as many tracks, with their velocity."""
    tracks = tracked(confirmation=4, min_speed=0.3)
    x, y = np.mgrid[:25, :20].reshape(2, -1)
    for k in range(6):
        movers = tracks.update(np.column_stack([x + 0.1 * k, y, np.full(500, 0.25)]))
    assert len(movers.radii) == 500
    np.testing.assert_allclose(movers.velocities, np.tile([1.0, 0.0], (500, 1)), atol=1e-9)


def test_movers_are_chosen_with_all_columns():
    """None has no rows in any column."""
    movers = tracked().update(np.concatenate([disc(0.0, 0.0), disc(3.0, 1.0)]))
    chosen = movers.select(movers.places[:, 0] > 1.0)
    assert [len(column) for column in chosen] == [1] * 6
    assert chosen.numbers[0] == 1
    assert [len(column) for column in TrackedMovers.none()] == [0] * 6


def test_without_growing_gates_the_bits_are_those_of_planar_scans():
    """Known bits after scans, misses and another mover, as rooms' results were measured with."""
    tracks = MoverTracks(TrackLaw(0.25, 0.15, 0.5, 5, 0.1), 4, 0.1)
    rng = np.random.default_rng(7)
    for k in range(30):
        discs = np.array([[0.05 * k, 0.02 * k, 0.3], [2.0 - 0.03 * k, 1.0, 0.2]])
        discs[:, :2] += 0.01 * rng.standard_normal((2, 2))
        movers = tracks.update(discs[: 1 if 10 <= k < 14 else 2])
    known = [float.fromhex(text) for text in KNOWN_BITS]
    found = [*movers.places.ravel(), *movers.velocities.ravel(), *movers.radii]
    assert found == known


KNOWN_BITS = [
    "0x1.73dd7cf7989f9p+0",
    "0x1.2491382324887p-1",
    "0x1.23c4bbcfae2adp+0",
    "0x1.007e5165e927ep+0",
    "0x1.192933131c4d4p-1",
    "0x1.56123b8d86418p-3",
    "-0x1.0a8501b98e04cp-2",
    "0x1.66c77c72d94c0p-6",
    "0x1.3333333333333p-2",
    "0x1.999999999999ap-3",
]
"""Places, velocities and radii of the planar tracks before clouds had tracks, too."""


def test_what_stays_about_its_place_does_not_move():
    """However fast it seems to, until it is away from where it was first seen."""
    tracks = MoverTracks(LAW, 1, 0.3, min_travel=0.3)
    for k in range(20):
        assert not len(tracks.update(disc(0.1 * (k % 2), 0.0)).radii)
    walking = MoverTracks(LAW, 1, 0.3, min_travel=0.3)
    counts = [len(walking.update(disc(0.05 * k, 0.0)).radii) for k in range(10)]
    assert counts == [0] * 6 + [1] * 4 or counts == [0] * 7 + [1] * 3
