"""Texts of ``--perturb``: strengths by name, whole levels, and what is refused."""

import pytest

from andabata.app.options.disturbances import read_disturbances
from andabata.configuration.usage import UsageError
from andabata.machine.reality import LEVELS, Reality


def test_names_have_their_numbers_in_their_order():
    """Several are separated by commas; the later of one name counts."""
    found = read_disturbances("latency = 0.2, range_noise=5e-2,latency=0.1", Reality())
    assert found == {"latency": 0.1, "range_noise": 0.05}
    assert read_disturbances(None, Reality()) == {}


def test_a_level_stands_for_all_that_differs_there():
    """Of a level come all strengths but those of the ideal robot; words beside it count, too."""
    found = read_disturbances("harsh,latency=0.3,range_noise=0.05", Reality())
    assert found["soft_iron"] == LEVELS["harsh"].soft_iron
    assert found["latency"] == 0.3
    assert found["range_noise"] == 0.05
    assert "gnss_drift_time" not in found
    assert len(found) == 18


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("latenzy=1", "expected NAME=NUMBER with a NAME of gnss_noise, .*, got 'latenzy=1'$"),
        ("latency", "expected NAME=NUMBER .* or field or harsh for all of a level, got 'latency'$"),
        ("ideal", "got 'ideal'$"),
        ("", "got ''$"),
        ("latency=soon", "latency: expected a number, got 'soon'$"),
        ("latency=nan", "latency: expected a number, got 'nan'$"),
        ("latency=5", "latency: input should be less than or equal to 2, got 5.0$"),
    ],
)
def test_what_is_no_disturbance_is_refused(text, message):
    """Unknown names, words without numbers and strengths out of bounds name what was expected."""
    with pytest.raises(UsageError, match=f"^--perturb.*{message}"):
        read_disturbances(text, Reality())
