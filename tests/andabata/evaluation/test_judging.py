"""Judging tables: their seeds, their size, and who has to be in them."""

import pytest
from pydantic import ValidationError

from andabata.assembly.controllers import CONTROLLERS
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.configuration.usage import UsageError
from andabata.evaluation.judging import (
    JUDGED_BESIDE,
    JUDGED_SENSES,
    JUDGED_TRIALS,
    JUDGED_WORLDS,
    checked_seed,
    judged_table,
    judged_trials,
    judging_seed,
    with_those,
)
from andabata.evaluation.offroad import EvaluationConfig
from andabata.evaluation.rooms import RoomEvaluationConfig, judged_task
from andabata.machine.planar.vehicle import PLANAR_VEHICLES
from andabata.machine.reality import LEVELS
from andabata.tasks.terminations import TerminationConfig
from worlds.splits import EVALUATIONS, judged_release, split_of

SEED = judging_seed("0.2.0")
FIELD = SimulatedRobotConfig(reality=LEVELS["field"])
JUDGED = {
    "release": "0.2.0",
    "seed": SEED,
    "goals": 3,
    "trials": 200,
    "controllers": ("planner", *JUDGED_BESIDE),
    "simulated_robot": FIELD,
}
"""Settings of a judging table off-road; nothing drives it here."""


def test_the_seed_of_a_release_is_of_the_judging_split():
    """It is refused without the release, and others are refused with it."""
    assert split_of(SEED) == "judging"
    assert checked_seed(SEED, "0.2.0") == SEED
    assert checked_seed(EVALUATIONS - 1, None, EVALUATIONS) == EVALUATIONS - 1
    assert checked_seed(EVALUATIONS, None) == EVALUATIONS
    with pytest.raises(ValueError, match=r"which judges 0\.2\.0; take another seed"):
        checked_seed(SEED, None, EVALUATIONS)
    with pytest.raises(ValueError, match=r"expected that of release 0\.2\.0, 500800000, got 3"):
        checked_seed(3, "0.2.0")
    with pytest.raises(ValueError, match="seed: input should be less than 10000, got 10000"):
        checked_seed(EVALUATIONS, None, EVALUATIONS)


def test_a_judging_table_has_at_least_200_trials():
    """Fewer are refused by the name of the setting; none asked for are the least."""
    assert JUDGED_TRIALS >= 200
    assert judged_trials("0.2.0", None, "trials") == JUDGED_TRIALS
    assert judged_trials("0.2.0", 300, "trials") == 300
    with pytest.raises(UsageError, match=r"--pairs: expected 200 or more .* 0\.2\.0, got 199"):
        judged_trials("0.2.0", 199, "--pairs")


def test_null_controllers_and_the_oracle_stand_beside_each_once():
    """Asked first, in their order; the names are those of controllers."""
    assert with_those(("planner", "oracle"), JUDGED_BESIDE) == (
        *("planner", "oracle", "random+planner", "away+planner", "reactive"),
    )
    assert set(JUDGED_BESIDE) <= set(CONTROLLERS)


def test_a_table_of_the_right_form_is_taken():
    """Every trial has a judging world of the release."""
    config = EvaluationConfig(**JUDGED)
    assert [one.seed for one in config.scenarios] == list(range(SEED, SEED + 200))
    assert {one.world for one in config.scenarios} == {"natural-test"}


def test_worlds_of_each_kind_judge_on_seeds_of_their_own():
    """In tables of their own; no seed judges in two of them."""
    seeds, tables = [], set()
    for world, judged in JUDGED_WORLDS.items():
        trials = judged_trials("0.2.0", None, "trials", world)
        changed = {"world": world, "goals": judged.goals, "trials": trials}
        known = EvaluationConfig(**(JUDGED | changed)).scenarios
        assert {one.world for one in known} == {world}
        seeds += [one.seed for one in known]
        tables.add(judged_table(world, "field", "bullet"))
    assert len(set(seeds)) == len(seeds) == 700
    assert {split_of(seed) for seed in seeds} == {"judging"}
    assert {judged_release(seed) for seed in seeds} == {"0.2.0"}
    assert len(tables) == len(JUDGED_WORLDS)


