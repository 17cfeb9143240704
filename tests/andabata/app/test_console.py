"""Console: results on stdout, status and progress on stderr."""

import json
import math
import os

import pytest

from andabata.app.console import Console, table_of


@pytest.mark.parametrize("quiet", [False, True])
def test_status_goes_to_stderr_unless_quiet(capsys, quiet):
    """Status is a line on stderr, with brackets as they are; quiet drops it."""
    Console(quiet).status("[bold] x")
    assert capsys.readouterr() == ("", "" if quiet else "[bold] x\n")


def test_json_is_one_strict_object(capsys):
    """JSON holds null for numbers that are not finite, and no text for people."""
    data = {"a": math.nan, "b": [math.inf, (1.5, True, None)], "c": {2: -math.inf}}
    Console(as_json=True).result(data, "text")
    out = capsys.readouterr().out
    assert out.count("\n") == 1
    expected = {"a": None, "b": [None, [1.5, True, None]], "c": {"2": None}}
    assert json.loads(out, parse_constant=pytest.fail) == expected


def test_parts_are_printed_in_order_even_when_quiet(capsys):
    """Long lines of a text are not wrapped, and brackets are no markup."""
    line = "x" * 200 + " [red] " + "y" * 50
    Console(quiet=True).result({}, table_of([{"name": "a"}], "title"), line, "last")
    lines = [text.rstrip() for text in capsys.readouterr().out.splitlines()]
    assert lines[0] == "title"
    assert lines[-2:] == [line, "last"]


def test_progress_advances_and_shows_its_note(capsys):
    """The bar ends at the number of steps, with the last note."""
    with Console().progress("episodes", 3) as step:
        step(2)
        step(note="done")
    err = capsys.readouterr().err
    assert "episodes" in err
    assert "3/3" in err
    assert "done" in err


def test_a_quiet_console_has_no_bar(capsys):
    """Quiet progress prints nothing."""
    with Console(quiet=True).progress("episodes", None) as step:
        step()
    assert capsys.readouterr() == ("", "")


def test_tables_round_numbers_and_mark_missing_ones(capsys):
    """Floats have three digits; None, and keys that only the first row has, are dashes."""
    rows = [{"name": "a", "value": 0.12345, "n": 3}, {"name": "b", "value": None}]
    Console().result({}, table_of(rows))
    words = [line.split() for line in capsys.readouterr().out.splitlines() if line.strip()]
    assert words[0] == ["name", "value", "n"]
    assert words[-2:] == [["a", "0.123", "3"], ["b", "-", "-"]]


def test_a_table_of_nothing_is_empty(capsys):
    """No rows make a table without columns."""
    Console().result({}, table_of([]))
    assert capsys.readouterr().out.strip() == ""


def test_names_that_are_no_unicode_are_replaced_everywhere(capsys):
    """Status, texts, tables and JSON take any file's name."""
    name = os.fsdecode(b"\xf1")
    console = Console()
    console.status(f"{name} read")
    console.result({}, f"{name} done", table_of([{"name": name}], name))
    out, err = capsys.readouterr()
    assert err == "\ufffd read\n"
    assert out.count("\ufffd") == 3
    Console(as_json=True).result({name: [name]})
    assert json.loads(capsys.readouterr().out) == {"\ufffd": ["\ufffd"]}
