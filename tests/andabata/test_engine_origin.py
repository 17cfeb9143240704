"""Origins: what differs between two processes is named."""

import platform
from dataclasses import replace

import pytest

from andabata.engine_origin import OriginError, here
from andabata.models import Models


def test_an_origin_knows_models_versions_and_sources():
    """The shipped models are there with their hashes; this process agrees with itself."""
    origin = here()
    assert origin.models["forest.npz"] == Models().hashes["forest"]
    assert origin.models["ground_classifier.npz"] == Models().hashes["ground_classifier"]
    assert len(origin.models) == 8
    assert origin.versions["python"] == platform.python_version()
    assert len(origin.sources) == 64
    origin.check(origin)


def test_where_is_told_and_not_compared():
    """Another machine with another processor may work; so may one without git, or with changes
    that the sources know."""
    mine = here()
    for commit in ("0123456789ab", "0123456789ab+", None):
        theirs = replace(mine, host="other", cpu="another", commit=commit)
        theirs.check(replace(mine, commit="0123456789ab"))


def test_the_machine_and_both_values_are_named():
    """The error says who, what was expected, what was found, and what to do."""
    theirs = replace(here(), host="node-7", models={"forest.npz": "a" * 64})
    wanted = replace(theirs, models={"forest.npz": "b" * 64})
    with pytest.raises(OriginError) as caught:
        theirs.check(wanted)
    assert str(caught.value).startswith(
        f"worker on node-7: expected models forest.npz {'b' * 13}, as the driver's, got {'a' * 13};"
    )
