"""Schedules of noise, and what counts as near an obstacle."""

import numpy as np
import pytest
from pydantic import ValidationError

from rl.policies.exploration import NoiseSchedule, RandomTurns
from rl.spaces import ObservationSpec, ObservationTerm


def test_gdaes_noise_falls_by_the_same_amount_in_each_step():
    """From 1 to 0.1 over 500,000 steps in a line, and 0.1 from then on."""
    noise = NoiseSchedule(start=1.0, end=0.1, steps=500_000)
    found = [noise.sigma(n) for n in (0, 250_000, 500_000, 2_000_000)]
    np.testing.assert_allclose(found, [1.0, 0.55, 0.1, 0.1])


def test_an_exponential_decay_falls_by_the_same_factor():
    """Half of the steps take half of the factor; the end stays."""
    noise = NoiseSchedule(start=0.8, end=0.2, steps=1000, decay="exponential")
    found = [noise.sigma(n) for n in (0, 500, 1000, 5000)]
    np.testing.assert_allclose(found, [0.8, 0.4, 0.2, 0.2])


def test_the_default_is_from_a_half_to_a_tenth_over_60_000_steps():
    """The schedule that drove in prototypes."""
    assert [NoiseSchedule().sigma(n) for n in (0, 60_000)] == [0.5, pytest.approx(0.1)]


def test_nothing_decays_to_nothing_by_factors():
    """An exponential decay to 0 is refused, a linear one is not."""
    with pytest.raises(ValidationError, match="expected start and end above 0"):
        NoiseSchedule(start=0.5, end=0.0, decay="exponential")
    assert NoiseSchedule(start=0.0, end=0.0).sigma(7) == 0.0


def space(unit):
    terms = (
        ObservationTerm(name="goal", shape=(2,), low=-4.0, high=9.0, unit="m, rad"),
        ObservationTerm(name="ranges", shape=(4,), low=0.0, high=10.0, unit=unit),
    )
    return ObservationSpec(terms=terms)


def test_ranges_and_their_reciprocals_tell_what_is_near():
    """A value below the range, or above its reciprocal, is near; the goal's values are not read."""
    turns = RandomTurns(term="ranges", near_range=0.5)
    ranges = np.array([[9, 9, 9, 0.51], [9, 0.49, 9, 9], [9, 9, 9, 9]], dtype=np.float32)
    goals = np.zeros((3, 2), dtype=np.float32)
    for unit, values in (("m", ranges), ("1/m", 1 / ranges)):
        rows = np.concatenate([goals, values], axis=1).astype(np.float32)
        assert turns.are_near(rows, space(unit)).tolist() == [False, True, False]


def test_some_values_alone_are_looked_at():
    """What stands beside the chosen values is not near."""
    turns = RandomTurns(term="ranges", values=(1, 2), near_range=0.5)
    rows = np.full((4, 6), 9.0, dtype=np.float32)
    rows[np.arange(4), 2 + np.arange(4)] = 0.1
    assert turns.are_near(rows, space("m")).tolist() == [False, True, True, False]


@pytest.mark.parametrize("wrong", [{"steps": (9, 8)}, {"steps": (0, 8)}, {"values": (3, 2)}])
def test_impossible_turns_are_refused(wrong):
    """A greatest number below the least, turns of no step and values in the wrong order."""
    with pytest.raises(ValidationError, match="expected"):
        RandomTurns(term="ranges", **wrong)
