"""Sources of messages, and the names by which one of them is chosen."""

from types import SimpleNamespace

import pytest

from andabata.records.decoding.source_choice import ReadingSource, is_chosen
from tests.support.edited_bags import plain


@pytest.mark.parametrize(
    ("message", "node", "source", "text"),
    [
        (plain("/imu_link"), "", ("imu_link", "", ""), "frame imu_link"),
        (plain("imu_link"), "/driver", ("imu_link", "/driver", ""), "/driver in frame imu_link"),
        (plain(""), "/driver", ("", "/driver", ""), "/driver"),
        (plain("", name=["l", "r"]), "", ("", "", "l,r"), "joints l,r"),
        (SimpleNamespace(left=1.0), "", ("", "", ""), "frame "),
    ],
)
def test_a_source_is_a_frame_a_node_or_joints(message, node, source, text):
    """What a message lacks is empty."""
    found = ReadingSource.of(message, node)
    assert found == source
    assert str(found) == text


@pytest.mark.parametrize(
    ("one", "other", "name"),
    [
        (("a", "/n", ""), ("b", "/n", ""), "a"),
        (("a", "/n", ""), ("a", "/m", ""), "/n"),
        (("", "", "l,r"), ("", "", "r,l"), "l,r"),
        (("", "/n", ""), ("b", "/m", ""), "/n"),
        (("a", "", ""), ("a", "", ""), ""),
    ],
)
def test_the_name_that_distinguishes_a_source_is_one_that_it_is_called(one, other, name):
    """So the option that is advised chooses this source, and not the other."""
    one, other = ReadingSource(*one), ReadingSource(*other)
    assert one.name_beside(other) == name
    assert one.is_called(name) == bool(name)
    assert not other.is_called(name)


def test_only_messages_of_the_chosen_source_are_read():
    """Slashes in front of frames do not count, and other topics are read whole."""
    chosen = {"/imu": "/imu_link"}
    assert is_chosen("/imu", plain("imu_link"), "", chosen)
    assert not is_chosen("/imu", plain("imu2_link"), "", chosen)
    assert is_chosen("/fix", plain("gps"), "", chosen)
    assert is_chosen("/imu", plain("x"), "/driver", {"/imu": "/driver"})
