"""Clouds that nobody here made: set ANDABATA_REAL_DATA to a folder that has them."""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from andabata.app.cli import main

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
    """By eye in the first cloud: a wall ahead to the left, open ground behind and to the right."""
    path = str(Path(ROOT) / "libpointmatcher/cloud.00000.vtk")
    main(["scan", path, "--sensor-height", "0.95", "--json", "--picture", str(tmp_path / "s.png")])
    ranges = np.array([r or 10.0 for r in json.loads(capsys.readouterr().out)["ranges"]])
    bearings = -180 + 11.25 * (np.arange(32) + 0.5)
    wall = (bearings > 0) & (bearings < 45)
    open_ground = (bearings > -100) & (bearings < -60)
    assert ranges[wall].max() < 5.0
    assert ranges[open_ground].max() > 5.0
