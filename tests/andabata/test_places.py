"""Recordings from anywhere on Earth: the datum, the field there, and fixes that lie."""

import json
from dataclasses import replace

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.machine.geo_reference import GeoReference
from andabata.records import topics
from andabata.records.bags import Bag
from tests.andabata.moved_drives import YEAR, copied, differing, moved, place, watched

DRIVE = ["drive", "--world", "natural-test", "--seed", "3", "--controller", "reactive"]
PLACES = {
    "Waterloo": place(43.47, -80.54, 330.0),
    "Hobart": place(-42.88, 147.33, 50.0),
    "Taveuni, on the antimeridian": place(-16.8, 180.0, 40.0),
    "La Paz": place(-16.5, -68.15, 3640.0),
    "Longyearbyen": place(78.22, 15.65, 10.0),
}


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A short drive with a 3D laser."""
    path = tmp_path_factory.mktemp("places") / "drive.bag"
    options = ["--out", str(path.parent / "out"), "--set", "plant=kinematic", "--no-clouds"]
    words = [*options, "--sensor", "vlp-16", "--time-limit", "8", "--record", str(path)]
    assert main([*DRIVE, *words, "--json", "--quiet"]) == 0
    return path


@pytest.fixture(scope="module")
def plain(recorded):
    """Its senses, as somebody else's robot would have recorded them."""
    return copied(recorded, recorded.with_name("plain.bag"))


@pytest.fixture
def replay(capsys, monkeypatch):
    """Replay a recording; return the exit code, the figures or the error, and the scans."""

    def run(path, *words):
        capsys.readouterr()
        command = ["bag", "replay", str(path), "--controller", "reactive", *words]
        with watched(monkeypatch) as scans:
            code = main([*command, "--json", "--quiet"])
        out, err = capsys.readouterr()
        return code, json.loads(out) if out else err, scans

    return run


@pytest.mark.parametrize("name", PLACES)
def test_a_drive_makes_the_same_ranges_wherever_on_earth(replay, recorded, plain, tmp_path, name):
    there = PLACES[name]
    _, _, scans = replay(plain)
    code, data, others = replay(moved(recorded, tmp_path / "moved.bag", there))
    assert code == 0
    assert data["datum"]["source"] == "the first good fix"
    assert there.distance(data["datum"]["latitude_deg"], data["datum"]["longitude_deg"]) < 30
    assert data["magnetic"]["declination_deg"] == pytest.approx(there.declination_deg, abs=0.02)
    assert data["magnetic"]["source"] == f"WMM2020 for {YEAR:.1f}"
    assert data["health"] == {"ok": len(others)}
    assert sum(scan is not None for scan in scans) > 60
    assert differing(scans, others) == 0
