"""Registry of learners: a learner is a module, and a line in each of the two tables here."""

from collections.abc import Callable
from typing import Annotated

from pydantic import Field

from rl.actor_critic import ActorCritic, ActorCriticConfig
from rl.learner import BaseLearnerConfig, Learner
from rl.replay import Renderer
from rl.sac import SacConfig, SoftActorCritic
from rl.spaces import ActionSpec, ObservationSpec
from rl.td3 import Td3Config, TwinDelayed

LearnerConfig = Annotated[
    SacConfig | Td3Config | ActorCriticConfig, Field(discriminator="algorithm")
]
"""Settings of any learner, distinguished by ``algorithm``."""

_LEARNERS: dict[type[BaseLearnerConfig], Callable[..., Learner]] = {
    SacConfig: SoftActorCritic,
    Td3Config: TwinDelayed,
    ActorCriticConfig: ActorCritic,
}


def make_learner(
    config: LearnerConfig,
    observations: ObservationSpec,
    actions: ActionSpec,
    seed: int,
    renderer: Renderer | None = None,
) -> Learner:
    """Return a fresh learner.

    Args:
        config: Settings, which name the algorithm.
        observations: Space of the observations.
        actions: Space of the actions.
        seed: Seed of the weights.
        renderer: Renderer of the observations if episodes hold situations.

    Raises:
        DeviceError: If torch does not find the device.
        ValueError: If there is a renderer for a learner that remembers nothing.
    """
    learner = _LEARNERS[type(config)]
    return learner(observations, actions, config, seed, renderer)
