"""The verb without a command, whose help ends with examples that parse; fields that judge."""

import json
import shlex

from andabata.app.cli import main
from andabata.app.command import examples
from andabata.evaluation.ledger import read_ledger
from tests.support.documents import complaint, verbs

HELP = dict(verbs())["bench"].help


def test_help_of_the_group_ends_with_examples():
    """They are calls of the verb itself with options that it has."""
    lines = examples(HELP)
    assert 2 <= len(lines) <= 5
    for line in lines:
        words = shlex.split(line)
        assert words[:2] == ["andabata", "bench"]
        assert all(word.startswith("--") for word in words[2:3])
        assert complaint(line) is None
        assert len(line) <= 74


def test_fields_judge_a_release_once(capsys, tmp_path, monkeypatch):
    """The suite is that of the release, which the ledger has; tried with a patched split."""
    suites = []

    def scores(forest, count, seed, workers, on_case, release=None):
        suites.append((count, seed, release))
        return []

    monkeypatch.setattr("andabata.bench.fields.evaluate_fields", scores)
    monkeypatch.setattr("andabata.bench.fields.field_table", lambda rows: rows)
    monkeypatch.setattr("worlds.splits.JUDGING_START", 100_000)
    monkeypatch.setattr("andabata.evaluation.ledger.commit", lambda: "0123456789ab")
    path = tmp_path / "own.jsonl"
    path.touch()
    words = ["bench", "fields", "--json", "--release", "0.0.2", "--ledger", str(path)]
    assert main(words) == 0
    data = json.loads(capsys.readouterr().out)
    assert suites == [(200, 108000, "0.0.2")]
    (entry,) = read_ledger(path)
    assert data["ledger"] == entry.model_dump(mode="json")
    assert (entry.table, entry.seeds) == ("bench fields", "suite 108000, 200 fields")
    assert main(words) == 1
    assert "expected a release that bench fields has not judged" in capsys.readouterr().err
    for more, message in (
        (["--seed", "1"], "--release: expected no --seed"),
        (["--picture", "x.png"], "--release: expected no --picture"),
        (["--count", "12"], "--count: expected 200 or more"),
    ):
        assert main([*words, *more]) == 2
        assert message in capsys.readouterr().err
    assert main(["bench", "fields", "--json"]) == 0
    assert suites[1:] == [(200, 1, None)]


def test_movers_are_told_by_range_and_speed(capsys):
    """As JSON and as tables; lasers that are none are refused."""
    words = ["bench", "movers", "--lasers", "planar", "--count", "1", "--seconds", "0.5"]
    assert main([*words, "--workers", "1", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert {row["laser"] for row in data["ranges"]} == {"planar"}
    assert len(data["speeds"]) == 5
    assert {"found", "missed", "velocity_error_m_s"} <= set(data["ranges"][0])
    assert [row["world"] for row in data["drives"]] == [
        "clutter-movers",
        "clutter",
        "barn-moving-medium",
    ]
    assert main([*words, "--workers", "1", "--quiet", "--set", "circles.min_speed=0.5"]) == 0
    assert "movers in sight, by range" in capsys.readouterr().out
    assert main(["bench", "movers", "--lasers", "eye"]) == 2
    assert "--lasers: expected some of planar" in capsys.readouterr().err
