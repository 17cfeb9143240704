"""Tables of the results pages: made from stored rows; those whose rows are missing are named."""

import json
import re

import pytest

from andabata.machine.planar.lidar import PLANAR_LIDARS
from andabata.report.results_tables import (
    PAGES,
    StoredRows,
    laser_words,
    main,
    pages_of,
    rewritten,
    tables,
    write_tables,
)
from tests.support.documents import ROOT
from tests.test_quoted_figures import section

NOT_KEPT = {
    *("rooms-judging", "td3-judging", "barn-worlds", "barn-generated", "barn-mpc"),
    *("barn-distilled", "generalisation", "natural-test-300", "planner-20"),
    *("five-seeds", "mazes", "actor-critic"),
}
"""Names of the files that judged tables lack; there may only be fewer."""

ROW = {"policy": "a", "lidar": "ten-beams", "memory": "reactive", "trials": 4, "successes": 3}
ROW |= {"collisions": 1, "timeouts": 0}
ROWS = [ROW | {"room": "one"}, ROW | {"room": "two", "successes": 1}]
COLUMNS = "lidar,reached,success_rate"


@pytest.fixture
def run(tmp_path):
    """Return the folder of a finished run of two rooms."""
    folder = tmp_path / "run"
    folder.mkdir()
    about = {"verb": "evaluate", "command": "andabata evaluate", "commit": "abc"}
    (folder / "run.json").write_text(json.dumps(about))
    (folder / "evaluation.json").write_text(json.dumps({"rows": ROWS, "config": {}}))
    return folder


@pytest.fixture
def pages(tmp_path):
    """Return a folder of pages whose table is of other rows."""
    (tmp_path / "pages/data").mkdir(parents=True)
    text = "# Rooms\n\n<!-- table: rooms -->\n| typed |\n<!-- end of table -->\n\nAfter.\n"
    (tmp_path / "pages/rooms.md").write_text(text)
    (tmp_path / "pages/other.md").write_text("# Other\n")
    return tmp_path / "pages"


def test_tables_of_the_pages_are_those_of_the_stored_rows():
    """Nobody has typed into them, and each file has its table."""
    known = tables(ROOT / PAGES)
    texts = {page: page.read_text(encoding="utf-8") for page in pages_of(ROOT / PAGES)}
    assert all(rewritten(text, known) == text for text in texts.values())
    used = re.findall(r"<!-- table: ([a-z0-9-]+) -->", "".join(texts.values()))
    assert sorted(used) == sorted(known)
    assert known


def test_judged_tables_without_their_rows_are_named():
    """Each names the file that it lacks; the list may only get shorter."""
    text = (ROOT / PAGES / "data/README.md").read_text(encoding="utf-8")
    rows = re.findall(r"\| \[[^]]*\]\(\.\./([a-z0-9]+\.md)(#[^)]*)\) \| `([^`]*)\.json` \|", text)
    assert len(rows) == text.count(".json` |")
    for page, anchor, name in rows:
        assert "|---|" in section(ROOT / PAGES / page, anchor), (page, anchor)
        assert not (ROOT / PAGES / "data" / f"{name}.json").exists(), name
    assert {name for _, _, name in rows} <= NOT_KEPT


def test_lasers_of_the_judging_rooms_are_those_of_the_code():
    """Both tables begin their rows with what `--lidars all` drives."""
    text = section(ROOT / PAGES / "rooms.md", "#the-judging-rooms")
    heads = [line.split("|")[1].strip() for line in text.splitlines() if line.startswith("| ")]
    dense = [laser_words(name) for name in PLANAR_LIDARS if not name.startswith("ten-beams")]
    lasers = [*dense, "ten beams, 20 degrees apart", "ten beams, 5 cm forward"]
    for kind in ("laser, without a memory", "laser, with the map"):
        first = heads.index(kind) + 1
        assert heads[first : first + len(lasers)] == lasers


def test_a_laser_is_told_by_its_numbers():
    """Field of view, resolution and range; and where it is before the middle."""
    assert laser_words("220|1|5") == "220 degrees, 1, 5 m"
    assert laser_words("trained") == "that of its training"
    assert laser_words("ten-beams-forward") == "180 degrees, 20, 10 m, 5 cm forward"


