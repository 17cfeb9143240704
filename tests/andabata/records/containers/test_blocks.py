"""The table of messages gives them back in the order of their times."""

from andabata.records.containers import blocks
from andabata.records.containers.blocks import MessageTable
from andabata.records.containers.container import RawMessage

BLOCKS = [b"aabbb", b"ccd"]


def table():
    """Return a table of four messages in two blocks."""
    made = MessageTable()
    made.add(0, 7, 30, 0, 2)
    made.add(0, 9, 10, 2, 3)
    made.add(1, 7, 10, 0, 2)
    made.add(1, 9, 20, 2, 1)
    return made


def test_messages_come_by_time_and_then_by_place():
    """Messages are sorted by stamp; equal stamps keep the order of the file."""
    assert list(table().read([7, 9], BLOCKS.__getitem__)) == [
        RawMessage(9, 10, b"bbb"),
        RawMessage(7, 10, b"cc"),
        RawMessage(9, 20, b"d"),
        RawMessage(7, 30, b"aa"),
    ]
    assert [m.stamp_ns for m in table().read([7], BLOCKS.__getitem__)] == [10, 30]


def test_messages_are_counted_by_connection_and_listed_by_block():
    """Counts, length and the messages of a block are those that were added."""
    made = table()
    assert (len(made), made.counts()) == (4, {7: 2, 9: 2})
    assert made.of_block(1) == [(7, 10, 0, 2), (9, 20, 2, 1)]
    assert made.of_block(2) == []


def test_a_block_is_decompressed_once_while_it_is_cached(monkeypatch):
    """Interleaved blocks are decompressed once with room in the cache, else again."""
    unpacked = []

    def decompress(block):
        unpacked.append(block)
        return BLOCKS[block]

    list(table().read([7, 9], decompress))
    assert unpacked == [0, 1]
    monkeypatch.setattr(blocks, "_CACHED_BLOCKS", 1)
    unpacked.clear()
    list(table().read([7, 9], decompress))
    assert unpacked == [0, 1, 0]
