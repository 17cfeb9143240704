"""Rounds of imitation: files, going on, other folders, and rounds that cannot be."""

import numpy as np
import pytest

from andabata.training.dagger import check_rounds, run_rounds
from rl.policies.deterministic import DeterministicPolicy
from rl.spaces import ActionSpec, ObservationSpec, ObservationTerm

SEES = ObservationSpec(terms=(ObservationTerm(name="x", shape=(1,), low=-1, high=1, unit="1"),))
DOES = ActionSpec(names=("angular",), low=(-1.0,), high=(1.0,), units=("rad/s",))


def policy_of(number, info):
    """Return a policy whose bias is a number."""
    weights = {
        "layer0.weight": np.zeros((1, 1), dtype=np.float32),
        "layer0.bias": np.array([number], dtype=np.float32),
    }
    return DeterministicPolicy(weights, SEES, DOES, info)


class Rounds:
    """Rounds whose labels count them, and whose policies add up all labels."""

    def __init__(self):
        self.calls = []

    def drive(self, k, policy):
        """Return labels that tell the round, and the bias of who drove."""
        self.calls.append(("drive", k))
        drove = 0.0 if policy is None else float(policy.tensors()["layer0.bias"][0])
        return {"labels": np.array([k + 1.0, drove])}

    def fit(self, k, labels, start):
        """Return the sum of all labels so far."""
        self.calls.append(("fit", k, start is not None))
        total = sum(one["labels"].sum() for one in labels)
        return policy_of(total, {"round": k})

    def kept(self, k):
        """Take note of labels that are there."""
        self.calls.append(("kept", k))

    def run(self, folder, count=3, **about):
        """Return the biases of all rounds."""
        about = {"seed": 1} | about
        policies = run_rounds(folder, about, count, self.drive, self.fit, self.kept)
        return [float(policy.tensors()["layer0.bias"][0]) for policy in policies]


def test_each_round_learns_from_all_labels(tmp_path):
    """Labels of a round tell who drove it; a policy is fitted to those of all rounds."""
    rounds = Rounds()
    assert rounds.run(tmp_path) == [1.0, 4.0, 11.0]
    assert rounds.calls == [
        *(("drive", 0), ("fit", 0, False), ("drive", 1), ("fit", 1, True)),
        *(("drive", 2), ("fit", 2, True)),
    ]


def test_rounds_go_on_where_they_were_killed(tmp_path):
    """Labels and policies that are there are taken; the result is the same."""
    first = Rounds().run(tmp_path)
    (tmp_path / "round-2.safetensors").unlink()
    rounds = Rounds()
    assert rounds.run(tmp_path) == first
    assert rounds.calls == [("kept", 0), ("kept", 1), ("kept", 2), ("fit", 2, True)]


def test_another_folder_is_refused(tmp_path):
    """Settings and seed have to be the same."""
    Rounds().run(tmp_path)
    with pytest.raises(ValueError, match="expected rounds with these settings"):
        Rounds().run(tmp_path, seed=2)


@pytest.mark.parametrize(
    ("drives", "shares"), [((1, 1), (1.0,)), ((1,), (0.5,)), ((0,), (1.0,)), ((1, 1), (1.0, 2.0))]
)
def test_rounds_without_a_driver_are_refused(drives, shares):
    """As many shares as rounds, the teacher alone in the first, a drive at least."""
    with pytest.raises(ValueError, match="expected"):
        check_rounds(drives, shares, "teacher_shares")
    check_rounds((2, 1), (1.0, 0.0), "teacher_shares")
