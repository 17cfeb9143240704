"""Results as text: known answers."""

import math

from andabata.app.console import Console
from andabata.app.tables import (
    drive_text,
    evaluation_tables,
    policy_text,
    recording_notes,
    recording_table,
    room_tables,
    salvage_text,
    scan_lines,
    training_text,
)
from andabata.records.bags import LeftOut
from andabata.records.summary import BagSummary, TopicSummary

CELLS = {"green": 2, "red": 1, "white": 317}
SCAN = {
    "file": "a.npz",
    "points": 9,
    "no_returns": 0,
    "cells": CELLS,
    "nearest_obstacle_m": 1.5,
    "unknown_share": 0.25,
    "picture": "a.png",
}


def printed(capsys, *parts):
    """Return the lines that people see."""
    Console().result({}, *parts)
    return [line.rstrip() for line in capsys.readouterr().out.splitlines() if line.strip()]


def test_a_scan_is_counted_in_words():
    """Cells are free, blocked and unknown; the nearest obstacle and unknown ranges follow."""
    (line,) = scan_lines([SCAN])
    assert line == (
        "a.npz: 9 points: 2 free, 1 blocked, 317 unknown cells; nearest obstacle 1.50 m; 25 % of "
        "the ranges unknown.\npicture: a.png"
    )
    assert "9 points (4 no-returns left out):" in scan_lines([SCAN | {"no_returns": 4}])[0]


def test_a_scan_without_obstacle_or_cells_says_so():
    """Free ground has no obstacle; without classified cells nothing is known."""
    free = SCAN | {"nearest_obstacle_m": None}
    assert "; no obstacle seen;" in scan_lines([free])[0]
    unknown = free | {"cells": {"green": 0, "red": 0, "white": 320}}
    assert "; no cell could be classified;" in scan_lines([unknown])[0]
    assert scan_lines([{"file": "b", "error": "bad"}]) == ["b: not read"]


def test_a_drive_has_a_line_for_each_goal():
    """Each attempt is a line, and each file that was written."""
    attempt = {"goal": 1, "outcome": "goal", "time_s": 2.0, "distance_m": 3.0, "trespass_m": 0.5}
    data = {"attempts": [attempt], "picture": "d.png"}
    lines = [
        "title",
        "goal 1: goal after 2.0 s and 3.0 m, 0.5 m on forbidden ground",
        "picture: d.png",
    ]
    assert drive_text("title", data).splitlines() == lines
    assert drive_text("title", data | {"record": "d.bag"}).splitlines() == [
        *lines,
        "record: d.bag",
    ]


def test_a_drive_with_faults_says_what_the_health_said():
    """In a line before those of the files; without faults there is none."""
    faults = {"injected": ["imu:off@5"], "faulty_s": 9.0, "flagged_after_s": 0.1}
    faults |= {"bad_commands": 0, "health_at_end": "degraded"}
    data = {"attempts": [], "picture": "d.png"}
    assert drive_text("title", data | {"faults": faults}).splitlines() == [
        "title",
        "faults: imu:off@5: health said so after 0.1 s, degraded at the end",
        "picture: d.png",
    ]
    assert drive_text("title", data | {"faults": None}).splitlines() == ["title", "picture: d.png"]


def test_a_drive_says_how_far_its_own_estimate_was_off():
    """In metres and degrees; why it was not ok, and which readings were not used, on own lines."""
    estimate = {"position_error_m": 0.5, "position_rms_m": 0.4, "position_max_m": 1.2}
    estimate |= {"heading_error_rad": math.radians(2), "heading_rms_rad": math.radians(3)}
    estimate |= {"inside_2_sigma": 0.9, "health_s": {"ok": 12.0}, "causes_s": {}, "unused": {}}
    lines = drive_text("title", {"attempts": [], "estimate": estimate}).splitlines()
    assert lines[1:] == [
        "own estimate: 0.50 m off at the end (rms 0.40 m, at most 1.20 m), heading 2.0 degrees "
        "(rms 3.0); inside its own 2-sigma ellipse 90 % of the time (86 % expected)"
    ]
    estimate["health_s"] = {"ok": 12.0, "degraded": 3.1}
    estimate["causes_s"] = {"gnss: not accepted": 3.1}
    estimate["unused"] = {"gnss": {"beyond the gate": 4, "a negative variance": 1}}
    lines = drive_text("title", {"attempts": [], "estimate": estimate}).splitlines()
    assert lines[2:] == [
        "health: ok 12.0 s, degraded 3.1 s; gnss: not accepted (3.1 s)",
        "not used: gnss: 4 beyond the gate, 1 a negative variance",
    ]


