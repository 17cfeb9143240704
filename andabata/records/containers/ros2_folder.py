"""Reader of a ROS 2 recording's folder: all its files, with or without metadata.yaml."""

import heapq
from collections.abc import Callable, Collection, Iterator
from pathlib import Path
from typing import Any

from andabata.records.containers.container import (
    BagError,
    Connection,
    Container,
    Damage,
    RawMessage,
    count_mismatches,
)
from andabata.records.containers.ros2_metadata import METADATA, read_metadata, storage_names

STORAGE_SUFFIXES = (".db3", ".mcap", ".db3.zstd", ".mcap.zstd", ".db3.zst", ".mcap.zst")


class Ros2Folder:
    """Reader of a folder of ``.db3`` or ``.mcap`` files.

    Attributes:
        connections: Connections of all files; equal ones are merged.
        counts: Number of whole messages of each connection.
        damage: Parts that cannot be read.
        lost: Number of messages that the files no longer hold; None if it is unknown of one.
        notes: Facts that a user should know although no message is missing.
        files: Files that could be opened.
        paths: Paths of these files.
        metadata: Contents of metadata.yaml; None without a readable one.
    """

    def __init__(self, path: Path, open_file: Callable[[Path], Container]) -> None:
        """Open and scan a folder.

        Args:
            path: Path of the folder.
            open_file: Function that opens one of its files.

        Raises:
            BagError: If the folder holds no recording.
        """
        self.path = path
        self.notes: list[str] = []
        self.damage: list[Damage] = []
        self.lost: int | None = 0
        self.files: list[Container] = []
        self.finished = True
        self.paths: list[Path] = []
        self.metadata = self._metadata()
        try:
            self._open(self.metadata, open_file)
        except BaseException:
            self.close()
            raise

    def _metadata(self) -> dict[str, Any] | None:
        """Return the contents of metadata.yaml; None without a readable one."""
        path = self.path / METADATA
        if not path.is_file():
            self.notes.append(f"no {METADATA}: read from the files themselves")
            return None
        metadata = read_metadata(path)
        if metadata is None:
            self.notes.append(f"{METADATA} is damaged: read from the files themselves")
        return metadata

    def _open(
        self, metadata: dict[str, Any] | None, open_file: Callable[[Path], Container]
    ) -> None:
        """Open the files and merge their connections.

        Raises:
            BagError: If there is no file, or none can be opened.
        """
        paths = storage_files(self.path, metadata)
        for name in storage_names(metadata):
            if self.path / name not in paths:
                reason = f"expected the file {name}, got none in the folder"
                self.damage.append(Damage(0, 0, reason))
                self.lost = None
        if not paths:
            raise BagError(
                f"{self.path}: expected a ROS 2 recording with .db3 or .mcap files, got none"
            )
        counts: dict[Connection, int] = {}
        self.counts: list[int] = []
        self._indices: list[list[int]] = []
        for path in paths:
            file = self._open_one(path, open_file)
            if file is None:
                continue
            indices = [
                counts.setdefault(connection, len(counts)) for connection in file.connections
            ]
            self.counts += [0] * (len(counts) - len(self.counts))
            for index, count in zip(indices, file.counts, strict=True):
                self.counts[index] += count
            self._indices.append(indices)
        if not self.files:
            raise BagError(f"{self.path}: {self.damage[-1].reason}")
        self.connections = list(counts)
        self._compare(metadata)

    def _open_one(self, path: Path, open_file: Callable[[Path], Container]) -> Container | None:
        """Open a file; one that can't be read at all is skipped, and counted as damage."""
        try:
            file = open_file(path)
        except BagError as error:
            self.damage.append(Damage(0, 0, str(error)))
            self.lost = None
            return None
        self.files.append(file)
        self.paths.append(path)
        self.damage += file.damage
        self.finished = self.finished and file.finished
        self.notes += [f"{path.name}: {note}" for note in file.notes]
        self.lost = None if self.lost is None or file.lost is None else self.lost + file.lost
        return file

    def _compare(self, metadata: dict[str, Any] | None) -> None:
        """Compare the numbers of messages with those in metadata.yaml."""
        if metadata is None or self.damage:
            return
        try:
            stated = {
                str(each["topic_metadata"]["name"]): int(each["message_count"])
                for each in metadata["topics_with_message_count"]
            }
        except (KeyError, TypeError, ValueError):
            self.notes.append(f"{METADATA} holds no counts")
            return
        first = {c.topic: k for k, c in reversed(list(enumerate(self.connections)))}
        by_index = {first[topic]: count for topic, count in stated.items() if topic in first}
        self.notes += count_mismatches(self.connections, self.counts, by_index)

    def read(self, wanted: Collection[int]) -> Iterator[RawMessage]:
        """Yield the messages of some connections by the time at which they were recorded."""
        streams = [
            _renumbered(file, indices, wanted)
            for file, indices in zip(self.files, self._indices, strict=True)
        ]
        yield from heapq.merge(*streams, key=lambda message: message.stamp_ns)

    def close(self) -> None:
        """Close the files."""
        for file in self.files:
            file.close()


def _renumbered(
    file: Container, indices: list[int], wanted: Collection[int]
) -> Iterator[RawMessage]:
    """Yield the messages of one file with the folder's indices of connections."""
    chosen = [k for k, index in enumerate(indices) if index in wanted]
    for message in file.read(chosen):
        yield RawMessage(indices[message.connection], message.stamp_ns, message.data)


def storage_files(folder: Path, metadata: dict[str, Any] | None) -> list[Path]:
    """Return the paths of a folder's files with messages.

    These are the files that metadata.yaml lists and that exist; without any, all such files in
    the order of their numbers.

    Args:
        folder: Path of the folder.
        metadata: Contents of metadata.yaml; None without a readable one.
    """
    present = [path for path in folder.iterdir() if path.name.endswith(STORAGE_SUFFIXES)]
    present.sort(key=_split_order)
    # A file that is there compressed as well as decompressed is read once.
    names = {path.name for path in present}
    compressed = {name for name in names if name.rpartition(".")[0] in names}
    listed = [folder / name for name in storage_names(metadata) if name in names]
    if listed:
        return listed
    return [path for path in present if path.name not in compressed]


def _split_order(path: Path) -> tuple[str, int]:
    """Return a sort key that puts ``name_10`` after ``name_9``."""
    stem = path.name.partition(".")[0]
    name, _, number = stem.rpartition("_")
    return (name, int(number)) if number.isdigit() else (stem, -1)
