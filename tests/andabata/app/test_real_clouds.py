"""Real clouds of other laboratories, from the folder that ANDABATA_REAL_DATA names."""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.models import shipped_forest
from andabata.scanning.scan import Mounting
from traversability.files import read_cloud
from traversability.scanner import TraversabilityScanner

ROOT = os.environ.get("ANDABATA_REAL_DATA")
FILES = {
    "libpointmatcher/cloud.00000.vtk": ["--sensor-height", "0.95"],
    "libpointmatcher/cloud.00001.vtk": ["--sensor-height", "0.95"],
    "libpointmatcher/cloud.00002.vtk": ["--sensor-height", "0.95"],
    "monoforce_marv/1727353472_601360559.npz": [
        "--sensor-height",
        "0.48",
        "--mounting",
        "0.065,0,0,0,135",
    ],
}

pytestmark = pytest.mark.skipif(
    ROOT is None or not Path(ROOT).is_dir(),
    reason="ANDABATA_REAL_DATA names no folder of real clouds",
)


@pytest.mark.parametrize("name", FILES)
def test_a_real_cloud_gives_sensible_ranges(capsys, tmp_path, name):
    """Most sectors of a real cloud are known, with free and blocked cells."""
    picture = tmp_path / "scan.png"
    path = str(Path(ROOT) / name)
    code = main(["scan", path, *FILES[name], "--picture", str(picture), "--json"])
    data = json.loads(capsys.readouterr().out)
    assert code == 0
    assert picture.stat().st_size > 10_000
    known = np.array([r for r in data["ranges"] if r is not None])
    assert len(known) >= 24
    assert ((known >= data["ring_edges_m"][0]) & (known <= 10.0)).all()
    assert data["cells"]["green"] > 0
    assert data["cells"]["red"] > 0


def test_the_street_is_free_and_its_wall_is_not(capsys, tmp_path):
    """A wall ahead to the left, open ground behind and to the right, as the picture shows."""
    path = str(Path(ROOT) / "libpointmatcher/cloud.00000.vtk")
    main(["scan", path, "--sensor-height", "0.95", "--json", "--picture", str(tmp_path / "s.png")])
    ranges = np.array([r or 10.0 for r in json.loads(capsys.readouterr().out)["ranges"]])
    bearings = -180 + 11.25 * (np.arange(32) + 0.5)
    wall = (bearings > 0) & (bearings < 45)
    open_ground = (bearings > -100) & (bearings < -60)
    assert ranges[wall].max() < 5.0
    assert ranges[open_ground].max() > 5.0


@pytest.mark.parametrize(
    ("name", "height"),
    [("libpointmatcher/cloud.00000.vtk", 0.95), ("monoforce_marv/1727353472_601360559.npz", 0.48)],
)
def test_the_ground_gives_the_height_of_the_sensor(capsys, tmp_path, name, height):
    """The note on a wrong sensor height names the true one."""
    options = ["--sensor-height", "1.5", "--json", "--picture", str(tmp_path / "s.png")]
    main(["scan", str(Path(ROOT) / name), *options])
    notes = " ".join(json.loads(capsys.readouterr().out)["notes"])
    height_noted = float(notes.split("--sensor-height should be about ")[1].split()[0])
    assert height_noted == pytest.approx(height, abs=0.07)


def test_the_robots_own_body_is_noted(capsys, tmp_path):
    """Returns of the robot's own body lead to a note."""
    name = "monoforce_marv/1727353472_601360559.npz"
    words = ["scan", str(Path(ROOT) / name), *FILES[name], "--picture", str(tmp_path / "s.png")]
    main([*words, "--json"])
    data = json.loads(capsys.readouterr().out)
    assert data["no_returns"] == 39_172
    assert "--own-body" in " ".join(data["notes"])


def test_an_ousters_times_are_seconds():
    """Stamps of an Ouster's cloud span one turn of 0.1 s."""
    cloud = read_cloud(Path(ROOT) / "monoforce_marv/1727353472_601360559.npz")
    assert cloud.stamps is not None
    assert 0.09 < np.ptp(cloud.stamps) < 0.11


@pytest.mark.parametrize("name", FILES)
def test_ranges_are_stable_under_noise_and_thinning(name):
    """Noise and thinning change nearly all sectors by one ring at most."""
    options = dict(zip(FILES[name][::2], FILES[name][1::2], strict=True))
    x, y, roll, pitch, yaw = map(float, options.get("--mounting", "0,0,0,0,0").split(","))
    height = float(options["--sensor-height"])
    mounting = Mounting(x=x, y=y, z=height, roll=roll, pitch=pitch, yaw=np.deg2rad(yaw))
    points = mounting.place(read_cloud(Path(ROOT) / name).points)
    scanner = TraversabilityScanner(shipped_forest())
    edges = scanner.grid.ring_edges

    def rings(cloud):
        ranges = scanner.scan(cloud.astype(np.float32)).ranges
        found = np.searchsorted(edges, ranges - 1e-3)
        return np.where(np.isnan(ranges), -10, np.where(np.isinf(ranges), len(edges), found))

    before, rng = rings(points), np.random.default_rng(0)
    noisy = [rings(points + rng.normal(0, 0.01, points.shape)) for _ in range(10)]
    thinned = [rings(points[rng.random(len(points)) < 0.5]) for _ in range(10)]
    assert np.mean([np.abs(after - before) <= 1 for after in noisy]) > 0.93
    assert np.mean([np.abs(after - before) <= 1 for after in thinned]) > 0.88
