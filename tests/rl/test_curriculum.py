"""The curriculum: stages in order, exact resume, difficulty by success, rehearsal, validation."""

from dataclasses import replace

import numpy as np
import pytest

from rl.actor_critic import ActorCriticConfig
from rl.curriculum import Curriculum, validation_score
from rl.curriculum_config import CurriculumConfig, Difficulty, Stage
from rl.driving import driving_noise
from rl.sac import SacConfig
from rl.spaces import steering_observations
from rl.training import Episode, serial_rollouts
from tests.known_environments import TurnToGoal

LEARNER = {
    "hidden": (8,),
    "episodes_per_iteration": 4,
    "reward_scale": 0.1,
    "batch_size": 16,
    "updates_per_step": 0.02,
}


def config(episodes=16, **learner):
    return CurriculumConfig(
        stages=(Stage(name="turn", episodes=episodes), Stage(name="again", episodes=4)),
        learner=SacConfig(**{**LEARNER, **learner}),
        observations=steering_observations(4, 10.0, 0.5),
        seed=3,
    )


def run(curriculum, iterations=10**9):
    found = []
    for iteration in curriculum.run():
        found.append(iteration)
        if len(found) == iterations:
            break
    return found


def rollouts():
    return serial_rollouts([TurnToGoal() for _ in range(5)])


class Recorder:
    """A rollout function that keeps its arguments; the episodes are real ones."""

    def __init__(self):
        self.explored, self.validated, self.repeats, self.policies = [], [], [], []
        self._play = rollouts()

    def __call__(self, policy, action_repeat, specs, explore):
        (self.explored if explore else self.validated).append(list(specs))
        self.repeats.append((explore, action_repeat))
        self.policies.append((explore, policy))
        return self._play(policy, action_repeat, specs, explore)


def made(successes, turns=0.0, steps=10, reward=1.0):
    """Return a rollout function whose episodes succeed as a function of their spec."""

    def rollout(policy, action_repeat, specs, explore):
        return [
            Episode(
                states=np.zeros((2, 7), np.float32),
                actions=np.zeros((2, 1), np.float32),
                rewards=np.array([reward, reward]),
                last_state=np.zeros(7, np.float32),
                terminated=True,
                outcome="goal" if successes(one) else "collision",
                is_success=successes(one),
                steps=steps,
                terms={"facing": reward},
                turns=turns,
            )
            for one in specs
        ]

    return rollout


def test_a_killed_run_resumes_bit_for_bit():
    """A run that is resumed after any iteration gives the same figures and the same checkpoint."""
    whole = Curriculum(config(), rollouts())
    figures = run(whole)
    assert [one.name for one in figures] == ["turn"] * 4 + ["again"]
    for killed_after in (1, 3, 4):
        first = Curriculum(config(), rollouts())
        run(first, killed_after)
        second = Curriculum(config(), rollouts(), first.to_bytes())
        assert second.iterations == killed_after
        assert run(second) == figures[killed_after:]
        assert second.to_bytes() == whole.to_bytes()


def test_a_checkpoint_of_another_run_is_refused():
    """Another config and a damaged file are refused, each by its own message."""
    first = Curriculum(config(), rollouts())
    run(first, 1)
    with pytest.raises(ValueError, match="expected one of this configuration"):
        Curriculum(config(24), rollouts(), first.to_bytes())
    with pytest.raises(ValueError, match="checkpoint: expected one of this learner"):
        Curriculum(config(), rollouts(), first.to_bytes()[:-10])


def test_a_checkpoint_of_another_learner_is_refused():
    """A checkpoint of soft actor-critic does not start an actor-critic."""
    first = Curriculum(config(), rollouts())
    run(first, 1)
    other = config().model_copy(update={"learner": ActorCriticConfig()})
    with pytest.raises(ValueError, match="expected one of this configuration"):
        Curriculum(other, rollouts(), first.to_bytes())


