"""Catalogue of lasers: the same assembler, grid and forest serve every beam pattern."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.app.cli import main
from andabata.configuration.settings import with_parts
from andabata.datasets.labelled_cloud import CloudsConfig, labelled_cloud
from andabata.machine.lidar import LidarConfig
from andabata.machine.lidar_models import UnknownSensorError, sensor_names, sensor_settings
from andabata.models import shipped_forest
from andabata.training.plans import load_plan
from terrain.classes import SemanticClass
from terrain.objects import frustum
from traversability.labels import CellState
from traversability.scanner import TraversabilityScanner
from worlds.world import Start

BEAMS = {
    "hdl-32e": 32,
    "hdl-64e": 64,
    "livox-rosette": 100,
    "os0-128": 128,
    "os0-32": 32,
    "os1-64": 64,
    "pandar-40p": 40,
    "rs-32": 32,
    "utm-30lx": 1081,
    "vlp-16": 16,
    "vlp-32c": 32,
    "xt-32": 32,
}


def test_the_known_lasers():
    """The catalogue has the known lasers and refuses others."""
    assert set(sensor_names()) == set(BEAMS)
    with pytest.raises(UnknownSensorError, match="expected one of hdl-32e, hdl-64e, livox-rosette"):
        sensor_settings("mid-999")


def test_a_table_of_elevations_is_kept_beam_by_beam():
    """A table of elevations is kept beam by beam."""
    table = (-25.0, -15.639, -4.0, 0.0, 15.0, 20.0, 25.0, 30.0, 40.0, 50.0, 60.0)
    lidar = LidarConfig(elevations_deg=table, beams=11, sweep_hz=18000.0)
    assert lidar.is_multibeam
    assert lidar.beam_period == 0.0
    found = 90.0 - np.rad2deg(lidar.elevations(0, 1).astype(np.float64))
    np.testing.assert_allclose(found, table, atol=1e-4)


@pytest.mark.parametrize(
    "fields",
    [
        {"elevations_deg": (0.0, 1.0), "beams": 11},
        {"elevations_deg": tuple(range(10, -1, -1)), "beams": 11},
        {"elevations_deg": tuple(range(85, 96)), "beams": 11},
        {"elevations_deg": tuple(range(11)), "beams": 11, "span_deg": (0.0, 10.0)},
    ],
)
def test_a_table_that_is_none_is_refused(fields):
    """A table that does not fit the beams is an error."""
    with pytest.raises(ValueError, match="elevations_deg: expected"):
        LidarConfig(**fields)


def test_the_widely_spaced_lasers_have_their_published_beams():
    """Unevenly spaced lasers have their published beams."""
    for name, lowest in (("vlp-32c", (-25.0, -15.639, -11.31)), ("rs-32", (-25.0, -14.638))):
        table = sensor_settings(name)["sensing"]["lidar"]["elevations_deg"]
        assert tuple(table[: len(lowest)]) == lowest


@pytest.mark.parametrize("name", BEAMS)
def test_a_trunk_stands_where_it_is_in_every_lasers_cloud(name, make_scene):
    """A trunk is at its place in every laser's cloud and scan."""
    trunk = frustum(SemanticClass.TRUNK, (3.0, 1.0, 0.0), (0.15, 0.15), 3.0)
    scene = make_scene(objects=[trunk], size=30.0)
    config = with_parts(CloudsConfig, name).model_copy(update={"carry_time": 0.0})
    assert config.sensing.lidar.beams == BEAMS[name]
    cloud = labelled_cloud(scene, config, np.random.default_rng(0), Start(0.0, 0.0, 0.3))
    bearing = np.arctan2(cloud.points[:, 1], cloud.points[:, 0])
    hits = cloud.classes == SemanticClass.TRUNK
    assert hits.sum() > 20
    moved = 0.3 * 3.4  # At most, while the turning head completes its cloud.
    assert np.hypot(*cloud.points[hits, :2].mean(axis=0)) == pytest.approx(3.0, abs=moved)
    scan = TraversabilityScanner(shipped_forest()).scan(cloud.points)
    sector = int((np.median(bearing[hits]) + np.pi) / (2 * np.pi) * 32)
    assert 1.0 < scan.ranges[sector] < 3.3
    full_turn = np.histogram(bearing, 16, (-np.pi, np.pi))[0]
    assert (full_turn > 0.3 * full_turn.mean()).all()


