"""The command: a table of the rows, an exit code, and a run that goes on where it was."""

import importlib
import json

import pytest

from andabata.bench.studies.soak.outcome import Outcome
from andabata.runs.journal import Journal

soak = importlib.import_module("andabata.bench.studies.soak.__main__")
GOOD = Outcome(trials=3, figure="all well")
BAD = Outcome(trials=3, figure="not", failed=2, failures=("first", "second"))


@pytest.fixture
def ran(monkeypatch):
    """Return the checks that were run, whose outcome is good but for the gate."""
    found = []

    def run(promise, count, folder, time_limit):
        found.append((promise.name, count))
        return BAD if promise.name == "gate" else GOOD

    monkeypatch.setattr(soak, "run_apart", run)
    return found


def test_the_table_has_a_row_for_each_promise(ran, capsys):
    """The command fails where a promise was not kept, and says which."""
    assert soak.main(["--minutes", "10", "--only", "kalman", "gate"]) == 1
    out, err = capsys.readouterr()
    assert [line.split(" | ")[-1] for line in out.splitlines()[2:]] == ["no |", "yes |"]
    assert "error: gate: 2 failures\nerror: gate: first\nerror: gate: second\n" in err
    assert ran == [("gate", 100_000), ("kalman", 10_000)]
    assert soak.main(["--only", "kalman", "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)["rows"]
    assert (row["kept"], row["figure"]) == ("yes", "all well")


def test_a_run_goes_on_where_it_was(ran, tmp_path):
    """What is in its journal is not run again; its folder says how it was made."""
    out = tmp_path / "run"
    soak.main(["--minutes", "1", "--only", "kalman", "--out", str(out)])
    soak.main(["--minutes", "1", "--only", "kalman", "covariance", "--out", str(out)])
    assert [name for name, _ in ran] == ["kalman", "covariance"]
    about = json.loads((out / "run.json").read_text())
    assert about["command"] == f"{soak.COMMAND} --minutes 1 --only kalman covariance"
    assert len(about["date"]) == 10
    assert len(json.loads((out / "evaluation.json").read_text())["rows"]) == 2


def test_another_length_is_another_run(ran, tmp_path):
    """Figures of both in one table would be nobody's."""
    soak.main(["--minutes", "1", "--only", "kalman", "--out", str(tmp_path)])
    with pytest.raises(ValueError, match="differs in minutes"):
        soak.main(["--minutes", "2", "--only", "kalman", "--out", str(tmp_path)])
    assert Journal(None, {}).entries == []


def test_code_that_changes_while_it_runs_is_an_error(ran, monkeypatch, capsys):
    """Its figures are of no commit."""
    later = iter(("abc", "def"))
    monkeypatch.setattr(soak, "_description", lambda argv: {"commit": "abc"})
    monkeypatch.setattr(soak, "commit", lambda: next(later))
    assert soak.main(["--only", "kalman"]) == 1
    assert "error: commit: expected abc until the end, got def; " in capsys.readouterr().err
