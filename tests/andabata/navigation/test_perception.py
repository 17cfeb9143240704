"""Perception: clouds to virtual scans, or the ranges of a horizontal scanner as they are."""

import numpy as np
import pytest

from andabata.machine.pose import PoseTrack
from andabata.machine.sensor_readings import SensorReadings, Sweeps
from andabata.models import shipped_forest
from andabata.navigation.cloud_assembly import CloudAssembler, CloudAssemblyConfig
from andabata.navigation.perception import CloudPerception, HorizontalPerception, assembler_of
from tests.support.situations import GRID, StubLocalizer, pose_at
from traversability.cloud import PointCloud
from traversability.scanner import TraversabilityScanner


class StubLayers:
    """Layers that count their resets."""

    resets = 0

    def reset(self):
        self.resets += 1


def ground(stamp=0.0, height=0.0):
    """Return a frame of level ground with a wall ahead, all at one time."""
    rng = np.random.default_rng(0)
    xy = rng.uniform(-8.0, 8.0, (40_000, 2))
    plane = np.column_stack([xy, rng.normal(height, 0.005, len(xy))])
    wall = np.column_stack(
        [rng.uniform(2.9, 3.1, 4000), rng.uniform(-2, 2, 4000), rng.uniform(0, 1, 4000)]
    )
    points = np.concatenate([plane, wall]).astype(np.float32)
    return PointCloud(points, "base_footprint", np.full(len(points), stamp))


@pytest.fixture
def localizer():
    """Return a localizer that has stood at the origin for some seconds."""
    standing = StubLocalizer()
    for stamp in (0.0, 10.0):
        standing.track.append(stamp, np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))
    return standing


class StubMovers:
    """Movers that note what they are given."""

    def __init__(self):
        self.updates, self.resets = [], 0

    def update(self, readings, track):
        self.updates.append((readings, track))

    def reset(self):
        self.resets += 1


def make(layers=None, movers=None):
    """Return a perception of clouds."""
    return CloudPerception(
        CloudAssembler(CloudAssemblyConfig(), 0.7), shipped_forest(), GRID, layers, movers
    )


def test_the_scan_is_that_of_the_cloud_around_the_current_pose(localizer):
    """The last cloud is moved into the pose in ``odom``, then classified."""
    perception = make()
    perception.update(SensorReadings(0.0, frames=(ground(),)), localizer)
    localizer.odometry, localizer.pose = pose_at(1.0, 0.0, np.pi / 2), pose_at(50.0)
    scan = perception.scan(0.1, localizer)
    around = perception.assembler.relative(localizer.odometry).points
    expected = TraversabilityScanner(shipped_forest(), GRID).scan(around)
    np.testing.assert_array_equal(scan.ranges, expected.ranges)
    np.testing.assert_array_equal(scan.log_odds, expected.log_odds)
    # The wall 2 m ahead in odom is on the right of the turned robot.
    right = np.abs(GRID.bearings + np.pi / 2) < 0.3
    left = np.abs(GRID.bearings - np.pi / 2) < 0.3
    assert (scan.ranges[right] < 2.5).all()
    assert (scan.ranges[left] > 5.0).all()


def test_without_a_fresh_cloud_there_is_no_scan(localizer):
    """Before the first cloud, when it is stale, and after a reset there is none."""
    perception = make()
    assert perception.scan(0.0, localizer) is None
    perception.update(SensorReadings(0.0, frames=(ground(),)), localizer)
    assert perception.scan(4.9, localizer) is not None
    assert perception.scan(5.1, localizer) is None
    perception.reset()
    assert perception.scan(0.1, localizer) is None


def test_all_frames_and_sweeps_are_taken_in(localizer):
    """Two frames of one period are both assembled; sweeps are placed along the track."""
    perception = make()
    frames = (ground(1.0), ground(1.1, 0.3))
    perception.update(SensorReadings(1.1, frames=frames), localizer)
    assert perception.assembler.cloud_age(1.1) == pytest.approx(0.0)
    assert np.median(perception.assembler.cloud.points[:, 2]) == pytest.approx(0.3, abs=0.01)
    sweeping = make()
    for k, angle in enumerate((0.0, np.pi, 2 * np.pi)):
        sweeps = Sweeps(
            np.array([1.0 + k]),
            np.array([angle]),
            0.0,
            0.0,
            np.float32([1.5]),
            np.float32([[2.0]]),
        )
        sweeping.update(SensorReadings(1.0 + k, sweeps=sweeps), localizer)
    assert len(sweeping.assembler.cloud) == 1


def test_layers_are_those_of_the_planner_and_are_reset_with_the_clouds():
    """Without a planner there are no layers."""
    layers = StubLayers()
    perception = make(layers)
    assert perception.layers is layers
    perception.reset()
    assert layers.resets == 1
    assert make().layers is None


def test_movers_are_fed_with_the_readings_and_the_track(localizer):
    """Once a step, and forgotten with the clouds."""
    movers = StubMovers()
    perception = make(movers=movers)
    assert perception.movers is movers
    readings = SensorReadings(0.0, frames=(ground(),))
    perception.update(readings, localizer)
    assert movers.updates == [(readings, localizer.track)]
    perception.reset()
    assert movers.resets == 1


def test_a_horizontal_scan_is_its_own_virtual_scan():
    """Ranges come back as they are, up to the polar grid's outer radius; silence is no scan."""
    perception = HorizontalPerception(GRID)
    localizer = StubLocalizer()
    assert perception.scan(0.0, localizer) is None
    assert perception.layers is None
    ranges = np.linspace(1.0, 5.0, GRID.n_sectors, dtype=np.float32)
    perception.update(SensorReadings(0.1, horizontal=ranges), localizer)
    scan = perception.scan(0.1, localizer)
    np.testing.assert_array_equal(scan.ranges, ranges)
    assert scan.max_range == GRID.outer_radius
    assert scan.log_odds is None
    perception.update(SensorReadings(0.2), localizer)
    assert perception.scan(0.2, localizer) is None
    perception.update(SensorReadings(0.3, horizontal=ranges), localizer)
    perception.reset()
    assert perception.scan(0.3, localizer) is None


def test_only_clouds_have_an_assembler():
    """The assembler is that of the clouds; a horizontal scanner has none."""
    perception = make()
    assert assembler_of(perception) is perception.assembler
    assert assembler_of(HorizontalPerception(GRID)) is None


def test_beams_are_placed_with_the_poses_of_their_own_instants():
    """A robot that drives one metre between two frames sees the same wall twice."""
    localizer = StubLocalizer()
    localizer.track = PoseTrack()
    for stamp, x in ((0.0, 0.0), (1.0, 1.0)):
        localizer.track.append(stamp, np.array([x, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, 1.0]))
    perception = make()
    for stamp, ahead in ((0.0, 3.0), (1.0, 2.0)):
        frame = PointCloud(np.float32([[ahead, 0.0, 0.0]]), "base_footprint", np.array([stamp]))
        perception.update(SensorReadings(stamp, frames=(frame,)), localizer)
        np.testing.assert_allclose(perception.assembler.cloud.points, [[3.0, 0.0, 0.0]], atol=1e-6)