def test_at_another_level_the_same_worlds_judge_those_that_are_asked_for():
    """Null controllers stand beside at field; each level has a table of its own."""
    harsh = {"simulated_robot": SimulatedRobotConfig(reality=LEVELS["harsh"])}
    config = EvaluationConfig(**(JUDGED | harsh | {"controllers": ("planner",)}))
    assert config.scenarios == EvaluationConfig(**JUDGED).scenarios
    names = [judged_table("natural-test", level, "bullet") for level in ("field", "harsh", "ideal")]
    assert names == ["evaluate off-road", *(f"evaluate off-road, {x}" for x in ("harsh", "ideal"))]


def test_in_the_other_judge_of_physics_the_same_worlds_judge_those_that_are_asked_for():
    """Null controllers stand beside in bullet; other plants than these two judge nothing."""
    mujoco = {"simulated_robot": SimulatedRobotConfig(reality=LEVELS["field"], plant="mujoco")}
    config = EvaluationConfig(**(JUDGED | mujoco | {"controllers": ("planner",)}))
    assert config.scenarios == EvaluationConfig(**JUDGED).scenarios
    assert judged_table("natural-test", "field", "mujoco") == "evaluate off-road, mujoco"


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"release": None}, r"which judges 0\.2\.0"),
        ({"release": "0.2.1"}, r"expected that of release 0\.2\.1"),
        ({"release": "new"}, "release: expected a version"),
        ({"seed": 0}, r"expected that of release 0\.2\.0"),
        ({"suite": "development"}, "suite: expected None .*, got development; leave it out"),
        ({"world": "lake"}, "world: expected natural-test, .*, got lake"),
        ({"world": "maze"}, "goals: expected 1 .*, got 3"),
        ({"goals": 1}, "goals: expected 3 .*, got 1"),
        ({"perturb": {"lag": 0.2}}, "perturb: expected {}"),
        ({"faults": ("imu:off",)}, r"faults: expected \(\)"),
        (
            {"terminations": TerminationConfig(time_limit=900)},
            r"terminations: expected .* time_limit=300.* got .* time_limit=900",
        ),
        (
            {"simulated_robot": SimulatedRobotConfig(reality=LEVELS["field"], plant="kinematic")},
            "plant: expected bullet or mujoco .*, got kinematic",
        ),
        ({"trials": 24}, "trials: expected 200 to 1000 .*, got 24"),
        ({"trials": 1001}, "trials: expected 200 to 1000 .*, got 1001"),
        ({"world": "natural-rough", "trials": 501}, "trials: expected 100 to 500 .*, got 501"),
        ({"controllers": ("planner", *JUDGED_BESIDE[1:])}, "got none named random.planner"),
    ],
)
def test_a_table_of_another_form_does_not_use_up_the_seeds(changed, message):
    """Settings from a file or ``--set`` are refused as options are."""
    with pytest.raises(ValidationError, match=message):
        EvaluationConfig(**(JUDGED | changed))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"seed": SEED}, r"which judges 0\.2\.0"),
        ({"seed": 0, "release": "0.2.0"}, r"expected that of release 0\.2\.0"),
        ({"seed": SEED, "release": "0.2.0", "pairs": 100}, "pairs: expected 200 or more"),
        ({"seed": SEED, "release": "0.2.0", "pairs": 200, "rooms": ("spn-env4",)}, "rooms: expect"),
    ],
)
def test_rooms_have_the_same_rule(changed, message):
    """Starts and goals of a judging seed are for its release, in all rooms of the task."""
    task = {"task": judged_task("spn", "0.2.0")}
    with pytest.raises(ValidationError, match=message):
        RoomEvaluationConfig(**task | changed)
    RoomEvaluationConfig(**task, seed=SEED, release="0.2.0", pairs=200)


@pytest.mark.parametrize("name", JUDGED_SENSES)
def test_rooms_are_judged_with_drift_and_noise(name):
    """Those of BARN's robot or more; who develops has none unless they are asked for."""
    barn = PLANAR_VEHICLES["barn"]
    assert dict(JUDGED_SENSES) == {"drift": 1.0, "noise": barn.range_noise}
    task = judged_task("td3", "0.2.0")
    assert (task.drift, task.noise, task.clearance) == (1.0, 0.01, 0.4)
    assert (judged_task("td3").drift, judged_task("td3").noise) == (0.0, 0.0)
    judged = {"seed": SEED, "release": "0.2.0", "pairs": 200}
    weak = task.model_copy(update={name: 0.0})
    with pytest.raises(ValidationError, match=f"task.{name}: expected .* or more .*leave it out"):
        RoomEvaluationConfig(task=weak, **judged)
    RoomEvaluationConfig(task=task.model_copy(update={"drift": 3.0}), **judged)
