"""The device of a learner: found, refused, or done without."""

import numpy as np
import pytest
import torch

from rl.learner import DeviceError, find_device
from rl.sac import SacConfig, SoftActorCritic
from rl.training import EpisodeSpec, play
from tests.support.known_environments import TARGETS, TWO_ACTIONS, MatchTargets


def learner(device, seed=1):
    config = SacConfig(hidden=(8,), batch_size=8, updates_per_step=0.2, device=device)
    return SoftActorCritic(TARGETS, TWO_ACTIONS, config, seed)


@pytest.mark.skipif(torch.cuda.is_available(), reason="torch finds a GPU here")
def test_a_gpu_that_is_not_there_is_refused_or_done_without():
    """``cuda`` without a GPU is an error; ``auto`` takes the CPU."""
    with pytest.raises(DeviceError, match="expected a GPU that torch finds for 'cuda', got none"):
        learner("cuda")
    assert learner("auto").device.type == "cpu"
    assert find_device("cpu").type == "cpu"


@pytest.mark.skipif(not torch.cuda.is_available(), reason="torch finds no GPU")
def test_a_gpu_learns_and_resumes():
    """``auto`` takes the GPU, and a learner that is restored there goes on bit for bit."""
    assert learner("auto").device.type == "cuda"
    assert find_device("cpu").type == "cpu"
    first, second = learner("cuda"), learner("cuda", seed=2)
    episodes = [
        play(MatchTargets(), first.behaviour_policy(), 1, EpisodeSpec(0, (k,))) for k in (1, 2)
    ]
    first.update(episodes, np.random.default_rng(0))
    second.restore(first.to_bytes({}, {}))
    figures = [one.update(episodes, np.random.default_rng(1)) for one in (first, second)]
    assert figures[0] == figures[1]
    assert first.to_bytes({}, {}) == second.to_bytes({}, {})


def test_a_checkpoint_keeps_what_stands_beside_it():
    """Progress and other tensors come back with the learner's own."""
    first = learner("cpu")
    data = first.to_bytes({"at": 3}, {"best": torch.arange(4)})
    tensors = learner("cpu", seed=2).restore(data)
    assert tensors["best"].tolist() == [0, 1, 2, 3]
