"""Signs of joints, by the others of their side."""

import numpy as np
import pytest

from andabata.records.decoding.joint_signs import JointSigns

NAMES, SIDES = ("bl", "fl", "br", "fr"), ((0, 1), (2, 3))


def learned(signs, count=200):
    """Return a learner that saw a winding drive, and its last speeds."""
    learner = JointSigns()
    for k in range(count):
        turn = 0.5 * np.sin(k / 10)
        speeds = np.array([3 - turn, 3 - turn, 3 + turn, 3 + turn])
        corrected = learner.corrected(NAMES, SIDES, speeds * signs)
    return learner, corrected, speeds


@pytest.mark.parametrize("wrong", range(4))
def test_one_reversed_joint_is_found(wrong):
    """The one that three others turn against is reversed."""
    signs = np.where(np.arange(4) == wrong, -1, 1)
    learner, corrected, speeds = learned(signs)
    assert learner.reversed_names == {NAMES[wrong]}
    np.testing.assert_array_equal(corrected, speeds)


@pytest.mark.parametrize("signs", [(1, 1, 1, 1), (1, 1, -1, -1), (-1, -1, -1, -1)])
def test_sides_that_turn_alike_are_kept(signs):
    """A side that is mirrored as a whole is no matter of its joints."""
    learner, corrected, speeds = learned(signs)
    assert not learner.reversed_names
    np.testing.assert_array_equal(corrected, speeds * signs)


def test_a_tie_makes_the_joints_of_each_side_alike():
    """One joint of each side: they turn alike afterwards, whichever way."""
    _, corrected, speeds = learned((1, -1, 1, -1))
    np.testing.assert_array_equal(np.abs(corrected), speeds)
    assert corrected[0] * corrected[1] > 0 < corrected[2] * corrected[3]


def test_few_speeds_and_missing_numbers_decide_nothing():
    """A robot that stands, and a joint without a number, are kept."""
    learner, _, _ = learned((1, -1, 1, 1), count=1)
    assert not learner.reversed_names
    found = JointSigns(frozenset({"bl"})).corrected(NAMES, SIDES, np.array([1.0, np.nan, 1, 1]))
    np.testing.assert_array_equal(found, [-1, np.nan, 1, 1])
