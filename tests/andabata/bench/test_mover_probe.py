"""Movers against the truth: who is in sight, who is found, and which tracks are nobody's."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from andabata.bench.mover_probe import MoverProbe
from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import SensorReadings, Sweeps
from andabata.navigation.mover_tracks import TrackedMovers

HERE = Pose.from_euler(np.array([10.0, 5.0, 0.0]), 0.0, 0.0, 0.5)
"""True pose; the robot believes to be at the origin of odom."""

ODOMETRY = Pose.from_euler(np.zeros(3), 0.0, 0.0, 0.0)


def tracks_at(*places, velocity=(0.0, 0.0)):
    """Return tracks at places in odom, numbered."""
    count = len(places)
    column, pairs = np.full(count, 0.3), np.reshape(places, (count, 2))
    numbers = np.arange(count, dtype=np.float64)
    return TrackedMovers(pairs, np.tile(velocity, (count, 1)), column, column, column, numbers)


def in_map(place):
    """Return the place in the map of a place in odom."""
    c, s = np.cos(0.5), np.sin(0.5)
    return np.array([10.0 + c * place[0] - s * place[1], 5.0 + s * place[0] + c * place[1]])


class Drive:
    """Takes a probe through steps of 0.1 s."""

    def __init__(self, blocked=False):
        ranges = np.full(3, 0.5 if blocked else np.inf, dtype=np.float32)
        self.movers = SimpleNamespace(movers=TrackedMovers.none(), update=lambda *_: None, jumps=2)
        robot = SimpleNamespace(
            scene=SimpleNamespace(rays=SimpleNamespace(cast=lambda *_: (ranges, None))),
            localizer=SimpleNamespace(odometry=ODOMETRY, track=None),
            config=SimpleNamespace(robot=SimpleNamespace(lidar_height=0.7)),
        )
        self.probe = MoverProbe(("laser", "world", 1), robot, self.movers)
        self.stamp = 0.0

    def step(self, *places, tracks=(), velocity=(0.0, 0.0), heads=None):
        """Take a step with walkers, and tracks, at places in odom."""
        self.stamp += 0.1
        rows = [(*in_map(place), 0.0, 0.25, 1.7) for place in places]
        truth = SimpleNamespace(pose=HERE)
        readings = SensorReadings(
            self.stamp, walkers=np.reshape(rows, (-1, 5)), truth=truth, frames=(None,)
        )
        if heads is not None:
            angles = np.array([heads])
            sweeps = Sweeps(angles, angles, 0.9, 0.0, np.zeros(1), np.zeros((1, 1)))
            readings = replace(readings, sweeps=sweeps, frames=())
        self.movers.movers = tracks_at(*tracks, velocity=velocity)
        self.probe(readings)

    @property
    def moments(self):
        return self.probe.drive.moments


def test_a_walker_counts_after_a_second_in_sight():
    """Found or not, at its distance, with all looks of a laser that sees all of it."""
    drive = Drive()
    for k in range(15):
        drive.step((3.0, 3.9 - 0.01 * k))
    assert 5 <= len(drive.moments) <= 6
    assert [m.looks for m in drive.moments][-1] == 15
    assert not any(m.found for m in drive.moments)
    assert drive.moments[-1].distance == pytest.approx(np.hypot(3.0, 3.76))


def test_who_is_hidden_or_far_does_not_count():
    """Behind something, or beyond 5 m, there is no moment; to come near begins the second anew."""
    hidden, far = Drive(blocked=True), Drive()
    for _ in range(15):
        hidden.step((3.0, 0.0))
        far.step((5.5, 0.0))
    for _ in range(8):
        far.step((4.5, 0.0))
    assert not hidden.moments
    assert not far.moments


def test_a_track_near_a_walker_finds_it_with_its_errors():
    """Errors are those of place and velocity, in the frame of the map."""
    drive = Drive()
    for k in range(20):
        x = 2.0 + 0.1 * k
        drive.step((x, 1.0), tracks=[(x, 1.3)], velocity=(0.8, 0.0))
    assert all(m.found for m in drive.moments)
    assert drive.moments[-1].place_error == pytest.approx(0.3)
    assert drive.moments[-1].velocity_error == pytest.approx(0.2)
    assert (drive.probe.drive.encounters, drive.probe.drive.met) == (1, 1)


def test_a_plane_looks_at_a_bearing_twice_a_turn():
    """A head that turns past a walker, or past the place opposite, has looked once."""
    drive = Drive()
    for k in range(64):
        drive.step((3.0, 3.0), heads=0.1 * k + 0.05)
    assert drive.moments[-1].looks == 2


def test_tracks_that_are_never_near_a_walker_are_false():
    """A track that was near one once is not; the duration and the jumps are kept."""
    drive = Drive()
    drive.step((3.0, 0.0), tracks=[(3.5, 0.0), (0.0, 3.0)])
    drive.step((5.0, 0.0), tracks=[(3.5, 0.0), (0.0, 3.0)])
    result = drive.probe.finish(60.0)
    assert (result.tracks, result.false_tracks, result.duration, result.jumps) == (2, 1, 60.0, 2)
    assert result.cost >= 0.0
