"""Evaluation off-road: the same world and noise for each controller, its journal, its command."""

import json
from dataclasses import replace

import numpy as np
import pytest

from andabata.assembly import controllers
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.evaluation import offroad, trial
from andabata.evaluation.attempt import Attempt
from andabata.evaluation.comparison import run_comparison
from andabata.evaluation.offroad import (
    EvaluationConfig,
    OffroadComparison,
    attempt_of,
    attempt_row,
    drive_trial,
    shortest_of,
)
from andabata.evaluation.scenarios import Scenario
from andabata.machine.planar.mover_contact import Contact
from andabata.machine.simulator import SensingConfig
from andabata.models import Models, shipped_policy
from andabata.navigation.arrival import ArrivalConfig
from andabata.tasks.episode_monitor import TerminationConfig
from andabata.tasks.terminations import Outcome
from worlds.splits import evaluation_world


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
    attempts = run_comparison(OffroadComparison.of(config, models))
    return [each for each in attempts if each.contender == controller]


def test_every_controller_has_the_same_world_start_and_noise():
    """A controller's rows do not depend on the controllers beside it or on their order."""
    models = Models()
    alone = rows_of(small(), "straight", models)
    beside = rows_of(small(controllers=("random+planner", "straight")), "straight", models)
    assert alone == beside
    assert [each.repetition for each in alone] == [0, 1, 2]
    noise = rows_of(small(controllers=("random+planner",)), "random+planner", models)
    beside = rows_of(small(controllers=("straight", "random+planner")), "random+planner", models)
    assert noise == beside


def test_trials_and_seeds_have_streams_of_their_own():
    """No two trials share a world, a start or an end, nor do two evaluations."""
    models = Models()
    rows = [rows_of(small(seed=seed), "straight", models) for seed in (0, 1)]
    found = [row for part in rows for row in part]
    assert len({each.detail.world_seed for each in found}) == 6
    assert len({each.detail.end for each in found}) == 6
    assert rows_of(small(), "straight", models) == rows[0]


def test_trials_of_one_world_have_noise_of_their_own(monkeypatch):
    """In one and the same world two trials, and two seeds, still drive with other noise."""
    one = Scenario("maze", evaluation_world(0, 0))
    monkeypatch.setattr(offroad, "scenarios", lambda *_: (one,) * 3)
    monkeypatch.setattr(offroad, "choose_task", lambda tasks, _: tasks[0])
    models = Models()
    ends = [
        each.detail.end for seed in (0, 1) for each in rows_of(small(seed=seed), "straight", models)
    ]
    assert len(set(ends)) == 6


def test_the_noise_of_controllers_is_a_stream_of_its_own(monkeypatch):
    """All controllers of a trial get equal noise; no two trials and no two seeds share it."""
    drawn, placed = {}, []
    make, run = controllers.make_steering, trial.run_trial

    def make_steering(name, world, config, models, rng):
        drawn.setdefault((seed, world.seed), []).append(rng.bit_generator.state["state"]["state"])
        return make(name, world, config, models, rng)

    def run_trial(simulated_robot, task, terminations, rng, on_step, **names):
        placed.append(rng.bit_generator.state["state"]["state"])
        return run(simulated_robot, task, terminations, rng, on_step, **names)

    monkeypatch.setattr(controllers, "make_steering", make_steering)
    monkeypatch.setattr(trial, "run_trial", run_trial)
    models, rules = Models(), TerminationConfig(time_limit=0.1)
    for seed in (0, 1):
        config = small(seed=seed, controllers=("straight", "reactive"), trials=2)
        config = config.model_copy(update={"terminations": rules})
        run_comparison(OffroadComparison.of(config, models))
    assert len(drawn) == 4
    assert all(first == second for first, second in drawn.values())
    streams = {first for first, _ in drawn.values()}
    assert len(streams) == 4
    assert len(set(placed)) == 4
    assert not streams & set(placed)


def test_a_row_holds_the_measures_of_the_attempt():
    """World, outcome and cause of a row are those of the drive; a failure ends the trial."""
    config = small()
    rows = map(attempt_row, run_comparison(OffroadComparison.of(config, Models())))
    for row, scenario in zip(rows, config.scenarios, strict=True):
        assert (row["world"], row["world_seed"]) == ("maze", scenario.seed)
        assert (row["goal"], row["goals"], row["outcome"]) == (1, 1, "timeout")
        assert row["cause"] == "no way"
        assert row["time_s"] == pytest.approx(4.0)
        assert 0.9 < row["distance_m"] < 1.4
        assert row["spl"] == 0.0
        assert row["energy_j"] is None


