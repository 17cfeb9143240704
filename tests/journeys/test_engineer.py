"""An engineer's first hour: a recording replayed, its cloud scanned, a drive learnt from."""

import os
import signal
import subprocess
import sys

import numpy as np
import pytest

from tests.support.documents import ROOT
from tests.support.ros2_tools import domain, needs_dds
from tests.support.walks import Walk

GUIDES = "docs/guides/"
REPLAY, SCAN, ADAPT = (
    f"{GUIDES}{name}.md" for name in ("replay-my-bag", "scan-my-cloud", "adapt-to-my-ground")
)
SHORT = "--time-limit 6 --set plant=kinematic"


@pytest.fixture
def walk(tmp_path, capsys):
    """Return a walk in an empty folder."""
    return Walk(tmp_path, capsys)


def test_a_recording_is_told_replayed_and_its_cloud_scanned(walk):
    """The guides of replays and scans: topics, the same scans and commands, cells of its cloud."""
    said = walk.type(walk.read(REPLAY, "drive"), SHORT)
    assert "record: drive.mcap" in said
    told = walk.ask(walk.read(REPLAY, "bag info"))
    rates = {topic["topic"]: topic for topic in told["topics"]}
    assert {"/scan_2d", "/imu/data", "/fix", "/points"} <= set(rates)
    replayed = walk.type(walk.read(REPLAY, "bag replay"))
    assert "0 of 26 recorded scans and 0 commands differ" in replayed
    assert "health: ok" in replayed
    line = walk.read(SCAN, "scan data/clouds")
    bag = line.replace("data/clouds/cloud_00000.npz", "drive.mcap")
    assert "expected one of the clouds of drive.mcap: /points (1)" in walk.type(bag, code=1)
    scanned = walk.ask(bag, "--topic /points")
    assert len(scanned["ranges"]) == 32
    assert scanned["unknown_share"] < 0.2
    assert (walk.folder / "drive_scan.png").exists()


def test_a_wrong_mounting_is_said_with_the_option_that_mends_it(walk):
    """A cloud of a sensor that is given no height: the height is named."""
    walk.type(
        walk.read(SCAN, "clouds generate"),
        "--train 1 --validation 1 --workers 1 --set patch_size=40",
    )
    scores = walk.ask(walk.read(SCAN, "scan data/clouds"))
    assert 0.7 < scores["scores"]["accuracy"] <= 1.0
    rng = np.random.default_rng(0)
    ground = np.column_stack([rng.uniform(-8, 8, (20_000, 2)), rng.normal(-0.9, 0.01, 20_000)])
    np.savez(walk.folder / "mine.npz", points=ground.astype(np.float32))
    line = walk.read(SCAN, "scan my_cloud").replace("my_cloud.ply", "mine.npz")
    said = walk.type(line.replace("0.95", "0.0"))
    assert "--sensor-height should be about 0.9" in said
    assert "--sensor-height" not in walk.type(line.replace("0.95", "0.9"))


def test_a_drive_corrects_the_classifier_which_drives(walk):
    """The guide of adaptation: recall is kept, the file drives, and a short drive says why not."""
    walk.type(
        walk.read(SCAN, "clouds generate"),
        "--train 2 --validation 1 --workers 1 --set patch_size=40",
    )
    walk.type(walk.read(ADAPT, "drive --controller oracle"), SHORT)
    settings = "learned_share = 0.5\ngap = 0.0\nrecall_loss = 1.0\n"
    settings += "[labels]\ninterval = 0.1\n[forest]\ntrees = 3\n"
    (walk.folder / "brief.toml").write_text(settings)
    line = walk.read(ADAPT, "classifier adapt drive.mcap --clouds data/clouds --out")
    data = walk.ask(line, "--adaptation brief.toml")
    assert (walk.folder / "mine.npz").exists()
    assert data
    said = walk.type(walk.read(REPLAY, "bag replay"), "--forest mine.npz", code=1)
    assert "got 'oracle'; the oracle needs the true map: name another" in said
    said = walk.type(walk.read(REPLAY, "bag replay"), "--forest mine.npz --controller planner")
    assert "virtual scans" in said


@needs_dds
def test_a_navigator_without_a_robot_says_what_it_waits_for(tmp_path, monkeypatch):
    """ROS 2 without ROS: it starts, names the readings that are missing, and ends by Ctrl-C."""
    with domain(monkeypatch):
        command = [
            sys.executable,
            "-m",
            "andabata",
            "ros2",
            "navigator",
            "--controller",
            "reactive",
        ]
        process = subprocess.Popen(
            command,
            cwd=tmp_path,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
            stderr=subprocess.PIPE,
            text=True,
        )
        assert process.stderr is not None
        for line in process.stderr:
            if "no start yet" in line:
                break
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
    assert "expected /imu/data and /imu/mag and 3 good fixes of /fix" in line
    assert "or /initialpose" in line
    assert process.returncode == 130
    assert "Traceback" not in err
