"""A policy file is complete and equals its network; damaged and older ones are refused."""

import json

import numpy as np
import pytest
import torch
from safetensors.numpy import save

from rl.networks import Actor
from rl.policy import PolicyFileError, load_policy, policy_from_bytes, with_info
from rl.spaces import (
    ActionSpec,
    ObservationSpec,
    ObservationTerm,
    steering_actions,
    steering_observations,
)

OBSERVATIONS, ACTIONS = steering_observations(32, 10.0, 0.5), steering_actions(0.5)


@pytest.fixture(scope="module")
def policy():
    torch.manual_seed(0)
    return Actor(OBSERVATIONS, ACTIONS, (200, 200)).policy({"commit": "abc", "stage": "Maze2D"})


def states(n=50):
    low, high = OBSERVATIONS.bounds()
    return np.random.default_rng(0).uniform(low, high, (n, 35)).astype(np.float32)


def test_bytes_come_back(policy):
    """A policy of bytes has the same spaces, description and actions."""
    again = policy_from_bytes(policy.to_bytes())
    assert (again.observations, again.actions) == (OBSERVATIONS, ACTIONS)
    assert again.info == policy.info
    assert again.architecture == "mlp"
    assert again.to_bytes() == policy.to_bytes()
    for state in states():
        np.testing.assert_array_equal(again.act(state), policy.act(state))


def test_a_file_comes_back(policy, tmp_path):
    """A file on disk is the policy; an error names the file."""
    path = tmp_path / "policy.safetensors"
    path.write_bytes(policy.to_bytes())
    assert load_policy(path).info == policy.info
    path.write_bytes(b"nothing")
    with pytest.raises(PolicyFileError, match=r"policy\.safetensors: expected a policy"):
        load_policy(path)


def test_every_field_of_the_specs_survives_the_file():
    """Names, shapes, bounds, units and scalings come back, also of a set of points."""
    observations = ObservationSpec(
        terms=(
            ObservationTerm(
                name="points", shape=(3, 2), low=-4.0, high=4.0, unit="m", scaling="linear"
            ),
            ObservationTerm(name="mask", shape=(3,), low=0.0, high=1.0, unit=""),
            ObservationTerm(
                name="ranges", shape=(4,), low=0.0, high=7.5, unit="m", scaling="proximity"
            ),
        )
    )
    actions = ActionSpec(
        names=("linear", "angular"), low=(0.1, -0.7), high=(0.9, 0.6), units=("m/s", "rad/s")
    )
    policy = Actor(observations, actions, (4,)).policy({})
    again = policy_from_bytes(policy.to_bytes())
    assert again.observations == observations
    assert again.actions == actions


def test_another_description_leaves_the_rest(policy):
    """``with_info`` changes the description alone, of a new policy."""
    other = with_info(policy, {"stage": "Natural"})
    assert other.info == {"stage": "Natural"}
    assert policy.info == {"commit": "abc", "stage": "Maze2D"}
    np.testing.assert_array_equal(other.act(states(1)[0]), policy.act(states(1)[0]))


def about(data):
    header = json.loads(data[8 : 8 + int.from_bytes(data[:8], "little")])
    return json.loads(header["__metadata__"]["about"])


def rewritten(policy, **changes):
    """Return the bytes of a policy with changes of its description."""
    described = about(policy.to_bytes()) | {"sha256": None} | changes
    described = {name: value for name, value in described.items() if name != "sha256" or value}
    tensors = {name: np.ascontiguousarray(array) for name, array in policy.tensors().items()}
    return save(tensors, metadata={"about": json.dumps(described)})


def test_the_file_names_its_version(policy):
    """The description holds format, version 3, architecture and both spaces."""
    described = about(policy.to_bytes())
    assert (described["format"], described["version"]) == ("andabata-policy", 3)
    assert described["architecture"] == "mlp"
    assert [term["name"] for term in described["observations"]["terms"]] == [
        "ranges",
        "previous_actions",
        "heading_error",
    ]


