"""Messages of a file found block by block, and read again in the order of their times."""

from array import array
from bisect import bisect_left
from collections import OrderedDict
from collections.abc import Callable, Collection, Iterator

import numpy as np

from andabata.records.containers.container import RawMessage

_CACHED_BLOCKS = 8
"""Blocks kept unpacked: recorders interleave few of them in time."""


class MessageTable:
    """Place, time and connection of every message of a file.

    A block is a stretch that is unpacked as a whole: a chunk, or the file itself.
    """

    def __init__(self) -> None:
        """Begin without messages."""
        self._stamps, self._places = array("Q"), array("Q")
        self._connections, self._blocks, self._sizes = array("Q"), array("Q"), array("Q")

    def __len__(self) -> int:
        """Return the number of messages."""
        return len(self._stamps)

    def add(self, block: int, connection: int, stamp_ns: int, place: int, size: int) -> None:
        """Add a message.

        Args:
            block: Number of its block.
            connection: Connection's number in the file.
            stamp_ns: When it was recorded [ns].
            place: Offset of its bytes in the block.
            size: Number of its bytes.
        """
        self._stamps.append(stamp_ns)
        self._places.append(place)
        self._connections.append(connection)
        self._blocks.append(block)
        self._sizes.append(size)

    def counts(self) -> dict[int, int]:
        """Return the number of messages by the connection's number in the file."""
        numbers, counts = np.unique(_column(self._connections), return_counts=True)
        return dict(zip(numbers.tolist(), counts.tolist(), strict=True))

    def read(
        self, wanted: Collection[int], unpack: Callable[[int], bytes | memoryview]
    ) -> Iterator[RawMessage]:
        """Yield messages by time; those of one time in the order of the file.

        Args:
            wanted: Connections' numbers in the file.
            unpack: Function that returns the bytes of a block.
        """
        connections = _column(self._connections)
        chosen = np.flatnonzero(np.isin(connections, np.fromiter(wanted, np.uint64)))
        order = chosen[np.argsort(_column(self._stamps)[chosen], kind="stable")]
        cache: OrderedDict[int, bytes | memoryview] = OrderedDict()
        for k in order.tolist():
            block = self._blocks[k]
            if block not in cache:
                cache[block] = unpack(block)
                if len(cache) > _CACHED_BLOCKS:
                    cache.popitem(last=False)
            cache.move_to_end(block)
            place = self._places[k]
            data = bytes(cache[block][place : place + self._sizes[k]])
            yield RawMessage(self._connections[k], self._stamps[k], data)

    def of_block(self, block: int) -> list[tuple[int, int, int, int]]:
        """Return connection, stamp [ns], offset and size of each message of a block."""
        # Blocks are scanned one after the other, so their numbers ascend.
        first, last = bisect_left(self._blocks, block), bisect_left(self._blocks, block + 1)
        return [
            (self._connections[k], self._stamps[k], self._places[k], self._sizes[k])
            for k in range(first, last)
        ]


def _column(values: "array[int]") -> "np.ndarray[tuple[int], np.dtype[np.uint64]]":
    """Return a copy of a column, so that the table may grow on."""
    return np.array(values, dtype=np.uint64)
