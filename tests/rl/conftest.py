"""Torch as it is when it learns: small networks on one thread."""

import pytest
import torch


@pytest.fixture(scope="package", autouse=True)
def _one_thread():
    """Use one thread, as a training run does: results and speed depend on the number."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)
