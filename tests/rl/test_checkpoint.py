"""Checkpoints hold parameters, Adam's moments and the run's progress."""

import pytest
import torch
from torch import nn

from rl.checkpoint import CheckpointError, named, progress_of, restore, to_bytes


def made(seed, steps=3):
    torch.manual_seed(seed)
    network = nn.Linear(3, 2)
    adam = torch.optim.Adam(network.parameters(), lr=0.01)
    for _ in range(steps):
        _step(network, adam)
    return network, adam


def _step(network, adam):
    adam.zero_grad()
    network(torch.ones(1, 3)).square().sum().backward()
    adam.step()


def test_a_restored_optimiser_takes_the_same_step():
    """After a restore, parameters and the next step of Adam are the same, to the bit."""
    network, adam = made(0)
    other, again = made(1)
    data = to_bytes(named({"net": network}), {"net": adam}, {"x": torch.ones(2)}, {"at": 5})
    tensors = restore(data, named({"net": other}), {"net": again})
    assert tensors["x"].tolist() == [1, 1]
    for _ in range(2):
        for a, b in zip(network.parameters(), other.parameters(), strict=True):
            assert torch.equal(a, b)
        _step(network, adam)
        _step(other, again)


def test_the_progress_is_read_alone():
    """The progress comes back without the tensors."""
    network, adam = made(0)
    data = to_bytes(named({"net": network}), {"net": adam}, {}, {"at": 5, "levels": [0.3]})
    assert progress_of(data) == {"at": 5, "levels": [0.3]}


def test_a_checkpoint_is_a_copy():
    """Bytes that were taken do not follow the learner; the same state gives the same bytes."""
    network, adam = made(0)
    parts = named({"net": network}), {"net": adam}, {}, {}
    first = to_bytes(*parts)
    assert to_bytes(*parts) == first
    _step(network, adam)
    assert to_bytes(*parts) != first


def test_names_are_those_of_the_network_and_its_parameter():
    """A parameter's name has its network's in front."""
    assert set(named({"actor": nn.Linear(1, 1)})) == {"actor.weight", "actor.bias"}


NESTED = b"[" * 100_000 + b"]" * 100_000


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"12345678",
        b"\x05\0\0\0\0\0\0\0{}{}{",
        b"\xff" * 40,
        len(NESTED).to_bytes(8, "little") + NESTED,
    ],
)
def test_bytes_that_are_no_checkpoint_are_refused(data):
    """Neither progress nor tensors are read from other bytes, and the error names the next step."""
    network, adam = made(0)
    with pytest.raises(CheckpointError, match="start a new run"):
        progress_of(data)
    with pytest.raises(CheckpointError, match="expected one of this learner"):
        restore(data, named({"net": network}), {"net": adam})


def test_a_checkpoint_of_another_shape_is_refused():
    """A network of another width does not take the parameters."""
    network, adam = made(0)
    data = to_bytes(named({"net": network}), {"net": adam}, {}, {})
    wider = nn.Linear(5, 2)
    with pytest.raises(CheckpointError):
        restore(data, named({"net": wider}), {})
