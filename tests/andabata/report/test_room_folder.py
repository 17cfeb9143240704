"""Folder of an evaluation in rooms: policies and drives keep their numbers."""

from andabata.app.console import Console
from andabata.app.jobs.evaluation import run_evaluation
from andabata.app.jobs.rooms import policy_evaluation
from andabata.engine import SerialEngine
from andabata.evaluation.room_table import Cell
from andabata.evaluation.rooms import RoomEvaluationConfig
from andabata.report.room_folder import RoomFolder
from tests.support.room_policies import point_policy


def test_policies_keep_their_drives_whatever_their_names(tmp_path):
    """The first policy's drives are its own, although another comes first in the alphabet."""
    policies = {"walker": point_policy(0), "arrow": point_policy(1)}
    config = RoomEvaluationConfig(
        rooms=("spn-env0",), lidars=("ten-beams",), memories=("reactive",), pairs=2
    )
    made = policy_evaluation(config, policies)
    run_evaluation(made, SerialEngine(), tmp_path, Console(quiet=True))
    folder = RoomFolder(tmp_path)
    assert list(folder.policies) == ["walker", "arrow"]
    for name, policy in policies.items():
        assert folder.policies[name].to_bytes() == policy.to_bytes()
        drives = folder.drives(Cell(name, "ten-beams", "spn-env0", "reactive"))
        (row,) = [row for row in folder.result["rows"] if row["policy"] == name]
        assert row["mean_steps"] == sum(drive.detail.steps for drive in drives) / 2
