"""Damaged inputs: what each kind of damage does to bytes, and blocks that end in time."""

import itertools
import signal

import numpy as np
import pytest

from andabata.bench.studies.soak.mutants import ends_within, flipped, mutant, truncated

DATA = bytes(range(256))


def test_a_truncation_is_a_begin_and_a_flip_one_bit():
    """Nothing else changes."""
    rng = np.random.default_rng(1)
    for _ in range(50):
        short, other = truncated(DATA, rng), flipped(DATA, rng)
        assert DATA.startswith(short)
        assert len(short) < len(DATA)
        changed = [a ^ b for a, b in zip(DATA, other, strict=True)]
        assert sum(bits.bit_count() for bits in changed) == 1


def test_mutants_are_many_and_the_same_for_a_seed():
    """Hardly any is as before or as another; empty bytes have none."""
    mutants = [mutant(DATA, np.random.default_rng(seed)) for seed in range(200)]
    assert len(set(mutants) - {DATA}) > 190
    assert mutants[3] == mutant(DATA, np.random.default_rng(3))
    assert mutant(b"", np.random.default_rng(0)) == b""


def test_a_block_that_takes_too_long_is_ended():
    """By an error; one that is in time is not, and leaves no alarm behind."""
    with pytest.raises(TimeoutError, match=r"an end within 0\.05 s"):
        _count_on(0.05)
    with ends_within(60.0):
        assert signal.getitimer(signal.ITIMER_REAL)[0] > 0.0
    assert signal.getitimer(signal.ITIMER_REAL)[0] == 0.0


def _count_on(seconds):
    """Count without an end, in a block that has one."""
    with ends_within(seconds):
        for _ in itertools.count():
            continue
