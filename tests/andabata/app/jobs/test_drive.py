"""A drive that is asked for: what it writes and prints."""

import json

import pytest

from andabata.app.console import Console
from andabata.app.jobs.drive import DriveRequest, run_drive
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.evaluation.drive import Recording
from andabata.models import Models
from andabata.viewer.options import ViewConfig
from andabata.viewer.server import ViewServer


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


@pytest.mark.filterwarnings("ignore::ResourceWarning")
@pytest.mark.parametrize("waits", [True, False])
def test_a_drive_that_waits_for_a_page_begins_when_it_is_open(tmp_path, capsys, monkeypatch, waits):
    """The address and the wait are said before the drive; Ctrl-C ends both, and the page.

    Without ``waits`` the same drive begins at once.
    """
    closed = []

    def interrupt(server):
        raise KeyboardInterrupt

    monkeypatch.setattr(ViewServer, "wait_for_a_viewer", interrupt)
    close = ViewServer.close
    monkeypatch.setattr(ViewServer, "close", lambda self: (closed.append(self), close(self)))
    view = ViewConfig(port=0, speed=float("inf"), waits=waits)
    request = DriveRequest("hill", 7302, "straight", (), 1.0, view=view)
    config, console = SimulatedRobotConfig(plant="kinematic"), Console()
    if not waits:
        run_drive(request, config, Models(), tmp_path / "run", console)
    else:
        with pytest.raises(KeyboardInterrupt):
            run_drive(request, config, Models(), tmp_path / "run", console)
    error = capsys.readouterr().err
    assert "view: http://127.0.0.1:" in error
    assert ("the drive begins when the page is open" in error) == waits
    assert (tmp_path / "run/drive.json").exists() == (not waits)
    assert closed
