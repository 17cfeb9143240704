"""Evaluations: the same world and noise for each controller, goals in a row, and the journal."""

import json
from dataclasses import replace

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.assembly import controllers
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.engine import SerialEngine
from andabata.evaluation import evaluate as evaluation
from andabata.evaluation import trial
from andabata.evaluation.evaluate import (
    EvaluationConfig,
    evaluate,
    failure_causes,
    run_one,
    summarise,
)
from andabata.evaluation.scenarios import Scenario
from andabata.machine.simulator import SensingConfig
from andabata.models import Models, shipped_policy
from andabata.tasks.episode_monitor import TerminationConfig
from worlds.splits import evaluation_world


def attempt(
    trial, goal, outcome, controller="straight", spl=0.5, cause="", world="maze", energy=20.0
):
    return {
        "controller": controller,
        "trial": trial,
        "world": world,
        "world_seed": 1,
        "difficulty": 0.5,
        "goal": goal,
        "goals": 3,
        "outcome": outcome,
        "cause": cause,
        "time_s": 10.0,
        "distance_m": 3.0,
        "spl": spl,
        "trespass_m": 1.0,
        "steering_variation": 0.0,
        "energy_j": energy,
        "min_clearance_m": 0.2,
        "end_xy": [0.0, 0.0],
    }


CONFIG = EvaluationConfig(controllers=("straight",), trials=4)
ROWS = [
    attempt(0, 1, "goal"),
    attempt(0, 2, "goal"),
    attempt(0, 3, "goal"),
    attempt(1, 1, "goal"),
    attempt(1, 2, "collision", spl=0.0),
    attempt(2, 1, "tipover", spl=0.0),
    attempt(3, 1, "goal"),
    attempt(3, 2, "goal"),
    attempt(3, 3, "timeout", spl=0.0),
]


def test_energy_is_the_mean_of_the_attempts_with_motors():
    """The energy is the mean over attempts with motors, and None without any."""
    rows = [attempt(0, 1, "goal", energy=30.0), attempt(1, 1, "goal", energy=50.0)]
    assert summarise(rows, CONFIG)[0]["energy_j"] == 40.0
    rows = [attempt(0, 1, "goal", energy=None)]
    assert summarise(rows, CONFIG)[0]["energy_j"] is None


def test_collisions_that_walkers_caused_are_told_apart():
    """They are collisions all the same; rows of earlier versions know no contacts."""
    labels = ("obstacle", "mover", "hit", "hit_at_rest", "hit_at_rest")
    rows = [
        attempt(k, 1, "collision", spl=0.0) | {"contact": label} for k, label in enumerate(labels)
    ]
    row = summarise([*rows, attempt(5, 1, "collision", spl=0.0)], CONFIG)[0]
    assert (row["collisions"], row["hit_by_mover"], row["hit_at_rest"]) == (6, 1, 2)


def test_goals_in_a_row_count_every_trial():
    """A goal counts as tried in every trial, also where an earlier goal failed."""
    table = {row["goal"]: row for row in summarise(ROWS, CONFIG)}
    assert [table[goal]["successes"] for goal in (1, 2, 3, "all")] == [3, 2, 1, 1]
    assert [table[goal]["success_rate"] for goal in (1, 2, 3, "all")] == [0.75, 0.5, 0.25, 0.25]
    assert (table[2]["collisions"], table[1]["tipovers"], table[3]["timeouts"]) == (1, 1, 1)
    assert table["all"]["collisions"] == table["all"]["tipovers"] == table["all"]["timeouts"] == 1
    assert table[1]["spl"] == pytest.approx(0.5 * 3 / 4)
    assert table["all"]["spl"] == pytest.approx(0.5 * 6 / 12)


def test_wilson_interval_holds_the_rate():
    """The interval contains the rate, within 0 and 1."""
    for row in summarise(ROWS, CONFIG):
        assert 0 <= row["wilson_low"] < row["success_rate"] < row["wilson_high"] <= 1


