"""sqlite3 files of ROS 2 are read alone, in every version of the tables, and when damaged."""

import sqlite3
import subprocess
import sys

import pytest

from andabata.records.bags import Bag, BagError
from tests.support.recordings import note, stamp, write_db3

EVERY = [f"note {k}" for k in range(10)]


def notes_of(path, damaged=False):
    """Return the texts of all messages of a recording."""
    with Bag(path, damaged) as bag:
        return [message.content.data for message in bag.messages()]


@pytest.mark.parametrize("definitions", [False, True])
def test_a_bare_file_is_read(tmp_path, definitions):
    """A file without its folder is read, with or without definitions."""
    path = write_db3(tmp_path / "x.db3", definitions=definitions)
    with Bag(path) as bag:
        assert bag.topics == {"/notes": ("std_msgs/msg/String", 10)}
        found = list(bag.messages())
    assert [(m.stamp_ns, m.content.data) for m in found] == [
        (stamp(k), f"note {k}") for k in range(10)
    ]


def test_an_unknown_type_makes_its_topic_unreadable_alone(tmp_path):
    """A type without a definition makes its topic unreadable and no other."""
    path = write_db3(tmp_path / "x.db3")
    database = sqlite3.connect(path)
    database.execute("INSERT INTO topics VALUES(2, '/odd', 'my_msgs/msg/Odd', 'cdr', '')")
    database.execute("INSERT INTO messages VALUES(99, 2, 5, ?)", (note(2, 1),))
    database.commit()
    database.close()
    with Bag(path) as bag:
        assert bag.unreadable == {"/odd": "expected a definition of my_msgs/msg/Odd, got none"}
        assert bag.topics["/odd"] == ("my_msgs/msg/Odd", 1)
        assert len(list(bag.messages())) == 10


def test_the_journal_of_a_killed_recorder_is_read(tmp_path):
    """Rows in the write-ahead log are read."""
    path = write_db3(tmp_path / "x.db3", 5)
    database = sqlite3.connect(path)
    database.execute("PRAGMA journal_mode=WAL")
    database.execute("INSERT INTO messages VALUES(99, 1, ?, ?)", (stamp(5), note(2, 5)))
    database.commit()
    for suffix in ("", "-wal", "-shm"):  # A copy, as if the recorder had been killed.
        (tmp_path / f"y.db3{suffix}").write_bytes((tmp_path / f"x.db3{suffix}").read_bytes())
    database.close()
    assert notes_of(tmp_path / "y.db3") == EVERY[:6]


_KILLED_IN_A_COMMIT = """
import os, signal, sqlite3, sys
database = sqlite3.connect(sys.argv[1])
# Pages that do not fit into the cache are written before the commit.
database.execute("PRAGMA cache_size=1")
database.execute("UPDATE messages SET data = zeroblob(300)")
rows = [(number,) for number in range(2000, 2500)]
database.executemany("INSERT INTO messages VALUES(?, 1, 0, zeroblob(2000))", rows)
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_commit_that_a_kill_has_cut_is_undone(tmp_path):
    """The messages before it are read, from a copy: the files stay as the recorder left them."""
    path = write_db3(tmp_path / "x.db3", 600)
    subprocess.run([sys.executable, "-c", _KILLED_IN_A_COMMIT, str(path)], check=False)
    files = {each.name: each.read_bytes() for each in tmp_path.iterdir()}
    assert sorted(files) == ["x.db3", "x.db3-journal"]
    assert notes_of(path) == [f"note {k}" for k in range(600)]
    assert {each.name: each.read_bytes() for each in tmp_path.iterdir()} == files


def test_messages_in_damaged_pages_are_left_out(tmp_path):
    """Messages around a damaged page are read; without `damaged` it is an error."""
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


def test_a_database_of_something_else_is_an_error(tmp_path):
    """A database without the tables of a recording is an error that names its tables."""
    path = tmp_path / "x.db3"
    database = sqlite3.connect(path)
    database.execute("CREATE TABLE bookmarks(name TEXT)")
    database.commit()
    database.close()
    with pytest.raises(BagError, match="topics and messages, got bookmarks"), Bag(path):
        pass
