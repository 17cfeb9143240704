"""Learners as bytes: everything that learning needs to go on, without pickle."""

import json
from collections.abc import Mapping
from typing import Any

import torch
from torch import Tensor, nn
from torch.optim import Optimizer

_MOMENTS = ("step", "exp_avg", "exp_avg_sq")


class CheckpointError(ValueError):
    """Bytes that are no checkpoint of the learner that was asked for."""


def to_bytes(
    parameters: Mapping[str, Tensor],
    optimisers: Mapping[str, Optimizer],
    others: Mapping[str, Tensor],
    progress: dict[str, Any],
) -> bytes:
    """Return a learner as safetensors.

    Args:
        parameters: Learnt parameters by name.
        optimisers: Adam, by name.
        others: Whatever else there is to keep.
        progress: Progress of the run, ready for JSON.
    """
    from safetensors.torch import save

    tensors = {name: tensor.detach().cpu().clone() for name, tensor in parameters.items()}
    for name, optimiser in optimisers.items():
        for number, parameter in enumerate(optimiser.param_groups[0]["params"]):
            for key, moment in optimiser.state.get(parameter, {}).items():
                tensors[f"adam.{name}.{number}.{key}"] = moment.detach().cpu().clone()
    return save(tensors | dict(others), metadata={"progress": json.dumps(progress, sort_keys=True)})


def progress_of(data: bytes) -> dict[str, Any]:
    """Return where the run of a checkpoint stands, without its tensors.

    Raises:
        CheckpointError: If the bytes are no checkpoint.
    """
    try:
        size = int.from_bytes(data[:8], "little")
        header = json.loads(data[8 : 8 + size])
        return dict(json.loads(header["__metadata__"]["progress"]))
    except Exception as error:  # A hostile header raises many kinds.
        raise _refused(error) from error


def restore(
    data: bytes, parameters: Mapping[str, Tensor], optimisers: Mapping[str, Optimizer]
) -> dict[str, Tensor]:
    """Take up what ``to_bytes`` gave and return its tensors.

    Raises:
        CheckpointError: If the bytes are no checkpoint of such a learner.
    """
    from safetensors.torch import load

    try:
        tensors: dict[str, Tensor] = load(data)
        with torch.no_grad():
            for name, tensor in parameters.items():
                tensor.copy_(tensors[name])
        for name, optimiser in optimisers.items():
            for number, parameter in enumerate(optimiser.param_groups[0]["params"]):
                prefix = f"adam.{name}.{number}."
                if f"{prefix}step" in tensors:
                    optimiser.state[parameter] = {
                        key: tensors[prefix + key].to(parameter.device) for key in _MOMENTS
                    }
    except Exception as error:  # Safetensors and torch raise many kinds.
        raise _refused(error) from error
    return tensors


def named(parts: Mapping[str, nn.Module]) -> dict[str, Tensor]:
    """Return the parameters of several networks, each with its network's name in front."""
    return {
        f"{part}.{name}": tensor
        for part, module in parts.items()
        for name, tensor in module.named_parameters()
    }


def _refused(error: Exception) -> CheckpointError:
    """Return what to say of bytes that do not fit."""
    reason = (str(error).splitlines() or [type(error).__name__])[0]
    return CheckpointError(
        f"checkpoint: expected one of this learner, got {reason}; start a new run"
    )