def test_each_world_of_an_evaluation_has_its_table(capsys):
    """Rows stand under their world, with shares in per cent and 80 columns at most."""
    row = {
        "controller": "policy+planner",
        "goal": "all",
        "successes": 1,
        "trials": 4,
        "wilson_low": 0.1,
        "wilson_high": 0.6,
        "collisions": 2,
        "tipovers": 0,
        "timeouts": 1,
        "stuck": 0,
        "spl": 0.2,
        "trespass_share": 0.015,
    }
    rows = [row | {"world": "hill"}, row | {"world": "maze", "trespass_share": None}]
    lines = printed(capsys, evaluation_tables({"rows": rows}))
    numbers = ["policy+planner", "all", "1/4", "0.10-0.60", "2", "0", "1", "0", "0.20"]
    assert lines[0] == "hill"
    assert lines[3].split() == [*numbers, "1.5", "%"]
    assert lines[4] == "maze"
    assert lines[7].split() == [*numbers, "-"]
    assert max(map(len, lines)) <= 80


def test_the_strict_verdict_and_the_robots_word_have_a_table_of_their_own(capsys):
    """Under the first one, with the radius and the tolerance below all; 80 columns at most."""
    row = {
        **{"controller": "random+planner", "world": "hill", "goal": 1, "trials": 200},
        **{"successes": 170, "wilson_low": 0.79, "wilson_high": 0.9, "spl": 0.2},
        **{"collisions": 20, "tipovers": 1, "timeouts": 3, "stuck": 2, "trespass_share": 0.01},
        **{"strict_successes": 151, "false_arrivals": 4, "left_world": 0},
        **{"arrival_error_m": 0.723, "position_error_m": None},
    }
    within = {"radius_m": 1.0, "tolerance_m": 0.998}
    lines = printed(capsys, evaluation_tables({"rows": [row], "success_within": within}))
    assert lines[4] == "hill. strict verdict, and the robot's own word"
    assert lines[7].split() == ["random+planner", "1", "151/200", "4", "0", "0.72", "m", "-"]
    assert "within 1.0 m + 1.00 m" in " ".join(lines[8:])
    assert max(map(len, lines)) <= 80
    old = printed(capsys, evaluation_tables({"rows": [row]}))
    assert len(old) == 4


def cells(lines):
    """Return the words of the row of the reactive controller."""
    return next(line for line in lines if "reactive" in line).split()


def test_collisions_that_walkers_caused_stand_apart(capsys):
    """What stands, then walkers: driven into, hit by one while driving, and while standing."""
    row = {
        "controller": "reactive",
        "goal": "all",
        "trials": 24,
        "successes": 20,
        "wilson_low": 0.6,
        "wilson_high": 0.93,
        "collisions": 9,
        "hit_mover": 1,
        "hit_by_mover": 1,
        "hit_at_rest": 2,
        "tipovers": 0,
        "timeouts": 0,
        "stuck": 0,
        "spl": 0.8,
        "trespass_share": 0.001,
        "world": "natural-walkers",
    }
    lines = printed(capsys, evaluation_tables({"rows": [row]}))
    title = "natural-walkers. walker: driven into + hit by, driving + standing"
    assert " ".join(lines).split()[: len(title.split())] == title.split()
    assert cells(lines)[4:6] == ["5", "1+1+2"]
    assert max(map(len, lines)) <= 80
    older = printed(capsys, evaluation_tables({"rows": [row | {"hit_mover": None}]}))
    assert cells(older)[4:6] == ["6", "-+1+2"]
    row |= {"hit_mover": 0, "hit_by_mover": 0, "hit_at_rest": 0}
    plain = printed(capsys, evaluation_tables({"rows": [row]}))
    assert plain[0] == "natural-walkers"
    assert cells(plain)[4] == "9"


def test_a_drive_says_who_drove_into_whom(capsys):
    """Of a collision the contact stands in brackets; other outcomes have none."""
    attempt = {"goal": 1, "time_s": 2.0, "distance_m": 0.5, "trespass_m": 0.0}
    hit = attempt | {"outcome": "collision", "contact": "hit_at_rest"}
    late = attempt | {"outcome": "timeout", "contact": ""}
    named = hit | {"contact": "mover", "walker": "animal"}
    lines = drive_text("title", {"attempts": [hit, late, named]}).splitlines()
    assert lines[3].startswith("goal 1: collision (mover, animal) after 2.0 s")
    assert lines[1].startswith("goal 1: collision (hit at rest) after 2.0 s")
    assert lines[2].startswith("goal 1: timeout after 2.0 s")


def summary(*topics, left_out=()):
    """Return a recording's summary."""
    return BagSummary(topics, 1.0, left_out, bool(left_out), ("odd",))


def test_a_recording_shows_only_columns_that_differ(capsys):
    """Connections and readability are columns where they are not all the same."""
    fine = TopicSummary("/fix", ("a/msg/B",), 3, 1.0, 1, (), False, "", True)
    bad = TopicSummary("/odd", ("(none)",), 1, None, 2, (), False, "no type", False)
    head = printed(capsys, recording_table(summary(fine), "t"))[1]
    assert head.split() == ["topic", "type", "messages", "rate", "[Hz]"]
    lines = printed(capsys, recording_table(summary(fine, bad), "t"))
    assert lines[1].split()[5:] == ["connections", "readable"]
    assert lines[-1].split() == ["/odd", "(none)", "1", "-", "2", "no"]


