"""Check of the chain: what counts as slower, whatever machine measures."""

import json

import numpy as np
import pytest

from andabata.bench import chain_check
from andabata.bench.chain_check import TABLE, main, ratios_of, reference_time, slower, to_bytes

SHIPPED = {"robot": {"cast": 2.0, "plan": 1.0, "policy": 0.1}}


def test_a_stage_that_has_grown_by_more_than_half_is_told():
    """Half more passes, more does not; times are those of the machine that measures."""
    assert slower(SHIPPED, {"robot": {"cast": 3.0, "plan": 0.5, "policy": 0.1}}, 100.0) == []
    (found,) = slower(SHIPPED, {"robot": {"cast": 3.1, "plan": 1.0, "policy": 0.1}}, 100.0)
    assert (found["robot"], found["stage"]) == ("robot", "cast")
    assert found["shipped [us]"] == pytest.approx(200.0)
    assert found["now [us]"] == pytest.approx(310.0)


def test_a_small_stage_may_double():
    """What grows by some microseconds is noise."""
    assert slower(SHIPPED, {"robot": {"cast": 2.0, "plan": 1.0, "policy": 0.3}}, 100.0) == []


@pytest.mark.parametrize("missing", ["cast", "plan"])
def test_a_stage_without_a_counterpart_is_told(missing):
    """In either table: a stage that is renamed needs a new table."""
    less = {"robot": {name: value for name, value in SHIPPED["robot"].items() if name != missing}}
    for pair in ((SHIPPED, less), (less, SHIPPED)):
        (found,) = slower(*pair, 100.0)
        assert found["stage"] == missing


def test_ratios_leave_out_what_is_no_time():
    """Rows in microseconds are divided by the reference."""
    rows = [
        {"subject": "a", "name": "x", "value": 50.0, "unit": "us"},
        {"subject": "a", "name": "faster than life", "value": 70.0, "unit": "1"},
    ]
    assert ratios_of(rows, 100.0) == {"a": {"x": 0.5}}


def test_the_shipped_table_has_three_plants_and_all_stages():
    """It is what ``--write`` writes."""
    table = json.loads(TABLE.read_text())
    assert [subject.split(",")[0] for subject in table] == ["kinematic", "wheels", "bullet"]
    assert all(
        {"cast, noise", "ground cells", "plan", "whole step"} <= set(one) for one in table.values()
    )
    assert to_bytes(table) == TABLE.read_bytes()


def test_the_program_fails_where_a_stage_is_slower(monkeypatch, capsys):
    """The table of what is slower is printed; nothing is, where all is as it was."""
    table = json.loads(TABLE.read_text())
    monkeypatch.setattr(chain_check, "measured", lambda steps, runs: (table, 100.0))
    main([])
    slow = {
        subject: {name: 9 * one for name, one in all_.items()} for subject, all_ in table.items()
    }
    monkeypatch.setattr(chain_check, "measured", lambda steps, runs: (slow, 100.0))
    with pytest.raises(SystemExit, match="--write"):
        main([])
    assert "ground cells" in capsys.readouterr().out


def test_the_reference_is_a_time():
    """It is finite and above zero."""
    assert 0 < reference_time() < np.inf