def test_failures_come_with_what_the_robot_saw():
    """Each failed trial is reported once, with its attempt, its scan and the goal it headed for."""
    failures = []
    attempts = drive_trial(small(), Models(), 1, failures.append)
    (failure,) = failures
    assert failure.attempt is attempts[-1]
    np.testing.assert_allclose(failure.pose.position[:2], attempts[-1].detail.end)
    assert failure.scan.ranges.shape == (32,)
    assert failure.walkers.size == 0
    distance = np.hypot(*(failure.goal - failure.pose.position[:2]))
    assert distance > 5.0
    robot = small().simulated_robot.model_copy(update={"arrival": ArrivalConfig(distance=500.0)})
    near = small(terminations=TerminationConfig(goal_radius=500.0), simulated_robot=robot)
    ends = [each.outcome for each in drive_trial(near, Models(), 1, failures.append)]
    assert ends == [Outcome.GOAL]
    assert len(failures) == 1


def test_a_worse_receiver_is_no_excuse():
    """All arms are judged with the tolerance of the robot without disturbances."""
    plain = small(simulated_robot=SimulatedRobotConfig())
    assert plain.tolerance == pytest.approx(0.25 * 2**0.5)
    assert small(perturb={"gnss_drift": 5.0}).tolerance == small().tolerance


def test_a_failure_among_walkers_comes_with_where_they_went():
    """The last steps of the drive, in which none goes farther than its speed allows."""
    failures = []
    drive_trial(small(world="natural-walkers"), Models(), 0, failures.append)
    (failure,) = failures
    steps, walkers, columns = failure.walkers.shape
    assert (steps, columns) == (40, 5)
    assert walkers == len(failure.world.movers) > 0
    there = (failure.walkers[-2:, :, 3] > 0).all(axis=0)
    moved = np.hypot(*np.diff(failure.walkers[-2:, there, :2], axis=0)[0].T)
    assert 0.03 < moved.max() < 0.25


def picture(failure):
    """Return the name and the bytes of a picture."""
    return f"{failure.attempt.repetition}.png", b"drawn"


def test_pictures_of_failures_go_with_their_trial(tmp_path):
    """They are drawn where it was driven, and written by their names."""
    comparison = OffroadComparison.of(small(trials=1), Models(), picture)
    assert comparison.drive(0).files == {"failures/0.png": b"drawn"}
    run_comparison(comparison, folder=tmp_path)
    assert (tmp_path / "failures/0.png").read_bytes() == b"drawn"
    assert OffroadComparison.of(small(trials=1), Models()).drive(0).files == {}


@pytest.fixture
def undriven(monkeypatch):
    """Let trials end without a drive."""
    monkeypatch.setattr(offroad, "drive_trial", lambda *_: ())


def test_more_trials_go_on_with_a_journal(undriven, tmp_path):
    """The number of trials is no part of the heading; trials beyond it are told all the same."""
    run_comparison(OffroadComparison.of(small(trials=3), Models()), folder=tmp_path)
    fewer = OffroadComparison.of(small(trials=2), Models())
    told = []
    run_comparison(fewer, folder=tmp_path, on_cell=told.append)
    assert told == [0, 1, 2]
    assert [fewer.label(trial) for trial in (1, 2)] == [
        f"world {evaluation_world(0, 1)}",
        "trial 2",
    ]


def test_a_journal_of_other_models_is_refused(undriven, tmp_path):
    """A journal of another policy is refused; the error names the models."""
    run_comparison(OffroadComparison.of(small(), Models()), folder=tmp_path)
    others = replace(Models(), policy=shipped_policy("actor-critic"))
    with pytest.raises(ValueError, match="got one that differs in models; take another --out"):
        run_comparison(OffroadComparison.of(small(), others), folder=tmp_path)


def test_a_journal_of_another_commit_is_refused(undriven, monkeypatch, tmp_path):
    """A journal of another commit is refused; the error names the commit."""
    monkeypatch.setattr(offroad, "commit", lambda: "one")
    run_comparison(OffroadComparison.of(small(), Models()), folder=tmp_path)
    monkeypatch.setattr(offroad, "commit", lambda: "another")
    with pytest.raises(ValueError, match="got one that differs in commit;"):
        run_comparison(OffroadComparison.of(small(), Models()), folder=tmp_path)


def test_attempts_go_through_their_rows():
    """What is read has the SPL of what was driven, to the bit, and its contact."""
    (attempt,) = drive_trial(small(goals=1), Models(), 0)
    attempt = replace(attempt, outcome=Outcome.COLLISION, contact=Contact.HIT)
    attempt = replace(attempt, detail=replace(attempt.detail, walker="animal", overridden=0.125))
    again = attempt_of(json.loads(json.dumps(attempt_row(attempt))))
    assert again.path.shape == (0, 3)
    assert np.isnan(again.shortest)
    assert replace(again, shortest=attempt.shortest) == attempt
    row = attempt_row(attempt) | {"goal_xy": None}
    old = {name: value for name, value in row.items() if name not in ("contact", "goal_xy")}
    assert attempt_of(old).contact is Contact.NONE
    new = ("arrival_error_m", "position_error_m", "strict", "strict_failure")
    new += ("outline_forbidden_s", "solid_distance_m", "overridden_share")
    detail = attempt_of({name: value for name, value in old.items() if name not in new}).detail
    assert (detail.arrival_error, detail.position_error, detail.strict) == (None, None, None)
    assert detail.overridden is None


