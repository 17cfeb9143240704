"""Tracks against the truth, step by step: moments, encounters, false tracks."""

import numpy as np
import pytest

from andabata.bench.mover_tally import MoverTally, Tracks, TrueMovers

NONE = np.zeros((0, 2))


class Steps:
    """Takes a tally through steps of 0.1 s; the robot stands at the origin."""

    def __init__(self, seen=True):
        self.tally, self.seen = MoverTally(("laser", "world", 1)), seen

    def step(self, *places, tracks=(), velocity=(0.0, 0.0), there=True, numbers=None):
        """Take a step with movers and tracks at places."""
        movers, found = np.reshape(places, (-1, 2)).astype(float), np.reshape(tracks, (-1, 2))
        count = len(found)
        numbers = np.arange(count) if numbers is None else np.array(numbers)
        self.tally.compare(
            Tracks(found.astype(float), np.tile(velocity, (count, 1)), numbers.astype(float)),
            TrueMovers(movers, np.full(len(movers), there), lambda _: self.seen, lambda _: True),
            np.zeros(2),
            0.1,
            0.002,
        )

    @property
    def moments(self):
        return self.tally.drive.moments


def test_a_mover_counts_after_a_second_in_sight():
    """With its distance, its true speed and the looks so far."""
    steps = Steps()
    for k in range(15):
        steps.step((3.0, 2.0 - 0.1 * k))
    assert 5 <= len(steps.moments) <= 6
    last = steps.moments[-1]
    assert (last.looks, last.found) == (15, False)
    assert (last.distance, last.speed) == pytest.approx((np.hypot(3.0, 0.6), 1.0))
    assert np.isnan(last.place_error)


def test_who_is_hidden_far_or_not_there_does_not_count():
    """To come near begins the second anew."""
    hidden, gone, far = Steps(seen=False), Steps(), Steps()
    for _ in range(15):
        hidden.step((3.0, 0.0))
        gone.step((3.0, 0.0), there=False)
        far.step((5.5, 0.0))
    for _ in range(8):
        far.step((4.8, 0.0))
    assert not hidden.moments
    assert not gone.moments
    assert not far.moments


def test_one_that_appears_elsewhere_is_another_sighting():
    """Its second begins anew, and no speed is made of the jump."""
    steps = Steps()
    for _ in range(12):
        steps.step((3.0, 0.0))
    before = len(steps.moments)
    for _ in range(12):
        steps.step((0.0, 3.0))
    assert before <= 3
    assert len(steps.moments) == 2 * before
    assert max(moment.speed for moment in steps.moments) == 0.0
    assert steps.tally.drive.encounters == 2


def test_a_track_near_a_mover_finds_it_with_its_errors():
    """The nearest of several; found once in an encounter is met."""
    steps = Steps()
    for k in range(20):
        x = 1.0 + 0.1 * k
        steps.step((x, 1.0), tracks=[(x, 1.5), (x, 1.3)], velocity=(0.8, 0.0))
    assert all(m.found for m in steps.moments)
    assert steps.moments[-1].place_error == pytest.approx(0.3)
    assert steps.moments[-1].velocity_error == pytest.approx(0.2)
    assert (steps.tally.drive.encounters, steps.tally.drive.met) == (1, 1)


def test_tracks_that_are_never_near_a_mover_are_false():
    """One that was near once is not; numbers begin anew with each task."""
    steps = Steps()
    steps.step((3.0, 0.0), tracks=[(3.5, 0.0), (0.0, 3.0)])
    steps.step((5.0, 0.0), tracks=[(3.5, 0.0), (0.0, 3.0)])
    steps.tally.restart()
    steps.step((3.0, 0.0), tracks=[(0.0, 3.0)])
    result = steps.tally.finish(60.0, jumps=2)
    assert (result.tracks, result.false_tracks) == (3, 2)
    assert (result.duration, result.jumps, result.cost) == (60.0, 2, 0.002)


def test_without_movers_every_track_is_false():
    """A world in which nothing moves."""
    steps = Steps()
    steps.step(tracks=[(1.0, 0.0)])
    assert steps.tally.finish(1.0).false_tracks == 1


def test_tracks_are_seen_from_the_true_pose():
    """Ahead of where the robot believes to be is ahead of where it is."""
    places, velocities = np.array([(3.0, 1.0)]), np.array([(1.0, 0.0)])
    known = places, velocities, np.zeros(1)
    tracks = Tracks.seen_from((5.0, 5.0, np.pi / 2), (2.0, 1.0, 0.0), *known)
    np.testing.assert_allclose(tracks.places, [(5.0, 6.0)])
    np.testing.assert_allclose(tracks.velocities, [(0.0, 1.0)], atol=1e-12)
