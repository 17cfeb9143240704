"""The registry of learners: the settings choose the algorithm."""

import pytest
from pydantic import TypeAdapter, ValidationError

from rl.actor_critic import ActorCritic, ActorCriticConfig
from rl.learners import LearnerConfig, make_learner
from rl.sac import SacConfig, SoftActorCritic
from rl.td3 import Td3Config, TwinDelayed
from tests.support.known_environments import TARGETS, TWO_ACTIONS


@pytest.mark.parametrize(
    ("config", "kind"),
    [(SacConfig, SoftActorCritic), (Td3Config, TwinDelayed), (ActorCriticConfig, ActorCritic)],
)
def test_the_settings_choose_the_learner(config, kind):
    """Each config makes its own learner, over the given spaces."""
    made = make_learner(config(hidden=(4,)), TARGETS, TWO_ACTIONS, 0)
    assert type(made) is kind
    policy = made.policy({})
    assert (policy.observations, policy.actions) == (TARGETS, TWO_ACTIONS)


def test_the_name_of_the_algorithm_tells_settings_apart():
    """``algorithm`` in the data decides which settings are read; an unknown one is refused."""
    read = TypeAdapter(LearnerConfig).validate_python
    assert isinstance(read({"algorithm": "sac", "tau": 0.01}), SacConfig)
    assert isinstance(read({"algorithm": "td3", "target_noise": 0.1}), Td3Config)
    assert isinstance(read({"algorithm": "actor-critic", "clip_range": 0.1}), ActorCriticConfig)
    with pytest.raises(ValidationError):
        read({"algorithm": "actor-critic", "tau": 0.01})
    with pytest.raises(ValidationError):
        read({"algorithm": "sac", "target_noise": 0.1})
    with pytest.raises(ValidationError):
        read({"algorithm": "magic"})


@pytest.mark.parametrize("config", [SacConfig, Td3Config])
def test_situations_need_a_replay_buffer(config):
    """A renderer goes to learners that remember situations, and is refused by the other."""

    class Renderer:
        size = 5

        def __call__(self, situations, rng):
            raise NotImplementedError

    made = make_learner(config(hidden=(4,)), TARGETS, TWO_ACTIONS, 0, Renderer())
    assert made.replay.tensors()["replay.states"].shape == (0, 5)
    with pytest.raises(ValueError, match="expected one with a replay buffer"):
        make_learner(ActorCriticConfig(hidden=(4,)), TARGETS, TWO_ACTIONS, 0, Renderer())
