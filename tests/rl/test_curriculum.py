"""The curriculum: stages in order, exact resume, difficulty by success, rehearsal, figures."""

from dataclasses import replace

import numpy as np
import pytest

from rl.actor_critic import ActorCriticConfig
from rl.curriculum import Curriculum
from rl.curriculum_config import Difficulty, Stage
from tests.support.curricula import Recorder, config, made, rollouts, run
from tests.support.known_environments import TurnToGoal


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
    rule = Difficulty(start=0.3, min_level=0.2, max_level=0.4, step=0.1, window=4)
    assert rule.after(0.3, [True] * 3) == 0.3
    assert rule.after(0.3, [True] * 4) == 0.4
    assert rule.after(0.4, [True] * 4) == 0.4
    assert rule.after(0.3, [True, False, True, False]) == 0.3
    assert rule.after(0.3, [False] * 4) == 0.2
    assert rule.after(0.2, [False] * 4) == 0.2
    assert rule.after(0.3, [False] * 4 + [True] * 4) == 0.4  # The latest window alone counts.


def by_world(outcomes):
    """Return a rollout function that plays episodes of worlds with successes, one after another."""
    left = iter(outcomes)

    def rollout(policy, action_repeat, specs, explore):
        worlds = [next(left) for _ in specs]
        played = made(lambda one: True)(policy, action_repeat, specs, explore)
        return [
            replace(each, world=world, is_success=success)
            for each, (world, success) in zip(played, worlds, strict=True)
        ]

    return rollout


def levels_of(outcomes, window, worlds=4, kill_after=None):
    """Return the level of each episode, one an iteration, in a stage of four worlds."""
    rule = Difficulty(
        start=0.0,
        min_level=0.0,
        max_level=1.0,
        step=1 / 3,
        raise_at=0.75,
        lower_at=0.0,
        window=window,
        worlds=worlds,
    )
    plan = config(episodes_per_iteration=1).model_copy(
        update={"stages": (Stage(name="turn", episodes=len(outcomes), difficulty=rule),)}
    )
    played = by_world(outcomes)
    curriculum = Curriculum(plan, played)
    figures = run(curriculum, len(outcomes) if kill_after is None else kill_after)
    if kill_after is not None:
        figures += run(Curriculum(plan, played, curriculum.to_bytes()))
    return [round(3 * each.difficulty) for each in figures]


def test_only_success_in_the_levels_own_world_opens_the_next():
    """Successes elsewhere count for nothing, and failures there do no harm."""
    others = [(k, True) for k in (1, 2, 3)] * 3
    assert levels_of([*others, (0, True)], window=4) == [0] * 10
    own = [(0, True), (1, False), (0, True), (2, False), (0, True), (3, False), (0, True)]
    assert levels_of([*own, (2, False)], window=4) == [0] * 7 + [1]
    # Without worlds all of them count, whatever their world.
    assert levels_of([*others, (0, True)], window=4, worlds=0) == [0] * 4 + [1] * 4 + [2] * 2


def test_the_window_of_a_world_slides():
    """The latest four count at every episode; windows in a row would wait for the eighth."""
    outcomes = [(0, False), (0, False), (0, True), (0, True), (0, True), (0, True)]
    assert levels_of([*outcomes], window=4) == [0] * 5 + [1]
    assert levels_of([*outcomes], window=4, worlds=0) == [0] * 6


def test_the_latest_of_a_world_count_from_before_its_own_level():
    """World 1 has its four when world 0 opens it: the next episode but one is in world 2."""
    outcomes = [(1, True)] * 4 + [(0, True)] * 4 + [(2, False), (2, False)]
    assert levels_of(outcomes, window=4) == [0] * 8 + [1, 2]
    # On level 1 the successes in world 0 count no more; three of four in world 1 open world 2.
    outcomes = [(0, True)] * 4 + [(1, False), *[(0, True)] * 4, *[(1, True)] * 4, (0, True)]
    assert levels_of(outcomes, window=4) == [0] * 4 + [1] * 8 + [2] * 2


def test_successes_by_world_survive_a_kill():
    """A run that goes on after a kill opens the next world in the same episode."""
    outcomes = [(0, True), (1, True)] * 5
    assert levels_of(outcomes, window=4, kill_after=3) == levels_of(outcomes, window=4)


def test_the_thresholds_of_the_level():
    """A share equal to ``raise_at`` raises the level; one equal to ``lower_at`` keeps it."""
    rule = Difficulty(window=4, raise_at=0.75, lower_at=0.5)
    assert rule.after(0.3, [True, True, True, False]) == 0.4
    assert rule.after(0.3, [True, True, False, False]) == 0.3
    assert rule.after(0.3, [True, False, False, False]) == 0.2


def test_earlier_stages_are_rehearsed_and_validated():
    """Each iteration shares its episodes as configured, with seeds that never come twice."""
    recorder = Recorder()
    harder = Difficulty(start=0.3, max_level=0.5, window=4, raise_at=0.0, lower_at=0.0)
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
    rule = Difficulty(start=0.0, min_level=0.0, max_level=1.0, step=1 / 3, window=1, raise_at=0.9)
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