def test_rows_of_a_run_are_stored_and_become_the_table(run, pages, capsys):
    """Counts of rooms are added up; the page keeps what is around its table."""
    words = ["--pages", str(pages), "--keep", str(run), "--name", "rooms", "--columns", COLUMNS]
    main([*words, "--over-rooms"])
    assert capsys.readouterr().out == f"{pages / 'rooms.md'}\n"
    stored = json.loads((pages / "data/rooms.json").read_text())
    assert (stored["command"], stored["commit"]) == ("andabata evaluate", "abc")
    assert stored["rows"] == ROWS
    lines = (pages / "data/rooms.json").read_text().splitlines()
    rows = [line for line in lines if line.startswith('{"collisions"')]
    assert [json.loads(row.rstrip(",")) for row in rows] == ROWS
    text = (pages / "rooms.md").read_text()
    lines = [
        "<!-- table: rooms -->",
        "| laser | reached | success |",
        "| --- | --- | --- |",
        "| 180 degrees, 20, 10 m | 4 of 8 | 0.50 [0.22, 0.78] |",
        "<!-- end of table -->",
    ]
    assert text == "# Rooms\n\n" + "\n".join(lines) + "\n\nAfter.\n"
    assert list(write_tables(pages)) == []
    main([*words[:-1], "room,reached"])
    assert (
        "| room | reached |\n| --- | --- |\n| one | 3 of 4 |\n| two | 1 of 4 |"
        in (pages / "rooms.md").read_text()
    )


def test_a_dated_run_stands_with_its_command_under_its_table(run, pages):
    """On the page of reliability, beside the folder: rows of any keys, as they are."""
    about = {"verb": "soak", "command": "soak --minutes 10", "commit": "abc", "date": "2026-11-27"}
    (run / "run.json").write_text(json.dumps(about))
    (run / "evaluation.json").write_text(json.dumps({"rows": [{"promise": "a", "kept": "yes"}]}))
    page = pages.parent / "reliability.md"
    page.write_text("# A\n\n<!-- table: soak -->\n<!-- end of table -->\n")
    (pages / "rooms.md").unlink()
    words = ["--pages", str(pages), "--keep", str(run), "--name", "soak"]
    main([*words, "--columns", "promise,kept"])
    table = "| promise | kept |\n| --- | --- |\n| a | yes |\n"
    assert f"{table}\n`soak --minutes 10`, commit abc, 2026-11-27.\n" in page.read_text()
    assert list(write_tables(pages)) == []


def test_figures_of_code_without_a_commit_are_not_stored(run):
    """Nobody could make them again."""
    for commit in (None, "abc+"):
        about = {"verb": "evaluate", "command": "andabata evaluate", "commit": commit}
        (run / "run.json").write_text(json.dumps(about))
        with pytest.raises(ValueError, match=r"expected a run of committed code, got commit"):
            StoredRows.of_run(run, ("reached",), False)


@pytest.mark.parametrize(
    ("command", "expected"),
    [
        ("andabata evaluate --out /tmp/x --json", "andabata evaluate --json"),
        ("andabata evaluate --out=a", "andabata evaluate"),
        (
            "andabata evaluate --worlds '/a b/BARN worlds'",
            "andabata evaluate --worlds 'BARN worlds'",
        ),
        ("andabata evaluate --set 'task.shield={}'", "andabata evaluate --set 'task.shield={}'"),
    ],
)
def test_a_published_command_names_no_folder_of_a_machine(command, expected, run):
    """Nor where its own run was written; all else is as it was given."""
    about = {"verb": "evaluate", "command": command, "commit": "abc"}
    (run / "run.json").write_text(json.dumps(about))
    assert StoredRows.of_run(run, ("reached",), False).command == expected


def test_rows_of_the_benchmark_count_their_runs(run):
    """They have no trials."""
    row = {"controller": "mpc", "runs": 10, "successes": 9}
    (run / "evaluation.json").write_text(json.dumps({"rows": [row]}))
    stored = StoredRows.of_run(run, ("controller", "reached"))
    assert "| mpc | 9 of 10 |" in stored.table()


def test_missing_rows_and_options_are_named(run, pages):
    """A page whose rows are not stored, a damaged file, and half of the options."""
    with pytest.raises(ValueError, match=r"table rooms: expected data/rooms\.json, got none"):
        list(write_tables(pages))
    (pages / "data/rooms.json").write_text('{"rows": []}')
    with pytest.raises(ValueError, match=r"rooms\.json: command: .*; store it again with --keep"):
        tables(pages)
    for words in ((), ("--name", "rooms"), ("--columns", "reached")):
        with pytest.raises(SystemExit):
            main(["--pages", str(pages), "--keep", str(run), *words])
