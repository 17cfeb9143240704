"""Run folders of drives: frames along the path, and folders that are none."""

import json

import numpy as np
import pytest

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.report.folder import RunFolderError
from andabata.viewer.recorded_drive import RecordedPath, resting_pose


@pytest.fixture
def folder(tmp_path):
    """Return the folder of a drive of 2 s along y in a plain world, after a second of standing."""
    path = [[1.0, 2.0, 0.0]] * 10 + [[1.0, 2.0 + 0.03 * k, 0.0] for k in range(11)]
    attempt = {"goal": 1, "outcome": "goal", "time_s": 2.0}
    data = {
        "controller": "planner",
        "world": "plain",
        "world_seed": 7,
        "goals": [[1.0, 9.0], [3.0, 9.0]],
        "attempts": [attempt],
        "path": path,
    }
    about = {"verb": "drive", "config": SimulatedRobotConfig().model_dump(mode="json")}
    (tmp_path / "drive.json").write_text(json.dumps(data))
    (tmp_path / "run.json").write_text(json.dumps(about))
    return tmp_path


def test_the_robot_looks_where_it_goes(folder):
    """A frame for each position: heading, speed and wheels follow from the path."""
    recorded = RecordedPath.read(folder)
    frames = recorded.frames()
    assert len(frames) == 21
    assert recorded.title == "planner in plain 7: 1 of 2 goals"
    last = frames[-1]
    assert last.pose.yaw == pytest.approx(np.pi / 2)
    assert last.twist.linear == pytest.approx(0.3)
    assert last.wheels.left == pytest.approx(3.0)
    assert last.goal.tolist() == [1.0, 9.0]
    assert frames[3].twist.linear == 0
    assert [frame.n_positions for frame in frames] == list(range(1, 22))


def test_a_resting_robot_lies_on_the_slope(make_ground):
    """Nose up on a hill that rises ahead, and level along it."""
    world = make_ground(lambda x, y: 0.2 * x)
    ahead = resting_pose(world, np.zeros(3), 0.0).matrix[:3, 0]
    assert ahead[2] / ahead[0] == pytest.approx(0.2, abs=1e-6)
    left = resting_pose(world, np.zeros(3), np.pi / 2).matrix[:3, 1]
    assert left[2] / -left[0] == pytest.approx(-0.2, abs=1e-6)


def test_incomplete_folders_are_refused(folder):
    """Without its files, and without what they should hold, the error says so."""
    data = json.loads((folder / "drive.json").read_text())
    del data["world_seed"]
    (folder / "drive.json").write_text(json.dumps(data))
    with pytest.raises(RunFolderError, match=r"expected a drive of this version.*world_seed"):
        RecordedPath.read(folder)
    (folder / "drive.json").unlink()
    with pytest.raises(RunFolderError, match=r"expected drive.json and run.json"):
        RecordedPath.read(folder)
