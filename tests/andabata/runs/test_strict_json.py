"""JSON that every reader takes."""

import json

import numpy as np
import pytest

from andabata.runs.folder import write_json
from andabata.runs.journal import Journal
from andabata.runs.strict_json import dumps, finite

DATA = {"a": [1.5, float("nan")], "b": {"c": float("inf")}, "d": (np.float64("-inf"), "nan", 3)}
STRICT = {"a": [1.5, None], "b": {"c": None}, "d": [None, "nan", 3]}


def refuse(word):
    """Refuse a constant that is no JSON."""
    raise ValueError(word)


def test_numbers_that_are_not_finite_become_null():
    """At any depth; all else stays, and the data themselves do, too."""
    assert finite(DATA) == STRICT
    assert DATA["b"] == {"c": float("inf")}
    assert json.loads(dumps(DATA, indent=1), parse_constant=refuse) == STRICT
    with pytest.raises(ValueError, match="NaN"):
        json.loads(json.dumps(DATA), parse_constant=refuse)


def test_files_of_runs_are_strict(tmp_path):
    """A file of results, and a journal, which is the same when it is read again."""
    write_json(tmp_path / "a.json", DATA)
    assert json.loads((tmp_path / "a.json").read_text(), parse_constant=refuse) == STRICT
    journal = Journal(tmp_path / "b.jsonl", DATA)
    journal.append(DATA)
    again = Journal(tmp_path / "b.jsonl", DATA)
    assert journal.entries == again.entries == [STRICT]
    for line in (tmp_path / "b.jsonl").read_text().splitlines():
        json.loads(line, parse_constant=refuse)
