"""Scans of files: exit codes, labels without a meaning."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.app.cli import main
from andabata.app.scan_files import CloudSource, exit_code, scan_file
from andabata.models import shipped_forest
from andabata.records import topics
from andabata.records.bag_writers import open_writer
from andabata.records.frames.sensor_pose import GivenMounting
from andabata.records.messages import MessageBuilder
from andabata.report.plots.axes import png
from andabata.scanning.scan import ScanConfig
from tests.support.scanned_scenes import advised, is_right, scan, scene, unpainted
from traversability.cloud import PointCloud
from traversability.decoding import DecodedCloud
from traversability.files import cloud_to_bytes

GOOD = {"cells": {"green": 1, "red": 0, "white": 319}, "data_lost": False}
EMPTY = {"cells": {"green": 0, "red": 0, "white": 320}, "data_lost": False}
ERROR = {"file": "a", "error": "bad"}


@pytest.mark.parametrize(
    ("found", "code"),
    [
        ([GOOD], 0),
        ([{"cells": {"green": 0, "red": 1, "white": 319}}], 0),
        ([EMPTY], 1),
        ([EMPTY, ERROR], 1),
        ([GOOD, ERROR], 3),
        ([GOOD, EMPTY], 3),
        ([GOOD, GOOD | {"data_lost": True}], 3),
    ],
)
def test_the_exit_code_says_how_much_was_lost(found, code):
    """1 if no cell of any cloud was classified, 3 if some data were left out."""
    assert exit_code(found) == code


def test_a_mounted_laser_stands_in_its_own_frame(tmp_path):
    """A mounting of the laser overrides the frame that a cloud file names."""
    path = tmp_path / "cloud.npz"
    path.write_bytes(cloud_to_bytes(PointCloud(np.ones((9, 3), np.float32), "base_link")))
    given = {"laser": GivenMounting(0.0, 0.0, None, Rotation.identity())}
    assert CloudSource().read(path).cloud.frame == "base_link"
    assert CloudSource(mountings=given).read(path).cloud.frame == "sensor"


def test_labels_without_a_meaning_are_noted():
    """At most eight label numbers are listed."""
    points = np.random.default_rng(0).uniform(-5, 5, (900, 3)).astype(np.float32)
    cloud = PointCloud(points, classes=(np.arange(900) % 10).astype(np.uint8))
    data, picture = scan_file(DecodedCloud(cloud), "a", ScanConfig(), shipped_forest())
    (note,) = [note for note in data["notes"] if note.startswith("labels")]
    assert note.startswith("labels 0, 1, 2, 3, 4, 5, 6, 7 and more: nothing says")
    assert png(picture).startswith(b"\x89PNG")


@pytest.mark.parametrize("name", [b"nube_\xf1.bin", "点 $\\frac$ [b].bin".encode()])
def test_a_file_of_any_name_is_scanned(capsys, tmp_path, monkeypatch, name):
    """Names that are no UTF-8, no letters of the font, or look like formulas are drawn."""
    monkeypatch.chdir(tmp_path)
    path = os.fsdecode(name)
    points = scene()
    rows = np.column_stack([points, np.zeros(len(points))]).astype("<f4")
    Path(path).write_bytes(rows.tobytes())
    words = ["scan", path, "--report", "page.html"]
    assert main(words) == 0
    shown = name.decode("utf-8", "replace")
    assert shown in capsys.readouterr().out
    page = Path("page.html").read_text("utf-8")
    assert shown.replace("$", "") in page.replace("$", "")
    assert Path(f"{path.removesuffix('.bin')}_scan.png").is_file()
    assert main([*words, "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["file"] == shown
    assert is_right(result)
    Path(path).write_bytes(b"")
    assert main(words) == 1
    assert shown in capsys.readouterr().err


def test_a_recording_may_be_in_another_unit(capsys, tmp_path, monkeypatch):
    """``--unit`` is the unit of a recorded cloud before it is mounted."""
    unpainted(monkeypatch)
    path = tmp_path / "cloud.bag"
    writer, builder = open_writer(path), MessageBuilder(1)
    cloud = PointCloud((scene() * 1000).astype(np.float32), "sensor")
    writer.write(topics.CLOUD, builder.stamp_ns(1.0), builder.cloud(1.0, cloud))
    writer.close()
    note = scan(capsys, path)["notes"][-1]
    assert is_right(scan(capsys, path, *advised(note, "--unit")))
