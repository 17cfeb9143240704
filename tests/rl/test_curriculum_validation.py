"""Validation and tests of the curriculum: when a stage ends, and which policy is kept."""

from dataclasses import replace

import numpy as np
import pytest

from rl.curriculum import Curriculum, validation_score
from rl.curriculum_config import Difficulty, Stage
from rl.driving import driving_noise, driving_repeat
from tests.support.curricula import Recorder, config, made, rollouts, run
from tests.support.known_environments import TurnToGoal


def test_a_stage_that_is_learnt_ends_early():
    """A stage ends at ``promote_at``, over a full window and not before."""
    easy = Stage(name="turn", episodes=100, promote_at=1.0, window=8)
    plan = config().model_copy(update={"stages": (easy, Stage(name="again", episodes=4))})
    figures = run(Curriculum(plan, made(lambda one: True)))
    assert figures[-1].name == "again"
    assert sum(one.played for one in figures if one.name == "turn") == 8
    never = run(Curriculum(plan, made(lambda one: one.seed[2] % 8 != 5)))
    assert sum(one.played for one in never if one.name == "turn") == 100


def test_a_stage_is_passed_at_its_hardest_level_alone():
    """Success on an easy level does not end the stage."""
    levels = Difficulty(start=0.3, max_level=0.5, step=0.1, window=4, raise_at=0.9)
    stage = Stage(name="turn", episodes=100, promote_at=0.9, window=4, difficulty=levels)
    plan = config().model_copy(update={"stages": (stage,)})
    figures = run(Curriculum(plan, made(lambda one: True)))
    assert [one.difficulty for one in figures] == [0.3, 0.4]


def test_the_best_policy_is_kept():
    """With validation in between, the stage ends with the rate of the best policy."""
    plan = config(32).model_copy(update={"validation": 4, "validate_every": 1})
    recorder, rates = Recorder(), []
    curriculum = Curriculum(plan, recorder)
    for iteration in curriculum.run():
        rates.append(iteration.validation["turn"])
        if iteration.is_last:
            break
    assert len(rates) == 8
    assert rates[-1] == max(rates)
    kept = {policy.to_bytes() for explores, policy in recorder.policies if not explores}
    assert curriculum.policy({}).to_bytes() in kept


def test_a_policy_keeps_the_noise_that_it_is_validated_with():
    """It is told with the policy, of the best snapshot and of the present one."""
    recorder = Recorder()
    plan = config(8, driving_noise=0.25).model_copy(update={"validation": 1})
    curriculum = Curriculum(plan, recorder)
    run(curriculum, 1)
    assert driving_noise(curriculum.policy({"stage": "turn"})) == 0.25
    run(curriculum)
    last = curriculum.policy({"stage": "again"})
    assert (driving_noise(last), last.info["stage"]) == (0.25, "again")
    assert {driving_noise(policy) for explores, policy in recorder.policies if not explores} == {
        0.25
    }


@pytest.mark.parametrize("held", [1, 3])
def test_a_policy_is_validated_with_actions_held_as_it_drives(held):
    """By its own word, whatever they are held for in learning."""
    repeats = []

    def rollout(policy, action_repeat, specs, explore):
        if not explore:
            repeats.append((action_repeat, driving_repeat(policy)))
        return rollouts()(policy, action_repeat, specs, explore)

    plan = config(4, action_repeat=2, driving_repeat=held).model_copy(update={"validation": 1})
    run(Curriculum(plan, rollout), 1)
    assert repeats == [(held, held)]


def test_the_policy_of_a_better_validation_replaces_the_older():
    """Of two validations the policy of the better one is kept, whichever comes first."""
    state = TurnToGoal().reset(seed=0)[0]
    for best in (1, 2):
        tried = []

        def rollout(policy, repeat, specs, explore, best=best, tried=tried):
            if explore:
                return made(lambda one: False)(policy, repeat, specs, explore)
            tried.append(policy)
            return made(lambda one: len(tried) == best)(policy, repeat, specs, explore)

        plan = config(12, learning_rate=0.05, ema_rate=1.0)
        plan = plan.model_copy(update={"validation": 1, "validate_every": 1})
        curriculum = Curriculum(plan, rollout)
        run(curriculum, 3)
        kept = curriculum.policy({"stage": "turn"})
        assert kept.info == {"stage": "turn"}
        np.testing.assert_array_equal(kept.act(state), tried[best - 1].act(state))
        assert len({policy.to_bytes() for policy in tried}) == 3


