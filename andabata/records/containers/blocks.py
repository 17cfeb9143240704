"""Table of a file's messages, found block by block and read in the order of their times."""

from array import array
from bisect import bisect_left
from collections import OrderedDict
from collections.abc import Callable, Collection, Iterator

import numpy as np

from andabata.records.containers.container import RawMessage

_CACHED_BLOCKS = 8
"""Number of blocks kept decompressed: recorders interleave few of them in time."""


class MessageTable:
    """Table with place, time and connection of every message of a file.

    A block is a part of the file that is decompressed as a whole: a chunk, or the file itself.
    """

    def __init__(self) -> None:
        """Create an empty table."""
        self._stamps, self._offsets = array("Q"), array("Q")
        self._connections, self._blocks, self._sizes = array("Q"), array("Q"), array("Q")

    def __len__(self) -> int:
        """Return the number of messages."""
        return len(self._stamps)

    def add(self, block: int, connection: int, stamp_ns: int, offset: int, size: int) -> None:
        """Add a message.

        Args:
            block: Number of its block.
            connection: Number of its connection in the file.
            stamp_ns: Time of recording [ns].
            offset: Offset of its bytes in the block.
            size: Number of its bytes.
        """
        self._stamps.append(stamp_ns)
        self._offsets.append(offset)
        self._connections.append(connection)
        self._blocks.append(block)
        self._sizes.append(size)

    def counts(self) -> dict[int, int]:
        """Return the number of messages by the number of their connection in the file."""
        numbers, counts = np.unique(_column(self._connections), return_counts=True)
        return dict(zip(numbers.tolist(), counts.tolist(), strict=True))

    def read(
        self, wanted: Collection[int], decompress: Callable[[int], bytes | memoryview]
    ) -> Iterator[RawMessage]:
        """Yield messages in the order of their times; those of one time in the order of the file.

        Args:
            wanted: Numbers of connections in the file.
            decompress: Function that returns the bytes of a block.
        """
        connections = _column(self._connections)
        chosen = np.flatnonzero(np.isin(connections, np.fromiter(wanted, np.uint64)))
        order = chosen[np.argsort(_column(self._stamps)[chosen], kind="stable")]
        cache: OrderedDict[int, bytes | memoryview] = OrderedDict()
        for k in order.tolist():
            block = self._blocks[k]
            if block not in cache:
                cache[block] = decompress(block)
                if len(cache) > _CACHED_BLOCKS:
                    cache.popitem(last=False)
            cache.move_to_end(block)
            offset = self._offsets[k]
            data = bytes(cache[block][offset : offset + self._sizes[k]])
            yield RawMessage(self._connections[k], self._stamps[k], data)

    def of_block(self, block: int) -> list[tuple[int, int, int, int]]:
        """Return connection, stamp [ns], offset and size of each message of a block."""
        # Blocks are scanned one after the other, so their numbers ascend: a binary search.
        first, last = bisect_left(self._blocks, block), bisect_left(self._blocks, block + 1)
        return [
            (self._connections[k], self._stamps[k], self._offsets[k], self._sizes[k])
            for k in range(first, last)
        ]


def _column(values: "array[int]") -> "np.ndarray[tuple[int], np.dtype[np.uint64]]":
    """Return a copy of a column; a view would lock the table's size."""
    return np.array(values, dtype=np.uint64)
