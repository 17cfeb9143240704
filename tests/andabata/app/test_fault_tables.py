"""Tables and texts of faults for people."""

from rich.console import Console

from andabata.app.fault_tables import catalogue, catalogue_tables, fault_tables, fault_text
from andabata.machine.faults import KINDS, SENSES, Fault


def printed(part):
    """Return a table as a terminal of 80 columns shows it."""
    console = Console(width=80)
    with console.capture() as shown:
        console.print(part)
    return shown.get()


def row(fault="", onset=None, **changes):
    """Return a row of ``fault_rows``."""
    known = {
        **{"controller": "planner", "fault": fault, "onset_s": onset, "trials": 5, "successes": 4},
        **{"faulty": 4, "flagged": 0, "flagged_within_2_s": 0, "flagged_after_s": None},
        **{"contacts": 0, "contacts_after_flag": 0, "bad_commands": 0},
        **{"health_at_end": {"ok": 4}, "position_error_m": 0.52},
        **{"difference": None, "difference_low": None, "difference_high": None},
        **{"mcnemar_gained": None, "mcnemar_lost": None, "mcnemar_p": None},
    }
    return known | changes


COST = {"difference_low": -0.6, "difference_high": 0.2, "mcnemar_gained": 0, "mcnemar_p": 1.0}
STUCK = row(
    "compass:intermittent=4@20",
    20.0,
    **{"flagged": 3, "flagged_within_2_s": 1, "flagged_after_s": 5.31, "contacts": 2},
    **{"contacts_after_flag": 1, "bad_commands": 7, "position_error_m": 9.7},
    **{"health_at_end": {"lost": 4}, "difference": -0.2, "mcnemar_lost": 1, **COST},
)
OFF = row("laser:off@20", 20.0, successes=2, difference=-0.4, mcnemar_lost=2, **COST)


def test_what_the_robot_says_and_what_it_costs_stand_apart():
    """Responses in the order of the faults after the robot without; costs by their size."""
    text = printed(fault_tables([row(), STUCK, OFF]))
    says, costs = text.split("what each fault costs; 4/5 without any")
    assert "each fault alone from 20 s on" in says
    lines = [line.split() for line in says.splitlines() if "/4" in line]
    assert lines[0] == ["none", "0/4", "0", "-", "0", "(0)", "0", "0.5", "m", "4"]
    assert " ".join(lines[1]) == "compass:intermittent=4 3/4 1 5.3 s 2 (1) 7 9.7 m 0"
    assert lines[2][:2] == ["laser:off", "0/4"]
    first, second = (line.split() for line in costs.splitlines() if "/5" in line)
    assert " ".join(first) == "laser:off 2/5 -40 (-60 to +20) 2 0 1"
    assert second[:2] == ["compass:intermittent=4", "4/5"]
    assert max(len(line.rstrip()) for line in text.splitlines()) <= 80


def test_onsets_that_differ_stand_with_their_faults():
    """And not in the title."""
    text = printed(fault_tables([row(), STUCK, OFF | {"fault": "laser:off@7", "onset_s": 7.0}]))
    assert "laser:off@7 " in text
    assert "each fault alone; hit" in text


def test_each_controller_has_its_own_tables():
    """One after the other."""
    other = {"controller": "reactive"}
    text = printed(fault_tables([row(), OFF, row(**other), OFF | other]))
    assert text.index("planner, what") < text.index("reactive, each") < text.index("reactive, what")


def test_a_drives_response_is_one_line():
    """When the health said so, what it is at the end, and commands out of range if any."""
    data = {"injected": ["gnss:off@5", "imu:off@9"], "faulty_s": 9.0, "flagged_after_s": 5.25}
    data |= {"bad_commands": 0, "health_at_end": "degraded"}
    assert fault_text(data) == (
        "faults: gnss:off@5, imu:off@9: health said so after 5.2 s, degraded at the end"
    )
    silent = data | {"flagged_after_s": None, "bad_commands": 3}
    assert fault_text(silent).endswith(
        "health never said so, degraded at the end; 3 commands not finite or beyond the limits"
    )
    assert fault_text(data | {"faulty_s": 0.0}).endswith("ended before the first onset")


def test_the_catalogue_has_all_senses_and_kinds():
    """Each with its effect; the typical faults are faults."""
    data = catalogue()
    assert [each["kind"] for each in data["kinds"]] == list(KINDS)
    assert [each["sense"] for each in data["senses"]] == list(SENSES)
    assert {each["kind"]: each["number"] for each in data["kinds"]}["slow"] == "share"
    assert [each["kind"] for each in data["kinds"] if each["number"] is None] == ["off", "stuck"]
    assert len({Fault.parse(text) for text in data["typical"]}) == len(SENSES) * len(KINDS)
    text = printed(catalogue_tables(data))
    assert "radians of heading" in text
    line = next(line.split() for line in text.splitlines() if line.startswith(" off "))
    assert line[-1] == "none"
    assert "SENSE:KIND[=NUMBER][@ONSET[+DURATION]]" in text