def test_the_level_follows_the_success():
    """The difficulty rises and falls by one step a full window, within its bounds."""
    rule = Difficulty(start=0.3, least=0.2, most=0.4, step=0.1, window=4)
    assert rule.after(0.3, [True] * 3) == 0.3
    assert rule.after(0.3, [True] * 4) == 0.4
    assert rule.after(0.4, [True] * 4) == 0.4
    assert rule.after(0.3, [True, False, True, False]) == 0.3
    assert rule.after(0.3, [False] * 4) == 0.2
    assert rule.after(0.2, [False] * 4) == 0.2
    assert rule.after(0.3, [False] * 4 + [True] * 4) == 0.4  # The latest window alone counts.


def test_the_thresholds_of_the_level():
    """A share equal to ``raise_at`` raises the level; one equal to ``lower_at`` keeps it."""
    rule = Difficulty(window=4, raise_at=0.75, lower_at=0.5)
    assert rule.after(0.3, [True, True, True, False]) == 0.4
    assert rule.after(0.3, [True, True, False, False]) == 0.3
    assert rule.after(0.3, [True, False, False, False]) == 0.2


def test_earlier_stages_are_rehearsed_and_validated():
    """Each iteration shares its episodes as configured, with seeds that never come twice."""
    recorder = Recorder()
    harder = Difficulty(start=0.3, most=0.5, window=4, raise_at=0.0, lower_at=0.0)
    plan = config().model_copy(
        update={
            "stages": (
                Stage(name="turn", episodes=8, difficulty=harder),
                Stage(name="again", episodes=8, rehearsal=0.5),
            ),
            "validation": 3,
        }
    )
    figures = run(Curriculum(plan, recorder))
    levels = [[one.difficulty for one in iteration] for iteration in recorder.explored[:2]]
    assert levels == [[0.3] * 4, [0.4] * 4]
    for iteration in recorder.explored[2:]:
        assert [one.stage for one in iteration] == [1, 1, 0, 0]
    seeds = [one.seed for iteration in recorder.explored for one in iteration]
    assert len(seeds) == len(set(seeds))
    assert [g.validation.keys() for g in figures if g.is_last] == [{"turn"}, {"turn", "again"}]
    assert [[one.stage for one in played] for played in recorder.validated] == [
        [2, 2, 2],
        [3, 3, 3],
        [2, 2, 2],
    ]
    assert {one.difficulty for one in recorder.validated[0]} == {0.5}
    for played in recorder.validated:
        assert len({one.seed for one in played}) == 3
    assert not {one.seed for played in recorder.validated for one in played} & set(seeds)


def test_another_seed_gives_other_episodes():
    """No episode of one seed is an episode of another."""
    seeds = []
    for seed in (3, 4):
        recorder = Recorder()
        run(Curriculum(config().model_copy(update={"seed": seed}), recorder), 2)
        seeds.append({one.seed for iteration in recorder.explored for one in iteration})
    assert len(seeds[0]) == len(seeds[1]) == 8
    assert not seeds[0] & seeds[1]


def test_actions_are_held_while_learning_and_not_in_validation():
    """The action repeat is the learner's; validation decides at every control step."""
    recorder = Recorder()
    plan = config(4, action_repeat=3).model_copy(update={"validation": 1})
    run(Curriculum(plan, recorder), 1)
    assert recorder.repeats == [(True, 3), (False, 1)]


def test_the_present_actor_explores_and_the_average_is_validated():
    """Episodes to learn from are played by the behaviour policy, validation by the kept one."""
    recorder = Recorder()
    plan = config(8, ema_rate=1e-6, updates_per_step=0.2, learning_rate=1e-2)
    curriculum = Curriculum(plan.model_copy(update={"validation": 1}), recorder)
    state = TurnToGoal().reset(seed=0)[0]
    before = curriculum.learner.policy({}).act(state)
    run(curriculum, 2)
    (_, first), (_, second), (explores, kept) = recorder.policies[:3]
    assert not explores
    np.testing.assert_array_equal(first.act(state), before)
    np.testing.assert_allclose(kept.act(state), before, atol=1e-4)
    assert np.abs(second.act(state) - before).max() > 1e-3


def test_the_learning_rate_falls_linearly_over_a_stage(monkeypatch):
    """Iteration k of n is learnt at 1 - (1 - final) k / n, and each stage begins at 1."""
    scales = []
    curriculum = Curriculum(config(16), made(lambda one: True))
    update = curriculum.learner.update
    monkeypatch.setattr(
        curriculum.learner, "update", lambda e, rng, scale: scales.append(scale) or update(e, rng)
    )
    run(curriculum)
    assert scales == pytest.approx([1.0, 0.8, 0.6, 0.4, 1.0])


