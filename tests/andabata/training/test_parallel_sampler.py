"""The sampler of a training run: any number of processes plays the same episodes."""

import numpy as np
import pytest

from andabata.engine import SerialEngine
from andabata.models import Models, shipped_policy
from andabata.tasks.episode_monitor import TerminationConfig
from andabata.tasks.offroad import OffroadEnv, stage_config
from andabata.training.parallel_sampler import ParallelSampler
from rl.training import EpisodeSpec, play

STAGES = [
    stage_config(name).model_copy(
        update={"seeds": (0, 1), "terminations": TerminationConfig(time_limit=limit)}
    )
    for name, limit in (("Maze2D", 5.0), ("Maze3D", 4.0))
]


class Inline:
    """An engine of several workers that does all of their tasks here, the last one first."""

    def __init__(self, workers):
        self.workers = workers
        self.jobs = []

    def map(self, work, tasks):
        self.jobs = list(tasks)
        found = {k: work(self.jobs[k]) for k in reversed(range(len(self.jobs)))}
        return [found[k] for k in range(len(self.jobs))]


def sampler(engine):
    return ParallelSampler(STAGES, Models(), engine)


def specs():
    return [EpisodeSpec(k % 3 == 1, (7, k), (None, 0.4)[k % 2]) for k in range(10)]


def equal(one, other):
    for name in ("states", "actions", "rewards", "last_state"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    for name in ("terminated", "outcome", "is_success", "steps", "terms", "turns"):
        assert getattr(one, name) == getattr(other, name)


@pytest.fixture(scope="module")
def alone():
    return sampler(SerialEngine())(shipped_policy(), 5, specs(), True)


@pytest.mark.parametrize("workers", [2, 3, 20])
def test_the_number_of_workers_changes_nothing(alone, workers):
    """Episodes are the same to the bit and in the order of the specs, however they are shared."""
    many = sampler(Inline(workers))(shipped_policy(), 5, specs(), True)
    assert len(many) == len(alone) == 10
    for one, other in zip(alone, many, strict=True):
        equal(one, other)
    assert len({episode.states[0].tobytes() for episode in many}) == 10  # No seed is used twice.


@pytest.mark.parametrize("workers", [1, 2, 3, 20])
def test_each_episode_is_played_once(workers):
    """Shares cover all episodes once; the planar stage's are spread evenly over the workers."""
    engine = Inline(workers)
    engine.map = lambda work, tasks: engine.jobs.extend(tasks) or [[None] * len(t) for t in tasks]
    sampler(engine)(shipped_policy(), 5, specs(), True)
    played = [spec for job in engine.jobs for spec in job]
    assert sorted(spec.seed for spec in played) == [(7, k) for k in range(10)]
    planar = [len(job) for job in engine.jobs if job[0].stage == 0]
    assert sum(planar) == 7
    assert len(planar) == min(workers, 7)
    assert max(planar) - min(planar) <= 1
    assert all(len(job) == 1 for job in engine.jobs if job[0].stage == 1)


def test_an_episode_is_that_of_its_environment(alone, scenes):
    """The episode of a stage is that of its environment, played alone with the same seed."""
    for number in (0, 1):
        spec = specs()[number]
        env = OffroadEnv(STAGES[spec.stage], scenes=scenes)
        one = play(env, shipped_policy(), 5, spec)
        env.close()
        assert one.steps == alone[number].steps
        np.testing.assert_allclose(one.states, alone[number].states, atol=1e-3)
        np.testing.assert_allclose(one.actions, alone[number].actions, atol=1e-3)


def test_the_action_repeat_and_exploring_are_passed_on(alone):
    """Decisions are held for the repeat; without exploring there is no noise."""
    few = specs()[:2]
    held = sampler(SerialEngine())(shipped_policy(), 2, few, False)
    again = sampler(SerialEngine())(shipped_policy(), 2, few, False)
    for one, other, explored in zip(held, again, alone, strict=False):
        equal(one, other)
        assert len(one.actions) == -(-one.steps // 2)
        assert len(explored.actions) == -(-explored.steps // 5)
        best = [shipped_policy().best(state) for state in one.states]
        np.testing.assert_allclose(one.actions, best, atol=1e-6)
        assert np.abs(explored.actions[0] - shipped_policy().best(explored.states[0])).max() > 1e-4
