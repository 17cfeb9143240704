"""Level ground is free under any laser: the spacing of beams is no drop, an arc alone no slope."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.machine.lidar import LidarConfig
from andabata.machine.lidar_models import sensor_names, sensor_settings
from andabata.models import shipped_forest
from traversability.labels import CellState
from traversability.scanner import TraversabilityScanner

SPINNING = tuple(name for name in sensor_names() if name not in ("utm-30lx", "livox-rosette"))
HEIGHTS = (0.6, 0.72, 0.95, 1.28, 1.73)
NOISE = 0.015


@pytest.fixture(scope="module")
def scanner():
    return TraversabilityScanner(shipped_forest())


def level_ground(name, height, tilt, rng):
    """Return what a turn of a laser that leans by ``tilt`` [rad] sees of level ground."""
    lidar = LidarConfig.model_validate(sensor_settings(name)["sensing"]["lidar"])
    elevations = np.pi / 2 - lidar.elevations(0, 1).astype(np.float64)
    turn = np.arange(0, 2 * np.pi, lidar.head_rate / lidar.sweep_hz) + rng.uniform(0, 0.01)
    e, a = (grid.ravel() for grid in np.meshgrid(elevations, turn))
    beams = np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], axis=-1)
    direction = rng.uniform(-np.pi, np.pi)
    lean = Rotation.from_rotvec(tilt * np.array([-np.sin(direction), np.cos(direction), 0.0]))
    beams = lean.apply(beams)
    beams = beams[beams[:, 2] < -0.02]
    ranges = -height / beams[:, 2] + rng.normal(0, NOISE, len(beams))
    return (beams * ranges[:, None] + [0.0, 0.0, height]).astype(np.float32)


def blocked(cells):
    return int((cells == CellState.NON_TRAVERSABLE).sum())


@pytest.mark.parametrize("name", SPINNING)
def test_level_ground_is_free_at_the_heights_that_robots_have(scanner, name):
    rng = np.random.default_rng(0)
    for height in HEIGHTS:
        cells = scanner.cells(level_ground(name, height, 0.0, rng))
        assert (cells == CellState.TRAVERSABLE).sum() >= 32
        assert blocked(cells) == 0, f"{name} at {height} m"


def test_level_ground_is_free_at_any_height_and_tilt(scanner):
    rng = np.random.default_rng(1)
    for _ in range(100):
        name = SPINNING[rng.integers(len(SPINNING))]
        height, tilt = rng.uniform(0.3, 2.0), np.deg2rad(rng.uniform(0, 10))
        cells = scanner.cells(level_ground(name, height, tilt, rng))
        assert blocked(cells) == 0, f"{name} at {height:.2f} m, {np.rad2deg(tilt):.1f} degrees"


def test_a_ring_that_stands_alone_in_its_sectors_is_no_drop(scanner):
    """What the shadows of posts leave: every second sector keeps a single ring."""
    points = level_ground("os1-64", 1.28, 0.0, np.random.default_rng(2))
    distance = np.hypot(points[:, 0], points[:, 1])
    sector = np.floor((np.arctan2(points[:, 1], points[:, 0]) + np.pi) / (2 * np.pi) * 32)
    seen = (sector.astype(int) % 2 == 0) | ((distance > 4.3) & (distance < 5.69))
    cells = scanner.cells(points[seen])
    judged = int((cells != CellState.EMPTY).sum())
    assert blocked(cells) <= 0.05 * judged


def test_a_wall_is_seen_by_every_laser(scanner):
    """A wall 4 m ahead, taller than the laser stands: what is learnt of gaps must not hide it."""
    for name in SPINNING:
        points = level_ground(name, 1.0, 0.0, np.random.default_rng(3))
        hidden = (np.abs(np.arctan2(points[:, 1], points[:, 0])) < 0.4) & (points[:, 0] > 4.0)
        lidar = LidarConfig.model_validate(sensor_settings(name)["sensing"]["lidar"])
        elevations = np.pi / 2 - lidar.elevations(0, 1).astype(np.float64)
        bearings = np.arange(-0.4, 0.4, lidar.head_rate / lidar.sweep_hz)
        e, a = (grid.ravel() for grid in np.meshgrid(elevations, bearings))
        z = 1.0 + 4.0 / np.cos(a) * np.tan(e)
        wall = np.stack([np.full_like(a, 4.0), 4.0 * np.tan(a), z], axis=-1)
        seen = [points[~hidden], wall[(z > 0) & (z < 1.5)].astype(np.float32)]
        assert scanner.scan(np.concatenate(seen)).ranges[15:17].max() < 4.3, name
