"""A drive that is asked for: what it writes and prints."""

import json

from andabata.app.console import Console
from andabata.app.drive_run import DriveRequest, run_drive
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.evaluation.drive import Recording
from andabata.models import Models


def test_folder_clip_and_recording_belong_to_one_drive(tmp_path, capsys):
    """All three are written, and the printed result names them."""
    clip, bag = tmp_path / "clips/drive.gif", tmp_path / "drive.mcap"
    request = DriveRequest(
        world="hill",
        seed=7302,
        controller="straight",
        goals=((20.0, -9.0),),
        time_limit=1.0,
        record=Recording(bag, clouds=False),
        clip=clip,
    )
    config = SimulatedRobotConfig(plant="kinematic")
    run_drive(request, config, Models(), tmp_path / "run", Console(quiet=True, as_json=True))
    found = json.loads(capsys.readouterr().out)
    assert found["goals"] == [[20.0, -9.0]]
    assert found["record"] == str(bag)
    assert bag.stat().st_size > 0
    assert clip.read_bytes().startswith(b"GIF8")
    assert "view" not in found
    kept = json.loads((tmp_path / "run/drive.json").read_text())
    assert kept["attempts"] == found["attempts"]
    assert kept["attempts"][0]["outcome"] == "timeout"
