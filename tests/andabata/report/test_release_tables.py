"""Tables that judge a release: their commands, and what is stored of them."""

import json
import sys

import pytest

from andabata.evaluation.judging import JUDGED_WORLDS
from andabata.report import release_tables as module
from andabata.report.columns import COLUMNS
from andabata.report.release_tables import ReleaseTable, main, release_tables
from andabata.report.run_folders import EVALUATION

TOY = ReleaseTable(command="evaluate --release {release}", columns="controller,goal,successes")


def test_every_world_that_judges_has_a_table_and_every_column_words():
    """Placeholders are filled in; BARN's worlds have to be given."""
    known = release_tables()
    for world in JUDGED_WORLDS:
        assert world in known
    for name, table in known.items():
        words = table.words("0.2.0", None)
        assert (words is None) == (name == "barn")
        if name.startswith("barn-"):
            assert "first_seed=150000" in words
        elif words is not None:
            assert words[words.index("--release") + 1] == "0.2.0"
        for columns in (table.columns, table.differences, table.failures):
            assert {*filter(None, columns.split(","))} <= {"reached", *COLUMNS}
    assert known["td3-shield"].words("0.2.0", None)[-1] == "task.shield={}"
    assert known["barn"].words("0.2.0", "worlds")[-3:] == ["worlds", "--trials", "10"]


@pytest.fixture
def toy(monkeypatch, tmp_path):
    """Patch the tables to two toys, and the command to a script; return the folder of tables."""
    monkeypatch.setattr(module, "release_tables", lambda: {"first": TOY, "second": TOY})
    script = tmp_path / "toy"
    script.write_text(
        "#!/bin/sh\nfor word; do last=$word; done\n"
        "test -e $(dirname $0)/broken && exit 3\n"
        "mkdir -p $last; echo $@ >> $last/calls\n"
    )
    script.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(script))
    return tmp_path / "out"


def test_what_is_finished_is_left_out_and_the_first_failure_ends_it(toy, tmp_path):
    """The exit code is that of the command; nothing of a table that failed is stored."""
    (tmp_path / "broken").touch()
    assert main(["0.2.0", "--out", str(toy)]) == 3
    (tmp_path / "broken").unlink()
    for _ in range(2):
        assert main(["0.2.0", "--out", str(toy)]) == 0
    for name in ("first", "second"):
        (call,) = (toy / name / "calls").read_text().splitlines()
        assert call == f"-m andabata evaluate --release 0.2.0 --out {toy / name}"
    with pytest.raises(SystemExit):
        main(["0.2.0", "--out", str(toy), "--only", "third"])


def test_rows_of_finished_tables_are_stored(toy, tmp_path, capsys):
    """Under the name of the table, with command and commit."""
    pages = tmp_path / "pages"
    (pages / "data").mkdir(parents=True)
    main(["0.2.0", "--out", str(toy), "--only", "second"])
    rows = [{"controller": "planner", "goal": 1, "successes": 3}]
    (toy / "second" / EVALUATION).write_text(json.dumps({"rows": rows}))
    about = {"command": "andabata evaluate", "commit": "0123456789ab", "date": "2026-11-28"}
    (toy / "second/run.json").write_text(json.dumps(about))
    assert main(["0.2.0", "--out", str(toy), "--keep", "--pages", str(pages)]) == 0
    (path,) = (pages / "data").iterdir()
    assert path.name == "judged-second.json"
    stored = json.loads(path.read_text())
    assert (stored["commit"], stored["rows"]) == ("0123456789ab", rows)
    assert capsys.readouterr().out == f"{path}\n"


def test_pairs_and_failures_of_a_table_are_stored_beside_it(toy, tmp_path, monkeypatch):
    """Those that the table asks for, each with the command that made them."""
    table = ReleaseTable(command="evaluate", columns="goal", failures="cause", differences="both")
    monkeypatch.setattr(module, "release_tables", lambda: {"first": TOY, "second": table})
    main(["0.2.0", "--out", str(toy)])
    parts = {"rows": [{"goal": 1}], "differences": [{"both": 2}], "failures": [{"cause": "rock"}]}
    about = {"command": "andabata evaluate", "commit": "0123456789ab", "date": "2026-11-28"}
    for name in ("first", "second"):
        (toy / name / EVALUATION).write_text(json.dumps(parts))
        (toy / name / "run.json").write_text(json.dumps(about))
    (tmp_path / "pages/data").mkdir(parents=True)
    assert main(["0.2.0", "--out", str(toy), "--keep", "--pages", str(tmp_path / "pages")]) == 0
    stored = {
        path.stem: json.loads(path.read_text()) for path in (tmp_path / "pages/data").iterdir()
    }
    ends = {"second": "rows", "second-differences": "differences", "second-failures": "failures"}
    assert {*stored} == {"judged-first", *(f"judged-{end}" for end in ends)}
    for end, part in ends.items():
        assert stored[f"judged-{end}"]["rows"] == parts[part]
        assert stored[f"judged-{end}"]["columns"] == list(parts[part][0])
