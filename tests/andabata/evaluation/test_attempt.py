"""Results of drives: success weighted by path length, and equality."""

import math
from dataclasses import replace

import numpy as np
import pytest

from andabata.evaluation.attempt import CONTACTS, Attempt
from andabata.machine.planar.mover_contact import Contact
from andabata.tasks.terminations import Outcome


def attempt(outcome=Outcome.GOAL, distance=8.0, shortest=4.0):
    """Return an attempt without a detail."""
    return Attempt("a", "w", 0, outcome, Contact.NONE, 1.0, distance, shortest, None)


def test_success_weighted_by_path_length():
    """SPL is shortest over driven, 1 at most, and 0 without success or a known way."""
    assert attempt().spl == 0.5
    assert attempt(distance=2.0).spl == 1.0
    assert attempt(Outcome.TIMEOUT).spl == 0.0
    assert attempt(shortest=np.nan).spl == 0.0
    assert attempt(distance=3.0, shortest=0.0).spl == 0.0


def test_a_goal_at_the_start_is_reached_on_the_shortest_way():
    """Nothing to drive and nothing driven is an SPL of 1."""
    assert attempt(distance=0.0, shortest=0.0).spl == 1.0


@pytest.mark.parametrize("outcome", list(Outcome))
def test_only_goals_are_successes(outcome):
    """All other outcomes are failures."""
    assert attempt(outcome).is_success is (outcome is Outcome.GOAL)


def test_attempts_of_the_same_unknown_length_are_equal():
    """In every Python; one field that differs makes another attempt, whatever the type."""
    assert attempt(shortest=math.nan) == attempt(shortest=math.nan)
    assert hash(attempt(shortest=math.nan)) == hash(attempt(shortest=math.nan))
    assert attempt(shortest=math.nan) != attempt()
    assert replace(attempt(), repetition=1) != attempt()
    assert attempt() != "a"


def test_paths_do_not_count_for_equality():
    """A record may keep none of them."""
    one = replace(attempt(), path=np.ones((4, 3)))
    assert one == attempt()
    assert one != attempt(distance=9.0)
    assert attempt().path.shape == (0, 3)


def test_contacts_are_found_by_their_labels():
    """Each by its own; no contact has an empty one."""
    assert CONTACTS[""] is Contact.NONE
    assert all(CONTACTS[contact.label] is contact for contact in Contact)