def test_fixed_tasks_are_tested():
    """Every ``test_every`` steps each task is played once, in order, with the same seeds."""
    played = []

    def rollout(policy, repeat, specs, explore):
        if not explore:
            played.append((policy, repeat, specs))
        return made(lambda one: one.task != 1, steps=20)(policy, repeat, specs, explore)

    plan = config(24).model_copy(update={"test_every": 150, "test_tasks": 3})
    figures = run(Curriculum(plan, rollout))
    # Four episodes of 20 steps an iteration: 80, 160, 240, 320 ...
    tested = [one.steps for one in figures if one.tasks is not None]
    assert tested == [160, 320, 480]
    assert len({tuple(specs) for _, _, specs in played}) == 1
    _, repeat, specs = played[0]
    assert [(one.stage, one.task, one.difficulty) for one in specs] == [
        (4, k, None) for k in range(3)
    ]
    assert len({one.seed for one in specs}) == 3
    assert repeat == 1
    other = Curriculum(plan.model_copy(update={"seed": 9}), rollout)
    run(other)
    assert played[-1][2] == specs
    tasks = next(one.tasks for one in figures if one.tasks is not None)
    assert (tasks.score, tasks.successes, tasks.mean_steps) == (pytest.approx(0.96), 2, 20)
    assert tasks.steps == (20, None, 20)


def test_a_run_with_tests_and_steps_resumes_bit_for_bit():
    """Budgets of steps, tests and a weighed score come through a kill as well."""
    stages = (Stage(name="turn", episodes=100, steps=1600), Stage(name="again", episodes=4))
    changes = {"test_every": 700, "test_tasks": 2, "validation": 2, "validate_every": 1}
    plan = config(policy_delay=3).model_copy(
        update={"stages": stages, "collision_weight": 2.0, **changes}
    )
    whole = Curriculum(plan, rollouts())
    figures = run(whole)
    assert [one.tasks is None for one in figures] == [True, False, True, False, True]
    for killed_after in (1, 2, 4):
        first = Curriculum(plan, rollouts())
        run(first, killed_after)
        second = Curriculum(plan, rollouts(), first.to_bytes())
        assert run(second) == figures[killed_after:]
        assert second.to_bytes() == whole.to_bytes()


def test_the_score_of_a_validation():
    """A collision loses its weight, a time-out one, and the plain score is the share."""
    (goal,) = made(lambda one: True)(None, 1, [None], False)
    (crash,) = made(lambda one: False)(None, 1, [None], False)
    late = replace(crash, terminated=False)
    episodes = [goal, goal, goal, crash, crash, late]
    assert validation_score(episodes, None) == validation_score(episodes, 1.0) == 0.5
    assert validation_score(episodes, 2.0) == pytest.approx(1 - 5 / 6)
    assert validation_score([crash], 3.0) == -2.0


def test_a_policy_that_collides_less_is_kept():
    """With a weight of two, three time-outs are better than two collisions."""
    for weight, best in ((None, 0), (2.0, 1)):
        tried = []

        def rollout(policy, repeat, specs, explore, tried=tried):
            if explore:
                return made(lambda one: False)(policy, repeat, specs, explore)
            first = not tried
            tried.append(policy)
            fails = 2 if first else 3
            episodes = made(lambda one: one.seed[2] >= fails)(policy, repeat, specs, explore)
            return [replace(one, terminated=first or one.is_success) for one in episodes]

        plan = config(8, learning_rate=0.05, ema_rate=1.0).model_copy(
            update={"validation": 6, "validate_every": 1, "collision_weight": weight}
        )
        curriculum = Curriculum(plan, rollout)
        run(curriculum, 2)
        assert curriculum.policy({}).to_bytes() == tried[best].to_bytes()


@pytest.mark.parametrize(("tolerance", "kept"), [(0.0, 0), (0.3, 1), (0.6, 2)])
def test_a_later_policy_is_kept_within_the_tolerance(tolerance, kept):
    """Of scores 1, 0.75 and 0.5 the last within the tolerance of the best is kept."""
    tried = []

    def rollout(policy, repeat, specs, explore):
        if explore:
            return made(lambda one: False)(policy, repeat, specs, explore)
        tried.append(policy)
        return made(lambda one: one.seed[2] >= len(tried) - 1)(policy, repeat, specs, explore)

    plan = config(12, learning_rate=0.05, ema_rate=1.0)
    changes = {"validation": 4, "validate_every": 1, "validation_tolerance": tolerance}
    curriculum = Curriculum(plan.model_copy(update=changes), rollout)
    figures = run(curriculum, 3)
    assert curriculum.policy({}).to_bytes() == tried[kept].to_bytes()
    assert figures[-1].validation["turn"] == 1 - 0.25 * kept
