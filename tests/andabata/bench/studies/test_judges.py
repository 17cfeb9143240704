"""Comparison of judges: which worlds, who ends alike, what a run keeps."""

import json
from dataclasses import replace

import pytest

from andabata.bench.studies import judges
from andabata.bench.studies.judges import (
    AGAIN,
    PRESETS,
    REFERENCE,
    Cell,
    JudgesComparison,
    compare,
    differing,
    drives,
    judge_rows,
    time_plants,
)
from tests.support.offroad_attempts import attempt

SMALL = JudgesComparison(("kinematic",), 2, 7300, "straight", "field")


def driven(judge, world, outcome, time=10.0, contact="", cause=""):
    """Return an attempt of a judge in a world."""
    return attempt(
        *(0, 1, outcome, judge),
        world_seed=world,
        time_s=time,
        distance_m=0.3 * time,
        contact=contact,
        cause=cause,
    )


def test_sixty_drives_have_all_presets_and_few_have_most():
    """Worlds begin at the first seed and are all different; the first drives are a mixture."""
    cells = drives(60, 7300)
    assert len(set(cells)) == 60
    for preset, number in PRESETS.items():
        seeds = sorted(cell.seed for cell in cells if cell.preset == preset)
        assert seeds == list(range(7300, 7300 + number))
    assert drives(24, 7300) == cells[:24]
    assert {cell.preset for cell in cells[:24]} == set(PRESETS)


def test_drives_of_one_preset_are_in_its_worlds():
    """A comparison of one preset drives in as many of its worlds, more than the mixture has."""
    cells = drives(70, 7300, "natural-rough")
    assert cells == tuple(Cell("natural-rough", 7300 + k) for k in range(70))
    assert replace(SMALL, preset="maze").cells() == (Cell("maze", 7300), Cell("maze", 7301))


def test_ends_are_compared_drive_by_drive():
    """Goals, drives with the same end, and the ratio of times where both won."""
    drives = [
        *(driven(REFERENCE, k, end) for k, end in enumerate(("goal", "goal", "collision"))),
        *(driven("mujoco", k, end, 12.0) for k, end in enumerate(("goal", "collision", "goal"))),
        *(driven(AGAIN, k, end, 9.0) for k, end in enumerate(("goal", "goal", "goal"))),
    ]
    rows = {row["judge"]: row for row in judge_rows(drives)}
    assert {name: row["same end"] for name, row in rows.items()} == {
        REFERENCE: 3,
        "mujoco": 1,
        AGAIN: 2,
    }
    assert [rows[name]["goals"] for name in (REFERENCE, "mujoco", AGAIN)] == [2, 2, 3]
    assert rows["mujoco"]["goals less bullet's"] == 0.0
    assert rows[AGAIN]["goals less bullet's"] == pytest.approx(1 / 3)
    assert rows["mujoco"]["time ratio"] == pytest.approx(1.2)
    assert rows[AGAIN]["way ratio"] == pytest.approx(0.9)
    low, high = rows["mujoco"]["same low"], rows["mujoco"]["same high"]
    assert low < 1 / 3 < high


def test_collisions_with_others_end_otherwise():
    """Who ran into whom is part of an end; the rows name the world and both ends."""
    drives = [
        driven(REFERENCE, 4, "collision", contact="obstacle", cause="trunk"),
        driven("mujoco", 4, "collision", contact="mover"),
    ]
    assert judge_rows(drives)[1]["same end"] == 0
    assert judge_rows(drives)[1]["time ratio"] is None
    (row,) = differing(drives)
    assert row["world"] == "maze 4"
    assert row["judge"] == "mujoco"
    assert row["bullet"] == "collision trunk"


def test_a_run_goes_on_from_its_journal(tmp_path, monkeypatch):
    """What was driven is read, and tables are those of a run in one go."""
    asked = []

    def drive(self, cell):
        asked.append(cell)
        names = (REFERENCE, AGAIN, *self.plants)
        return judges.DrivenCell(tuple(driven(name, cell.seed, "goal") for name in names))

    monkeypatch.setattr(JudgesComparison, "drive", drive)
    monkeypatch.setattr(judges, "ProcessEngine", lambda workers: judges_engine())
    first = compare(SMALL, tmp_path, 1)
    assert asked == list(drives(2, 7300))
    again = compare(SMALL, tmp_path, 1)
    assert len(asked) == 2
    assert json.dumps(again) == json.dumps(first)
    assert again["judges"][2]["same end"] == 2


def judges_engine():
    """Return the engine of this process."""
    from andabata.engine import SerialEngine

    return SerialEngine()


def test_each_judge_drives_the_same_task(monkeypatch):
    """Bullet's repetition alone has another noise; all have one goal and the judge's name."""
    seen = []

    class Robot:
        def __init__(self, scene, config, models, steering):
            self.plant, self.level = config.plant, config.reality.name

        def close(self):
            seen.append("closed")

    def run(robot, task, rules, rng, contender):
        seen.append((robot.plant, robot.level, len(task.goals), contender, float(rng.random())))
        return (driven(contender, 3, "goal"),)

    monkeypatch.setattr(judges, "SimulatedRobot", Robot)
    monkeypatch.setattr(judges, "run_trial", run)
    attempts = SMALL.drive(Cell("maze", 3)).attempts
    assert [each.contender for each in attempts] == [REFERENCE, AGAIN, "kinematic"]
    one, again, other = (each for each in seen if each != "closed")
    assert seen.count("closed") == 3
    assert [one[0], again[0], other[0]] == ["bullet", "bullet", "kinematic"]
    assert {each[1:3] for each in (one, again, other)} == {("field", 1)}
    assert one[4] == other[4] != again[4]


def test_plants_are_timed_in_turns():
    """Standing and driving, each beside bullet of the same turn."""
    rows = time_plants(("bullet", "kinematic"), 1, 7300)
    assert [(row["doing"], row["plant"]) for row in rows] == [
        ("standing", "bullet"),
        ("standing", "kinematic"),
        ("driving", "bullet"),
        ("driving", "kinematic"),
    ]
    assert rows[0]["ratio to bullet"] == 1.0
    assert rows[3]["us a tick of 10 ms"] > 0.0