@pytest.mark.parametrize("version", [1, 2, 4])
def test_a_file_of_another_version_is_refused_with_both_versions(policy, version):
    """The error names the file's version and the one that is read, and the next step."""
    with pytest.raises(PolicyFileError) as caught:
        policy_from_bytes(rewritten(policy, version=version), "old.safetensors")
    text = str(caught.value)
    assert text.startswith("old.safetensors: expected")
    assert f"version {version}," in text
    assert "reads version 3" in text
    assert "train one with `andabata train`" in text


def test_a_file_as_version_2_wrote_it_is_refused():
    """A file of the former layout is refused by its version, not by a missing part."""
    described = {
        "format": "andabata-policy",
        "version": 2,
        "max_range": 10.0,
        "limit": 0.5,
        "dead_zone": 0.15,
        "info": {},
    }
    tensors = {"weight0": np.zeros((2, 35), np.float32), "bias0": np.zeros(2, np.float32)}
    data = save(tensors, metadata={"about": json.dumps(described)})
    with pytest.raises(PolicyFileError, match=r"a file of version 2, .* reads version 3"):
        policy_from_bytes(data)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"format": "other"}, "format 'other'"),
        ({"architecture": "transformer"}, "architecture 'transformer'"),
        ({"observations": {"terms": []}}, "expected a policy"),
        ({"actions": {"names": ["angular"]}}, "expected a policy"),
    ],
)
def test_a_foreign_description_is_refused(policy, changes, message):
    """Another format, an unknown architecture and broken spaces are refused."""
    with pytest.raises(PolicyFileError, match=message):
        policy_from_bytes(rewritten(policy, **changes))


def test_a_changed_policy_is_noticed_and_one_without_a_sum_is_read(policy):
    """The sum covers the weights and the description; files of older releases have none."""
    described = about(policy.to_bytes())
    assert policy_from_bytes(rewritten(policy, sha256=described["sha256"])).info == policy.info
    assert policy_from_bytes(rewritten(policy)).info == policy.info
    with pytest.raises(PolicyFileError, match="another SHA-256"):
        policy_from_bytes(rewritten(policy, info={"commit": "abd"}, sha256=described["sha256"]))
    tensors = {name: array.copy() for name, array in policy.tensors().items()}
    tensors["layer1.bias"][3] += np.float32(1e-3)
    with pytest.raises(PolicyFileError, match="another SHA-256"):
        policy_from_bytes(save(tensors, metadata={"about": json.dumps(described)}))


def test_a_description_nested_too_deep_is_named(policy):
    """A depth that ends Python's own reader is an error of the file."""
    text = "[" * 100_000 + "]" * 100_000
    data = save({"a": np.zeros(1, np.float32)}, metadata={"about": text})
    with pytest.raises(PolicyFileError, match="mine: expected a policy"):
        policy_from_bytes(data, "mine")


def test_weights_that_are_not_finite_are_refused(policy):
    """NaN in a weight is no policy."""
    tensors = {name: array.copy() for name, array in policy.tensors().items()}
    tensors["layer1.bias"][3] = np.nan
    data = save(tensors, metadata={"about": json.dumps(about(policy.to_bytes()))})
    with pytest.raises(PolicyFileError, match="not finite"):
        policy_from_bytes(data)


def test_damaged_bytes_never_crash(policy):
    """Bytes that are cut or changed give a policy or the one error, nothing else."""
    data = policy.to_bytes()
    rng = np.random.default_rng(0)
    for _ in range(200):
        spoilt = bytearray(data)
        if rng.random() < 0.4:
            spoilt = spoilt[: rng.integers(len(spoilt))]
        for _ in range(4):
            if spoilt:
                spoilt[rng.integers(min(len(spoilt), 600))] = rng.integers(256)
        try:
            policy_from_bytes(bytes(spoilt))
        except PolicyFileError as error:
            assert "andabata train" in str(error)