def test_an_unknown_sensor_is_a_usage_error(tmp_path, capsys):
    """An unknown laser is a usage error."""
    code = main(["clouds", "generate", "--out", str(tmp_path), "--sensor", "sonar"])
    assert code == 2
    assert "--sensor: expected one of" in capsys.readouterr().err


def test_clouds_of_another_laser_are_generated(tmp_path, capsys):
    """The command line generates clouds of another laser."""
    options = ["--train", "1", "--validation", "0", "--workers", "1", "--json"]
    out = str(tmp_path)
    assert main(["clouds", "generate", "--out", out, "--sensor", "vlp-16", *options]) == 0
    assert json.loads(capsys.readouterr().out)["clouds"] == 1


def test_a_run_learns_with_another_laser():
    """A training plan takes another laser."""
    stages = [plan.environment for plan in load_plan(sensor="os1-64").stages.values()]
    assert stages[0].simulated_robot.sensing.scanner == "horizontal"
    assert [stage.simulated_robot.sensing.lidar.beams for stage in stages[1:]] == [64, 64]
    assert stages[2].simulated_robot.plant == "kinematic"
    assert stages[2].simulated_robot.assembly.turn == pytest.approx(2 * np.pi)


SPINNING = tuple(name for name in sensor_names() if name not in ("utm-30lx", "livox-rosette"))
HEIGHTS = (0.6, 0.72, 0.95, 1.28, 1.73)
NOISE = 0.015


@pytest.fixture(scope="module")
def scanner():
    """Return the scanner with the shipped forest."""
    return TraversabilityScanner(shipped_forest())


def level_ground(name, height, tilt, rng):
    """Return the cloud of level ground of one turn of a laser that leans by ``tilt`` [rad]."""
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
    """Return the number of blocked cells."""
    return int((cells == CellState.NON_TRAVERSABLE).sum())


@pytest.mark.parametrize("name", SPINNING)
def test_level_ground_is_free_at_the_heights_that_robots_have(scanner, name):
    """Level ground has no blocked cell under any laser at usual heights."""
    rng = np.random.default_rng(0)
    for height in HEIGHTS:
        cells = scanner.cells(level_ground(name, height, 0.0, rng))
        assert (cells == CellState.TRAVERSABLE).sum() >= 32
        assert blocked(cells) == 0, f"{name} at {height} m"


def test_level_ground_is_free_at_any_height_and_tilt(scanner):
    """Level ground has no blocked cell at any height and tilt."""
    rng = np.random.default_rng(1)
    for _ in range(100):
        name = SPINNING[rng.integers(len(SPINNING))]
        height, tilt = rng.uniform(0.3, 2.0), np.deg2rad(rng.uniform(0, 10))
        cells = scanner.cells(level_ground(name, height, tilt, rng))
        assert blocked(cells) == 0, f"{name} at {height:.2f} m, {np.rad2deg(tilt):.1f} degrees"


def test_a_ring_that_stands_alone_in_its_sectors_is_no_drop(scanner):
    """Shadows of posts leave a single ring in every second sector, which is no drop."""
    points = level_ground("os1-64", 1.28, 0.0, np.random.default_rng(2))
    distance = np.hypot(points[:, 0], points[:, 1])
    sector = np.floor((np.arctan2(points[:, 1], points[:, 0]) + np.pi) / (2 * np.pi) * 32)
    seen = (sector.astype(int) % 2 == 0) | ((distance > 4.3) & (distance < 5.69))
    cells = scanner.cells(points[seen])
    classified = int((cells != CellState.EMPTY).sum())
    assert blocked(cells) <= 0.05 * classified


def test_a_wall_is_seen_by_every_laser(scanner):
    """A wall 4 m ahead, taller than the laser, ends the scan: gaps between rings do not hide it."""
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