@pytest.mark.parametrize(("count", "rehearsal"), [(1, 0.5), (1, 0.9), (2, 0.9), (4, 0.9)])
def test_the_stage_itself_is_always_played(count, rehearsal):
    """However large the rehearsal, each iteration has an episode of its own stage."""
    recorder = Recorder()
    plan = config(episodes_per_iteration=count)
    stages = (Stage(name="turn", episodes=2), Stage(name="again", episodes=2, rehearsal=rehearsal))
    figures = run(Curriculum(plan.model_copy(update={"stages": stages}), recorder))
    assert sum(one.played for one in figures if one.name == "again") == 2
    for iteration in recorder.explored:
        assert len(iteration) <= count
        assert iteration[0].stage == max(one.stage for one in iteration)


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
    levels = Difficulty(start=0.3, most=0.5, step=0.1, window=4, raise_at=0.9)
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


def test_the_figures_are_those_of_the_episodes():
    """Counts, means and shares of an iteration are those of the stage's own episodes."""
    plan = config(4).model_copy(update={"stages": (Stage(name="turn", episodes=8, window=8),)})
    rollout = made(lambda one: one.seed[2] in (0, 1, 2, 4), turns=4.5, steps=15, reward=2.0)
    first, second = run(Curriculum(plan, rollout))
    assert (first.stage, first.name, first.played, first.budget) == (0, "turn", 4, 8)
    assert (first.episodes, second.episodes) == (4, 8)
    assert (first.is_last, second.is_last) == (False, True)
    assert (first.steps, second.steps) == (60, 120)
    assert (first.success_rate, second.success_rate) == (0.75, 0.25)
    assert (first.recent_success, second.recent_success) == (0.75, 0.5)
    assert first.outcomes == {"goal": 3, "collision": 1}
    assert first.mean_steps == 15
    assert first.mean_return == 4.0
    assert first.terms == {"facing": 2.0}
    assert first.circling == 1.0
    few = run(Curriculum(plan, made(lambda one: True, turns=4.0)))
    assert few[0].circling == 0.0


def test_levels_of_thirds_end_at_one():
    """Three steps of a third lead from 0 to 1 exactly, and back to 0."""
    rule = Difficulty(start=0.0, least=0.0, most=1.0, step=1 / 3, window=1, raise_at=0.9)
    up, down = [0.0], [1.0]
    for _ in range(4):
        up.append(rule.after(up[-1], [True]))
        down.append(rule.after(down[-1], [False]))
    assert up == pytest.approx([0, 1 / 3, 2 / 3, 1, 1], abs=1e-5)
    assert down == pytest.approx([1, 2 / 3, 1 / 3, 0, 0], abs=1e-5)
    assert (up[3], down[3]) == (1.0, 0.0)


def test_a_budget_of_steps_ends_a_stage(monkeypatch):
    """The stage ends after the iteration that spends its steps, and the rate falls with them."""
    stages = (Stage(name="turn", episodes=100, steps=170), Stage(name="again", episodes=4))
    plan = config().model_copy(update={"stages": stages})
    curriculum, scales = Curriculum(plan, made(lambda one: True, steps=15)), []
    update = curriculum.learner.update
    monkeypatch.setattr(
        curriculum.learner, "update", lambda e, rng, scale: scales.append(scale) or update(e, rng)
    )
    figures = run(curriculum)
    assert [(one.name, one.stage_steps) for one in figures] == [
        ("turn", 60),
        ("turn", 120),
        ("turn", 180),
        ("again", 60),
    ]
    assert [one.is_last for one in figures] == [False, False, True, True]
    assert scales == pytest.approx([1.0, 1 - 0.8 * 60 / 170, 1 - 0.8 * 120 / 170, 1.0])
    shorter = plan.model_copy(update={"stages": (Stage(name="turn", episodes=4, steps=170),)})
    assert len(run(Curriculum(shorter, made(lambda one: True, steps=15)))) == 1


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
    plan = config(actor_every=3).model_copy(
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
