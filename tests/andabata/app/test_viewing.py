"""Views of run folders and recordings: which is which, and pages that play by themselves."""

import json
import time

import pytest

from andabata.app.cli import main
from andabata.bench import chromium
from tests.support.canvases import canvas_colours

pytestmark = [
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]


PATIENCE = 120.0
"""Longest time that a browser gets [s]."""


def failed(capsys, *words):
    """Return exit code and error of a command."""
    code = main(["view", *map(str, words)])
    return code, capsys.readouterr().err


@pytest.mark.parametrize("name", ["nothing", "text.txt"])
def test_what_is_neither_run_nor_recording_is_refused(capsys, tmp_path, name):
    """Both kinds are named."""
    (tmp_path / "text.txt").write_text("hello")
    code, error = failed(capsys, tmp_path / name)
    assert code == 2
    assert "expected a run folder or a recording" in error


def test_a_folder_without_a_run_is_refused(capsys, tmp_path):
    """So is a run of another kind, with what shows it."""
    code, error = failed(capsys, tmp_path)
    assert code == 1
    assert "run folder with run.json" in error
    (tmp_path / "run.json").write_text(json.dumps({"verb": "train"}))
    code, error = failed(capsys, tmp_path)
    assert code == 1
    assert "andabata report" in error


def test_a_page_has_to_be_html(capsys, tmp_path):
    """Other names are refused before anything is done."""
    code, error = failed(capsys, tmp_path, "--out", "page.pdf")
    assert code == 2
    assert "ends in .html" in error


@pytest.fixture(scope="module")
def rooms(tmp_path_factory):
    """Return the folder of a small evaluation in rooms."""
    folder = tmp_path_factory.mktemp("rooms") / "spn"
    words = ["--rooms", "spn-env1", "--lidars", "ten-beams", "--set", "pairs=1"]
    words += ["--set", 'memories=["reactive"]', "--workers", "1", "--quiet", "--json"]
    assert main(["evaluate", "--task", "spn", *words, "--out", str(folder)]) == 0
    return folder


@pytest.fixture(scope="module")
def page_file(tmp_path_factory):
    """Return the path of the page of a drive."""
    return tmp_path_factory.mktemp("pages") / "new" / "page.html"


def test_a_drive_in_a_room_becomes_one_page(capsys, rooms, page_file):
    """It needs no server and no network: no address but those of standards stands in it."""
    page = page_file
    assert main(["view", str(rooms), "--out", str(page), "--json", "--quiet"]) == 0
    assert json.loads(capsys.readouterr().out) == {"run": str(rooms), "page": str(page)}
    text = page.read_text()
    assert "__VISER_EMBED_DATA__" in text
    assert "<script src=" not in text


@pytest.mark.skipif(chromium.missing() is not None, reason=str(chromium.missing()))
def test_the_page_plays_in_a_browser_without_a_server(page_file):
    """The canvas is not blank, it changes by itself, and the console is quiet."""
    errors = []
    with chromium.browser() as browser:
        page = browser.new_page(viewport={"width": 260, "height": 200})
        page.set_default_timeout(1000 * PATIENCE)
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(page_file.as_uri())
        drawn = set()
        end = time.monotonic() + PATIENCE
        while len(drawn) < 2 and time.monotonic() < end:
            if canvas_colours(page) > 20:
                drawn.add(page.screenshot())
    assert len(drawn) == 2
    assert errors == []


def test_a_drive_that_there_is_not_is_refused(capsys, rooms):
    """What there is to choose from is named."""
    code, error = failed(capsys, rooms, "--first", "room=nowhere")
    assert code == 2
    assert "expected room of spn-env1" in error
    code, error = failed(capsys, rooms, "--first", "colour=red")
    assert "policy, room, laser, memory, drive" in error
