"""Base of all learners: networks and optimisers on a device, and all of it as bytes."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal

import numpy as np
import torch
from pydantic import BaseModel, ConfigDict, Field
from torch import Tensor, nn

from rl import checkpoint
from rl.policy import Policy
from rl.training import Episode

Device = Literal["cpu", "cuda", "auto"]
"""Device of the gradients; ``auto`` is the GPU where torch finds one, and the CPU elsewhere.
Policies always drive on the CPU."""


class BaseLearnerConfig(BaseModel):
    """Settings that every learner has.

    Attributes:
        hidden: Width of the hidden layers (paper: 200, 200).
        action_repeat: Number of control steps that an action is held for in learning (paper: 1).
        driving_repeat: Number of control steps that the policy alone holds an action for when it
            drives, in validations and evaluations (paper: 1, as in learning).
        reward_scale: Factor of the rewards.
        episodes_per_iteration: Number of episodes that are played before each update.
        driving_noise: Standard deviation of the noise on the actions' shares that the policy keeps
            when it drives; see ``rl.driving`` (assumption; paper: 0).
        device: Device of the gradients; see ``Device``.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    hidden: tuple[int, ...] = (200, 200)
    action_repeat: int = Field(default=5, ge=1)
    driving_repeat: int = Field(default=1, ge=1)
    reward_scale: float = Field(default=1.0, gt=0)
    episodes_per_iteration: int = Field(default=8, ge=1)
    driving_noise: float = Field(default=0.0, ge=0, le=1)
    device: Device = "cpu"


class DeviceError(ValueError):
    """A device that torch does not find."""


def find_device(device: Device) -> torch.device:
    """Return the device of a name.

    Raises:
        DeviceError: If there is none.
    """
    has_cuda = torch.cuda.is_available()
    if device == "cuda" and not has_cuda:
        raise DeviceError(
            "learner.device: expected a GPU that torch finds for 'cuda', got none; "
            "take 'cpu', or install torch's build for CUDA"
        )
    return torch.device("cuda" if device != "cpu" and has_cuda else "cpu")


class Learner(ABC):
    """Learns from whole episodes.

    Attributes:
        device: Device of its networks.
    """

    def __init__(self, device: Device) -> None:
        """Begin without networks.

        Raises:
            DeviceError: If torch does not find the device.
        """
        self.device = find_device(device)
        self._parameters: dict[str, Tensor] = {}
        self._optimisers: dict[str, torch.optim.Optimizer] = {}

    @abstractmethod
    def behaviour_policy(self) -> Policy:
        """Return the actor that plays the episodes to learn from."""

    @abstractmethod
    def policy(self, info: dict[str, Any]) -> Policy:
        """Return what has been learnt, as a complete policy."""

    @abstractmethod
    def update(
        self, episodes: Sequence[Episode], rng: np.random.Generator, lr_scale: float = 1.0
    ) -> dict[str, float]:
        """Learn from episodes at a share of the learning rates; return figures by name."""

    def to_bytes(self, progress: dict[str, Any], others: Mapping[str, Tensor]) -> bytes:
        """Return everything that learning needs to go on, and ``others``.

        Args:
            progress: Position of the run, ready for JSON.
            others: Tensors to keep beside it.
        """
        return checkpoint.to_bytes(self._parameters, self._optimisers, others, progress)

    def restore(self, data: bytes) -> dict[str, Tensor]:
        """Take up the state of ``to_bytes`` and return its tensors.

        Raises:
            CheckpointError: If the bytes are no checkpoint of such a learner.
        """
        return checkpoint.restore(data, self._parameters, self._optimisers)

    def _keep(self, **parts: nn.Module | nn.Parameter) -> None:
        """Move networks and parameters to the device; a checkpoint has them by their names."""
        for name, part in parts.items():
            if isinstance(part, nn.Module):
                self._parameters |= checkpoint.named({name: part.to(self.device)})
            else:
                self._parameters[name] = part

    def _optimise(self, name: str, parameters: Iterable[Tensor], learning_rate: float) -> None:
        """Prepare Adam for parameters that are kept."""
        self._optimisers[name] = torch.optim.Adam(parameters, lr=learning_rate, fused=True)

    def _set_learning_rate(self, name: str, learning_rate: float) -> None:
        """Set an optimiser's learning rate."""
        for group in self._optimisers[name].param_groups:
            group["lr"] = learning_rate

    def _step(self, name: str, loss: Tensor) -> None:
        """Take one step of an optimiser down a loss; other parameters only pass the gradient on."""
        optimiser = self._optimisers[name]
        optimiser.zero_grad()
        loss.backward(inputs=optimiser.param_groups[0]["params"])
        optimiser.step()