def test_an_unreadable_topic_is_named_once():
    """A topic that cannot be read is not repeated among what was left out."""
    bad = TopicSummary("/odd", ("(none)",), 1, None, 1, (), False, "no type", False)
    left_out = (LeftOut("/odd", 1, "no type"), LeftOut(None, None, "a hole"))
    assert recording_notes(summary(bad, left_out=left_out)) == [
        "/odd can't be read: no type",
        "damage: messages left out: a hole",
        "note: odd",
    ]


def test_a_salvage_counts_its_losses():
    """The number of lost messages may be unknown."""
    data = {"file": "a", "messages": 5, "lost": True, "lost_messages": 2, "reason": "cut"}
    data |= {"notes": ["n"]}
    assert salvage_text(data) == "a: 5 messages; 2 messages lost: cut\nnote: n"
    unknown = data | {"lost_messages": None}
    assert "; an unknown number of messages lost: cut" in salvage_text(unknown)
    whole = data | {"lost": False, "reason": "", "notes": []}
    assert salvage_text(whole) == "a: 5 messages; nothing was lost"
    unfinished = salvage_text(whole | {"reason": "no end"})
    assert unfinished == "a: 5 messages; nothing was lost of what is there; no end"


def test_a_training_run_gives_exploring_and_validation():
    """Validation is shown where there was one."""
    result = {
        "stage": "Maze2D",
        "success_rate": 0.5,
        "validation": {"Maze2D": {"Maze2D": 0.25}},
        "steps": 9,
        "wall_s": 61.4,
    }
    explored = "Maze2D: 50% of the last goals reached while exploring"
    assert training_text(result) == f"{explored}; validation: Maze2D 25%; 9 steps in 61 s"
    assert training_text(result | {"validation": {}}) == f"{explored}; 9 steps in 61 s"


def test_a_policy_shows_its_border():
    """Observations in, actions out, and the run that made it."""
    ranges = {"name": "ranges", "shape": [32], "low": 0.0, "high": 10.0, "unit": "m"}
    actions = {"names": ["angular"], "low": [-0.5], "high": [0.5], "units": ["rad/s"]}
    data = {"architecture": "mlp", "parameters": 9, "observations": [ranges], "actions": actions}
    info = {"stage": "Natural", "seed": 3, "commit": "abc"}
    assert policy_text(data | {"info": info}).splitlines() == [
        "mlp with 9 parameters",
        "observations: ranges (32,) [0, 10] m",
        "actions: angular [-0.5, 0.5] rad/s",
        "trained to stage Natural with seed 3 at commit abc; --json has every setting",
    ]
    imitated = policy_text(data | {"info": {"seed": 3, "commit": "abc"}})
    assert imitated.endswith("\ntrained with seed 3 at commit abc; --json has every setting")


def test_a_room_has_a_table_for_each_policy(capsys):
    """Several seeds together come first; one policy alone needs no name; 80 columns are enough."""
    row = {
        "policy": "a",
        "lidar": "ten-beams-forward",
        "room": "spn-env0",
        "memory": "reactive",
        "trials": 100,
        "successes": 97,
        "collisions": 1,
        "timeouts": 2,
        "wilson_low": 0.915,
        "wilson_high": 0.99,
        "steps_to_oracle": 1.08,
        "spl": 0.9,
    }
    found = printed(capsys, room_tables({"rows": [row], "pooled": [], "differences": []}))
    assert [line.split() for line in found] == [
        ["spn-env0"],
        ["lidar", "memory", "reached", "95", "%", "hit", "late", "T/oracle", "SPL"],
        [found[2].strip()],
        ["ten-beams-forward", "reactive", "97/100", "0.92-0.99", "1", "2", "1.080", "0.900"],
    ]
    moving = (
        row
        | {"lidar": "trained"}
        | {"movers": 4, "collisions": 9, "hit_by_mover": 2, "hit_at_rest": 3}
    )
    found = printed(capsys, room_tables({"rows": [moving], "pooled": [], "differences": []}))
    title = "mover: hit by one while driving + while standing; T/oracle leaves out the 4 movers"
    assert title in " ".join(" ".join(found).split())
    heads = "lidar memory reached 95 % hit mover late T/oracle SPL"
    assert heads in [" ".join(line.split()) for line in found]
    assert found[-1].split()[3:7] == ["0.92-0.99", "4", "2+3", "2"]
    both = {**row, "policy": "a, b", "steps_to_oracle": None}
    other = {**row, "policy": "b"}
    difference = {
        "policy": "c",
        "against": "a, b",
        "lidar": "ten-beams",
        "memory": "map",
        "success_rate": 0.9874,
        "difference": 0.0213,
        "difference_low": -0.0051,
        "difference_high": 0.05,
    }
    data = {"rows": [row, other], "pooled": [both], "differences": [difference]}
    found = printed(capsys, room_tables(data))
    titles = [line for line in found if line.startswith("spn-env0")]
    assert titles == ["spn-env0: a, b", "spn-env0: a", "spn-env0: b"]
    assert found[3].split()[-2:] == ["-", "0.900"]
    last = ["c", "ten-beams", "map", "0.987", "+2.1", "(-0.5", "to", "+5.0)"]
    assert found[-1].split() == last
    assert found[-4] == "Success in points against a, b"
