"""``andabata faults``: the list, one table, going on after a kill, and its errors."""

import json

import pytest

from andabata.app.cli import main
from andabata.machine.faults import Fault

QUICK = [
    *("--world", "maze", "--controllers", "straight", "--trials", "2", "--workers", "1"),
    *("--set", "simulated_robot.plant=kinematic", "--set", "terminations.time_limit=4"),
    *("--set", "simulated_robot.sensing.scanner=horizontal", "--onset", "1"),
]


def result(capsys, *words):
    """Run a command that has to end well and return its JSON."""
    assert main([*words, "--json", "--quiet"]) == 0
    out = capsys.readouterr().out
    assert out.count("\n") == 1
    return json.loads(out)


def test_the_list_has_every_sense_and_kind(capsys):
    """Each typical fault is one; for people there are tables."""
    data = result(capsys, "faults", "--list")
    assert [each["sense"] for each in data["senses"]] == [
        "laser",
        "gnss",
        "compass",
        "imu",
        "wheels",
    ]
    assert len(data["typical"]) == 40
    assert all(str(Fault.parse(text)) == text for text in data["typical"])
    assert main(["faults", "--list"]) == 0
    assert "the last values repeat" in capsys.readouterr().out


def test_one_table_of_senses_and_kinds_goes_on_after_a_kill(capsys, tmp_path):
    """The robot without a fault first; rows are those of the journal and of ``evaluate``."""
    words = ["--senses", "laser,imu", "--kinds", "off,stuck"]
    data = result(capsys, "faults", *QUICK, *words, "--out", str(tmp_path / "a"))
    rows = data["faults"]
    names = ["laser:off@1", "laser:stuck@1", "imu:off@1", "imu:stuck@1"]
    assert [row["fault"] for row in rows] == ["", *names]
    assert {row["faulty"] for row in rows} == {2}
    by_name = {row["fault"]: row for row in rows}
    assert by_name["imu:off@1"]["flagged_within_2_s"] == 2
    assert by_name[""]["flagged"] == 0
    assert all(row["bad_commands"] == 0 for row in rows)

    journal = tmp_path / "a/trials.jsonl"
    lines = journal.read_text().splitlines()
    kept = json.loads(lines[1])["rows"]
    assert [row["controller"] for row in kept] == ["straight", *(f"straight@{n}" for n in names)]
    assert kept[3]["fault_response"]["flagged_after_s"] is not None
    journal.write_text("\n".join(lines[:2]) + "\n" + lines[2][:40])  # A kill in the second trial.
    assert result(capsys, "faults", *QUICK, *words, "--out", str(tmp_path / "a"))["faults"] == rows

    evaluate = [*QUICK[:-2], "--goals", "1", "--seed", "7300", "--faults", ",".join(names)]
    again = result(capsys, "evaluate", *evaluate)
    assert again["faults"] == rows
    assert {row["controller"] for row in again["rows"]} == {row["controller"] for row in kept}


def test_people_see_the_tables_of_faults_and_a_page(capsys, tmp_path):
    """The verb prints these alone; evaluate prints them after its own; a report has them."""
    words = [*QUICK, "--senses", "imu", "--kinds", "off", "--quiet"]
    assert main(["faults", *words, "--out", str(tmp_path)]) == 0
    out = capsys.readouterr().out
    assert out.startswith("straight, each fault alone from 1 s on")
    assert "what each fault costs" in out
    assert main(["report", str(tmp_path), "--quiet"]) == 0
    assert "straight, each fault alone from 1 s on" in capsys.readouterr().out
    assert '<h2 id="faults">' in (tmp_path / "report.html").read_text()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["faults", "--senses", "gps"], "--senses: expected some of laser, gnss, compass, imu"),
        (["faults", "--kinds", "frozen"], "--kinds: expected some of off, stuck, garbage"),
        (["faults", "--onset", "-1"], "--onset': Input should be greater than or equal to 0"),
        (["faults", "--controllers", "nobody"], "--controllers: expected some of"),
        (["evaluate", "--faults", "gnss:jump@20"], "--faults: gnss:jump: expected a number"),
        (["evaluate", "--faults", "imu:off,imu:off"], "faults: expected each fault once, got imu"),
        (["evaluate", "--task", "spn", "--faults", "imu:off"], "--faults: expected options of"),
        (["evaluate", "--release", "9.9.9", "--faults", "imu:off"], "expected no --faults beside"),
        (["drive", "--faults", "gps:off"], "--faults: fault: expected a sense of laser"),
        (["bag", "replay", "x.bag", "--faults", "imu:off@-1"], "expected an onset of 0 s or more"),
    ],
)
def test_what_is_no_fault_ends_with_one_line(capsys, words, message):
    """Before anything is driven or read."""
    assert main(words) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert message in error
