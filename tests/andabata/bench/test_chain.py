"""Where the time of a control step goes: functions are timed by name and restored."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.bench import chain
from andabata.bench.chain import Stopwatch, TimedCall, stage_table
from worlds.scenes import SceneCache


class Part:
    """Object whose method advances a clock."""

    def __init__(self, clock):
        self.clock = clock

    def work(self, seconds):
        self.clock[0] += seconds
        return seconds


@pytest.fixture
def clock(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(chain.time, "perf_counter", lambda: now[0])
    return now


def test_calls_are_timed_only_while_the_stopwatch_is_open(clock):
    """Time adds up over calls of methods and of modules' functions; results pass through."""
    part, module = Part(clock), SimpleNamespace(step=Part(clock).work)
    plain = module.step
    with Stopwatch((TimedCall(part, "work", "a"), TimedCall(module, "step", "b"))) as stopwatch:
        assert part.work(0.5) == 0.5
        part.work(seconds=0.25)
        module.step(2.0)
    part.work(8.0)
    assert stopwatch.seconds == {"a": 0.75, "b": 2.0}
    assert "work" not in vars(part)
    assert module.step is plain


def test_functions_are_restored_after_an_error(clock):
    """An error in a drive leaves nothing replaced."""
    part = Part(clock)
    with pytest.raises(TypeError), Stopwatch((TimedCall(part, "work", "a"),)):
        part.work()
    assert "work" not in vars(part)


def test_a_name_that_does_not_exist_is_an_error_that_says_where_to_correct_it(clock):
    """Nothing is replaced, and the message names owner, function, stage and list."""
    part = Part(clock)
    calls = (TimedCall(part, "work", "a"), TimedCall(part, "wrok", "b"))
    with pytest.raises(AttributeError, match=r"'b': expected Part .* 'wrok'.*timed_calls"):
        Stopwatch(calls)
    assert "work" not in vars(part)


def test_the_table_has_a_line_for_each_stage_and_a_column_for_each_subject():
    """Values land at their stage and subject."""
    rows = [
        {"name": name, "subject": subject, "value": value}
        for name, subject, value in (("x", "one", 1.0), ("y", "one", 2.0), ("x", "two", 3.0))
    ]
    rows.append({"name": "y", "subject": "two", "value": 4.4})
    assert stage_table(rows) == [
        {"stage": "x", "one": "1", "two": "3"},
        {"stage": "y", "one": "2", "two": "4"},
    ]


def test_stages_leave_out_what_they_call():
    """A stage's own time is its time without that of the stages inside of it."""
    spent = {
        **{
            "plant": 1.0,
            "proprioception": 2.0,
            "laser": 100.0,
            "rays": 30.0,
            "filter": 3.0,
        },
        **{"assemble": 10.0, "place": 4.0, "scan": 50.0, "project": 5.0, "features": 6.0},
        **{"forest": 7.0, "update": 20.0, "step": 220.0},
        **{"ground cells": 60.0, "plan": 40.0, "policy": 10.0},
    }
    stages = chain._stages(spent)
    assert stages["cast, noise"] == 70.0
    assert stages["store"] == 6.0
    assert stages["carry, scan"] == 32.0
    assert list(stages)[-4:] == ["ground cells", "plan", "policy", "rest of steering"]
    assert stages["rest of steering"] == 40.0
    top = ("plant", "proprioception", "laser", "filter", "assemble", "step")
    assert sum(stages.values()) == sum(spent[name] for name in top) - spent["update"]


def test_all_names_of_a_real_robot_exist_and_their_times_add_up(capsys):
    """The verb times every stage of a drive; no stage takes longer than the whole, roughly."""
    words = ["--plants", "kinematic", "--beams", "271", "--steps", "10", "--runs", "1"]
    words += ["--robots", "1,4"]
    assert main(["bench", "chain", "--world", "maze", *words, "--json", "--quiet"]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    alone = "kinematic, 271 beams"
    assert {row["subject"] for row in rows} == {alone, f"{alone}, 4 robots"}
    values = {row["name"]: row["value"] for row in rows if row["subject"] == alone}
    assert all(row["unit"] == ("1" if row["name"] == "faster than life" else "us") for row in rows)
    for stage in (
        "plant",
        "proprioception",
        "rays",
        "cast, noise",
        "filter",
        "project",
        "features",
        "policy",
    ):
        assert values[stage] > 0
    assert values["faster than life"] == pytest.approx(1e5 / values["whole step"])


def test_perception_without_clouds_cannot_be_timed():
    """A robot with a horizontal scanner has no cloud stages."""
    scene = SimpleNamespace(rays=Part([0.0]))
    robot = SimpleNamespace(scene=scene, simulator=None, perception=object())
    with pytest.raises(TypeError, match="expected clouds, got object"):
        chain.timed_calls([robot])


def test_a_drive_calls_every_function_that_is_timed():
    """A function that has lost its callers would be a stage of no time."""
    config, scene = SimulatedRobotConfig(plant="kinematic"), SceneCache().get("maze", 3)
    with (
        chain.driving(scene, config, "policy+planner", 0, 2) as (robots, advance),
        Stopwatch(chain.timed_calls(robots)) as stopwatch,
    ):
        before = [robot.simulator.vehicle.state.stamp for robot in robots]
        advance(40)
        after = [robot.simulator.vehicle.state.stamp for robot in robots]
    np.testing.assert_allclose(np.subtract(after, before), 4.0)
    places = [robot.simulator.vehicle.state.pose.position[:2] for robot in robots]
    assert not np.allclose(*places, atol=0.1)
    assert [stage for stage, seconds in stopwatch.seconds.items() if seconds == 0.0] == []
