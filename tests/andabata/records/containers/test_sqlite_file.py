"""sqlite3 files of ROS 2 are read alone, in every version of the tables, and when damaged."""

import sqlite3

import pytest

from andabata.records.bags import Bag, BagError
from tests.recordings import note, stamp, write_db3

EVERY = [f"note {k}" for k in range(10)]


def notes_of(path, damaged=False):
    with Bag(path, damaged) as bag:
        return [message.content.data for message in bag.messages()]


@pytest.mark.parametrize("definitions", [False, True])
def test_a_bare_file_is_read(tmp_path, definitions):
    path = write_db3(tmp_path / "x.db3", definitions=definitions)
    with Bag(path) as bag:
        assert bag.topics == {"/notes": ("std_msgs/msg/String", 10)}
        found = list(bag.messages())
    assert [(m.stamp_ns, m.content.data) for m in found] == [
        (stamp(k), f"note {k}") for k in range(10)
    ]


def test_a_type_that_no_distribution_has_costs_its_topic_alone(tmp_path):
    path = write_db3(tmp_path / "x.db3")
    base = sqlite3.connect(path)
    base.execute("INSERT INTO topics VALUES(2, '/odd', 'my_msgs/msg/Odd', 'cdr', '')")
    base.execute("INSERT INTO messages VALUES(99, 2, 5, ?)", (note(2, 1),))
    base.commit()
    base.close()
    with Bag(path) as bag:
        assert bag.unreadable == {"/odd": "expected a definition of my_msgs/msg/Odd, got none"}
        assert bag.topics["/odd"] == ("my_msgs/msg/Odd", 1)
        assert len(list(bag.messages())) == 10


def test_what_a_killed_recorder_left_in_its_journal_is_read(tmp_path):
    path = write_db3(tmp_path / "x.db3", 5)
    base = sqlite3.connect(path)
    base.execute("PRAGMA journal_mode=WAL")
    base.execute("INSERT INTO messages VALUES(99, 1, ?, ?)", (stamp(5), note(2, 5)))
    base.commit()
    for suffix in ("", "-wal", "-shm"):  # A copy, as if the recorder had died before it closed.
        (tmp_path / f"y.db3{suffix}").write_bytes((tmp_path / f"x.db3{suffix}").read_bytes())
    base.close()
    assert notes_of(tmp_path / "y.db3") == EVERY[:6]


def test_messages_in_damaged_pages_are_left_out(tmp_path):
    path = write_db3(tmp_path / "x.db3", 2000)
    data = bytearray(path.read_bytes())
    middle = len(data) // 3 // 4096 * 4096
    data[middle : middle + 4096] = b"\xff" * 4096
    path.write_bytes(data)
    with pytest.raises(BagError, match="expected a whole recording"), Bag(path):
        pass
    found = notes_of(path, damaged=True)
    assert 1000 < len(found) < 2000
    assert (found[0], found[-1]) == ("note 0", "note 1999")


def test_a_database_of_something_else_is_said(tmp_path):
    path = tmp_path / "x.db3"
    base = sqlite3.connect(path)
    base.execute("CREATE TABLE bookmarks(name TEXT)")
    base.commit()
    base.close()
    with pytest.raises(BagError, match="topics and messages, got bookmarks"), Bag(path):
        pass