def test_a_shortest_path_gives_its_spl_to_the_bit():
    """Whatever was driven, also where the product of SPL and distance rounds to another."""
    rng = np.random.default_rng(0)
    for distance, short in rng.uniform(0.01, 90.0, (2000, 2)).tolist():
        driven = Attempt("", "", 0, Outcome.GOAL, Contact.NONE, 1.0, distance, short, None)
        found = shortest_of(driven.spl, distance)
        assert replace(driven, shortest=found).spl == driven.spl
    assert shortest_of(1.0, 0.0) == 0.0
    assert np.isnan(shortest_of(0.0, 5.0))


def test_disturbances_drive_the_same_worlds_and_change_no_other_drive():
    """Each disturbance is one more contender; the undisturbed one drives as without them."""
    plain = rows_of(small(), "straight", Models())
    config = small(perturb={"latency": 0.3, "gnss_drift": 0.5})
    found = run_comparison(OffroadComparison.of(config, Models()))
    by_name = {arm.name: [a for a in found if a.contender == arm.name] for arm in config.arms}
    assert [*by_name] == ["straight", "straight@latency=0.3", "straight@gnss_drift=0.5"]
    assert by_name["straight"] == plain
    seeds = [[each.detail.world_seed for each in some] for some in by_name.values()]
    assert seeds[0] == seeds[1] == seeds[2]
    late, blind = by_name["straight@latency=0.3"], by_name["straight@gnss_drift=0.5"]
    for first, second, same in zip(plain, late, blind, strict=True):
        assert second.distance < first.distance - 0.04
        assert same.distance == first.distance  # With the true pose no fix is read.


def test_faults_drive_the_same_up_to_their_onset_and_come_with_the_response():
    """The robot without a fault drives as without the others, and is watched from the first on."""
    faults = ("laser:off@1.5", "laser:off@2.5", "laser:off@60")
    plain = rows_of(small(), "straight", Models())
    config = small(faults=faults)
    found = run_comparison(OffroadComparison.of(config, Models()))
    by_name = {arm.name: [a for a in found if a.contender == arm.name] for arm in config.arms}
    assert [*by_name] == ["straight", *(f"straight@{fault}" for fault in faults)]
    responses = {
        name: [each.detail.response.faulty_s for each in some] for name, some in by_name.items()
    }
    assert [*responses.values()] == [[2.5] * 3, [2.5] * 3, [1.5] * 3, [0.0] * 3]
    assert [replace(a, detail=replace(a.detail, response=None)) for a in by_name["straight"]] == (
        plain
    )
    # Without a scan there is no decision: the robot stands from the onset on.
    first, early, later, never = ([each.distance for each in some] for some in by_name.values())
    assert all(a < b - 0.2 < c - 0.4 for a, b, c in zip(early, later, first, strict=True))
    assert never == first


def test_responses_go_through_their_rows():
    """The last attempt of a trial has it; rows without faults do not name it."""
    config = small(goals=1, faults=("imu:off",), perturb={"lag": 0.2})
    base, late, faulty = drive_trial(config, Models(), 0)
    assert late.detail.response is None
    assert "fault_response" not in attempt_row(late)
    for attempt in (base, faulty):
        again = attempt_of(json.loads(json.dumps(attempt_row(attempt))))
        assert again.detail.response == attempt.detail.response
        assert again.detail.response.faulty_s == 4.0


def test_a_fault_is_driven_once():
    """The same one twice would be one contender."""
    with pytest.raises(ValueError, match="expected each fault once, got imu:off twice"):
        small(faults=("imu:off", "imu:off@0"))


def test_disturbances_that_there_are_not_are_refused():
    """A setting of an unknown disturbance names it."""
    with pytest.raises(ValueError, match=r"perturb\.latenzy: .*did you mean latency"):
        small(perturb={"latenzy": 0.1})


def test_all_trials_are_driven_in_one_world_where_it_is_named():
    """Each with a task and noise of its own: a policy is judged where it was trained."""
    attempts = rows_of(small(world_seed=3), "straight", Models())
    assert {each.detail.world_seed for each in attempts} == {3}
    assert len({each.detail.end for each in attempts}) == 3


def test_a_near_range_is_judged_by_the_rules_of_the_evaluation():
    """With a wide one every trial ends as a collision that touched nothing, without it by time."""
    rules = TerminationConfig(time_limit=4.0, collision_range=9.9)
    near = rows_of(small(terminations=rules), "straight", Models())
    assert {(str(e.outcome), e.contact, e.detail.cause) for e in near} == {
        ("collision", Contact.NONE, "near range")
    }
    assert {str(each.outcome) for each in rows_of(small(), "straight", Models())} == {"timeout"}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"world_seed": 500_800_000}, "which judges 0.2.0"),
        ({"world_seed": 0, "suite": "development"}, "world_seed: expected none beside the suite"),
        ({"world_seed": -1}, "greater than or equal to 0"),
    ],
)
def test_worlds_that_cannot_be_named_are_refused(changes, words):
    """One that judges, one beside a suite's own, and a negative seed."""
    with pytest.raises(ValueError, match=words):
        small(**changes)
