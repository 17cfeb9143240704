"""A small curriculum and rollout functions, for tests."""

import numpy as np

from rl.curriculum_config import CurriculumConfig, Stage
from rl.sac import SacConfig
from rl.spaces import steering_observations
from rl.training import Episode, play
from tests.support.known_environments import TurnToGoal

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


def serial_rollouts(environments):
    """Return a function that plays episodes in this process; one environment a stage."""

    def rollout(policy, action_repeat, specs, explore):
        return [play(environments[one.stage], policy, action_repeat, one, explore) for one in specs]

    return rollout


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