def test_a_journal_is_taken_up_again(tmp_path, monkeypatch):
    """Trials that stand whole in the journal are not run again; a cut line is."""
    ran = []

    def run_one(config, models, on_failure, trial):
        ran.append(trial)
        return [attempt(trial, 1, "goal")]

    monkeypatch.setattr(evaluation, "run_one", run_one)
    journal = tmp_path / "trials.jsonl"
    first = evaluate(CONFIG, Models(), journal=journal)
    assert ran == [0, 1, 2, 3]
    lines = journal.read_text().splitlines()
    journal.write_text(
        "\n".join(lines[:3]) + "\n" + lines[3][: len(lines[3]) // 2]
    )  # A kill mid-line.
    ran.clear()
    told = []
    again = evaluate(
        CONFIG, Models(), journal=journal, on_trial=lambda trial, _: told.append(trial)
    )
    assert again == first
    assert told == [0, 1, 2, 3]
    assert ran == [2, 3]
    assert json.loads(journal.read_text().splitlines()[-1])["trial"] == 3


def test_pictures_of_failures_are_written_before_the_journal_knows(tmp_path, monkeypatch):
    """The picture is drawn by the worker and written here; a kill in between draws it again."""
    rows = [attempt(0, 1, "stuck")]
    monkeypatch.setattr(
        evaluation, "run_one", lambda config, files, on_failure, trial: on_failure(trial) or rows
    )

    def kill(journal, entry):
        assert (tmp_path / "1.png").read_bytes() == b"1"
        raise KeyboardInterrupt

    def draw(failure):
        return f"{failure + 1}.png", b"1"

    monkeypatch.setattr(evaluation.Journal, "append", kill)
    with pytest.raises(KeyboardInterrupt):
        evaluate(CONFIG, Models(), pictures=tmp_path, draw_failure=draw)


def test_a_journal_of_other_models_is_refused(monkeypatch, tmp_path):
    """A journal of another policy is refused; the error names the models."""
    monkeypatch.setattr(evaluation, "run_one", lambda *_: [attempt(0, 1, "goal")])
    journal = tmp_path / "trials.jsonl"
    evaluate(CONFIG, Models(), journal=journal)
    others = replace(Models(), policy=shipped_policy("actor-critic"))
    with pytest.raises(ValueError, match="got one that differs in models; take another --out"):
        evaluate(CONFIG, others, journal=journal)


def test_a_journal_of_another_commit_is_refused(monkeypatch, tmp_path):
    """A journal of another commit is refused; the error names the commit."""
    monkeypatch.setattr(evaluation, "run_one", lambda *_: [attempt(0, 1, "goal")])
    monkeypatch.setattr(evaluation, "commit", lambda: "one")
    journal = tmp_path / "trials.jsonl"
    evaluate(CONFIG, Models(), journal=journal)
    monkeypatch.setattr(evaluation, "commit", lambda: "another")
    with pytest.raises(ValueError, match="got one that differs in commit;"):
        evaluate(CONFIG, Models(), journal=journal)


def test_each_kind_of_world_has_rows_of_its_own():
    """The table has rows for each world, each with its own rate."""
    rows = [attempt(0, 1, "goal"), attempt(1, 1, "goal", world="hollow"), attempt(2, 1, "stuck")]
    table = {
        (row["world"], row["goal"]): row["success_rate"]
        for row in summarise([{**row, "goals": 1} for row in rows], CONFIG)
    }
    assert table == {("maze", 1): 0.5, ("maze", "all"): 0.5, ("hollow", 1): 1, ("hollow", "all"): 1}


def test_failures_are_counted_by_cause():
    """Failures are counted by world, outcome and cause, the most frequent first; goals are not."""
    rows = [attempt(k, 1, "collision", cause="low rock") for k in range(3)]
    rows += [attempt(3, 1, "tipover", cause="slope"), attempt(4, 1, "goal")]
    found = [(row["cause"], row["outcome"], row["count"]) for row in failure_causes(rows)]
    assert found == [("low rock", "collision", 3), ("slope", "tipover", 1)]


def small(**changes):
    """Return an evaluation of short drives in mazes, with the horizontal scanner."""
    robot = SimulatedRobotConfig(
        plant="kinematic", localizer="truth", sensing=SensingConfig(scanner="horizontal")
    )
    return EvaluationConfig(
        **{
            "world": "maze",
            "controllers": ("straight",),
            "trials": 3,
            "goals": 2,
            "simulated_robot": robot,
            "terminations": TerminationConfig(time_limit=4.0),
            **changes,
        }
    )


def rows_of(config, controller, models):
    rows = evaluate(config, models)
    return [row for row in rows if row["controller"] == controller]


def test_every_controller_has_the_same_world_start_and_noise():
    """A controller's rows do not depend on the controllers beside it or on their order."""
    models = Models()
    alone = rows_of(small(), "straight", models)
    beside = rows_of(small(controllers=("random+planner", "straight")), "straight", models)
    assert alone == beside
    assert [row["trial"] for row in alone] == [0, 1, 2]
    noise = rows_of(small(controllers=("random+planner",)), "random+planner", models)
    beside = rows_of(small(controllers=("straight", "random+planner")), "random+planner", models)
    assert noise == beside


def test_trials_and_seeds_have_streams_of_their_own():
    """No two trials share a world, a start or an end, nor do two evaluations."""
    models = Models()
    rows = [rows_of(small(seed=seed), "straight", models) for seed in (0, 1)]
    found = [row for part in rows for row in part]
    assert len({row["world_seed"] for row in found}) == 6
    assert len({tuple(row["end_xy"]) for row in found}) == 6
    assert rows_of(small(), "straight", models) == rows[0]


def test_trials_of_one_world_have_noise_of_their_own(monkeypatch):
    """In one and the same world two trials, and two seeds, still drive with other noise."""
    one = Scenario("maze", evaluation_world(0, 0))
    monkeypatch.setattr(evaluation, "scenarios", lambda *_: (one,) * 3)
    monkeypatch.setattr(evaluation, "choose_task", lambda tasks, _: tasks[0])
    models = Models()
    ends = [
        tuple(row["end_xy"])
        for seed in (0, 1)
        for row in rows_of(small(seed=seed), "straight", models)
    ]
    assert len(set(ends)) == 6


def test_the_noise_of_controllers_is_a_stream_of_its_own(monkeypatch):
    """All controllers of a trial get equal noise; no two trials and no two seeds share it."""
    drawn, placed = {}, []
    make, run = controllers.make_steering, trial.run_trial

    def make_steering(name, world, config, models, rng):
        drawn.setdefault((seed, world.seed), []).append(rng.bit_generator.state["state"]["state"])
        return make(name, world, config, models, rng)

    def run_trial(simulated_robot, task, terminations, rng, on_step):
        placed.append(rng.bit_generator.state["state"]["state"])
        return run(simulated_robot, task, terminations, rng, on_step)

    monkeypatch.setattr(controllers, "make_steering", make_steering)
    monkeypatch.setattr(trial, "run_trial", run_trial)
    models, rules = Models(), TerminationConfig(time_limit=0.1)
    for seed in (0, 1):
        config = small(seed=seed, controllers=("straight", "reactive"), trials=2)
        evaluate(config.model_copy(update={"terminations": rules}), models)
    assert len(drawn) == 4
    assert all(first == second for first, second in drawn.values())
    streams = {first for first, _ in drawn.values()}
    assert len(streams) == 4
    assert len(set(placed)) == 4
    assert not streams & set(placed)


def test_the_order_in_which_trials_end_changes_nothing(monkeypatch):
    """Rows come by trial, whatever the order in which workers end them."""
    monkeypatch.setattr(evaluation, "run_one", lambda *all_: [attempt(all_[-1], 1, "goal")])
    one = evaluate(CONFIG, Models())

    class Backwards(SerialEngine):
        def run(self, work, tasks):
            return reversed(list(super().run(work, tasks)))

    assert evaluate(CONFIG, Models(), engine=Backwards()) == one
    assert [row["trial"] for row in one] == [0, 1, 2, 3]


def test_a_row_holds_the_measures_of_the_attempt():
    """World, outcome and cause of a row are those of the drive; a failure ends the trial."""
    config = small()
    rows = evaluate(config, Models())
    for row, scenario in zip(rows, config.scenarios, strict=True):
        assert (row["world"], row["world_seed"]) == ("maze", scenario.seed)
        assert (row["goal"], row["goals"], row["outcome"]) == (1, 1, "timeout")
        assert row["cause"] == "no way"
        assert row["time_s"] == pytest.approx(4.0)
        assert 0.9 < row["distance_m"] < 1.4
        assert row["spl"] == 0.0
        assert row["energy_j"] is None


def test_failures_come_with_what_the_robot_saw():
    """Each failed trial is reported once, with its row, its scan and the goal it headed for."""
    failures = []
    rows = run_one(small(), Models().to_bytes(), failures.append, 1)
    (failure,) = failures
    assert failure.row == rows[-1]
    np.testing.assert_allclose(failure.pose.position[:2], rows[-1]["end_xy"])
    assert failure.scan.ranges.shape == (32,)
    assert failure.walkers.size == 0
    distance = np.hypot(*(failure.goal - failure.pose.position[:2]))
    assert distance > 5.0
    reached = small(terminations=TerminationConfig(goal_radius=500.0))
    assert [
        row["outcome"] for row in run_one(reached, Models().to_bytes(), failures.append, 1)
    ] == ["goal"]
    assert len(failures) == 1


def test_a_failure_among_walkers_comes_with_where_they_went():
    """The last steps of the drive, in which none goes farther than its speed allows."""
    failures = []
    run_one(small(world="natural-walkers"), Models().to_bytes(), failures.append, 0)
    (failure,) = failures
    steps, walkers, columns = failure.walkers.shape
    assert (steps, columns) == (40, 5)
    assert walkers == len(failure.world.movers) > 0
    there = (failure.walkers[-2:, :, 3] > 0).all(axis=0)
    moved = np.hypot(*np.diff(failure.walkers[-2:, there, :2], axis=0)[0].T)
    assert 0.03 < moved.max() < 0.13


def test_the_table_adds_up_what_was_driven():
    """Times, distances and forbidden distances are means of attempts, the share of sums."""
    rows = [
        {**attempt(0, 1, "goal"), "time_s": 10.0, "distance_m": 4.0, "trespass_m": 1.0},
        {**attempt(1, 1, "stuck"), "time_s": 20.0, "distance_m": 1.0, "trespass_m": 0.5},
    ]
    one = {row["goal"]: row for row in summarise(rows, CONFIG)}[1]
    assert (one["mean_time_s"], one["distance_m"], one["trespass_m"]) == (15.0, 2.5, 0.75)
    assert one["trespass_share"] == pytest.approx(1.5 / 5.0)
    assert (one["stuck"], one["successes"], one["trials"]) == (1, 1, 2)


def test_the_command_prints_one_table_and_resumes(capsys, tmp_path):
    """The command's rows are the same after a kill in the second trial."""
    words = ["evaluate", "--world", "maze", "--controllers", "straight,oracle", "--trials", "2"]
    words += ["--workers", "1", "--set", "simulated_robot.plant=kinematic"]
    words += ["--set", "terminations.time_limit=30", "--json"]
    words += [
        "--set",
        "simulated_robot.sensing.scanner=horizontal",
        "--out",
        str(tmp_path / "eval"),
    ]

    def result():
        assert main(words) == 0
        out = capsys.readouterr().out
        assert out.count("\n") == 1  # One JSON object and nothing else.
        return json.loads(out)

    data = result()
    assert set(data["rows"][0]) >= {
        *("controller", "world", "goal", "trials", "successes", "collisions", "tipovers"),
        *("timeouts", "stuck", "success_rate", "wilson_low", "wilson_high", "spl"),
        *("trespass_m", "distance_m", "mean_time_s", "steering_variation"),
    }
    assert {row["controller"] for row in data["rows"]} == {"straight", "oracle"}
    assert all({"cause", "count"} <= set(row) for row in data["failures"])
    journal = tmp_path / "eval/trials.jsonl"
    lines = journal.read_text().splitlines()
    journal.write_text("\n".join(lines[:2]) + "\n" + lines[2][:40])  # A kill in the second trial.
    assert result()["rows"] == data["rows"]
