"""A ROS 2 recording's folder: its files one after the other, with or without metadata.yaml."""

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
    """A folder of ``.db3`` or ``.mcap`` files.

    Attributes:
        connections: All connections of all files; equal ones are one.
        counts: Number of whole messages of each connection.
        damage: What cannot be read.
        lost: Number of messages that the files once held; None where one doesn't tell.
        notes: What a user should know although no message is missing.
        files: Files that could be opened.
        paths: Where they lie.
        about: What metadata.yaml tells; None without it.
    """

    def __init__(self, path: Path, open_file: Callable[[Path], Container]) -> None:
        """Open and scan a folder.

        Args:
            path: The folder.
            open_file: Function that opens one of its files.

        Raises:
            BagError: If it holds no recording.
        """
        self.path = path
        self.notes: list[str] = []
        self.damage: list[Damage] = []
        self.lost: int | None = 0
        self.files: list[Container] = []
        self.paths: list[Path] = []
        self.about = self._metadata()
        try:
            self._open(self.about, open_file)
        except BaseException:
            self.close()
            raise

    def _metadata(self) -> dict[str, Any] | None:
        """Return what metadata.yaml tells, or None."""
        where = self.path / METADATA
        if not where.is_file():
            self.notes.append(f"no {METADATA}: read from the files themselves")
            return None
        about = read_metadata(where)
        if about is None:
            self.notes.append(f"{METADATA} is damaged: read from the files themselves")
        return about

    def _open(self, about: dict[str, Any] | None, open_file: Callable[[Path], Container]) -> None:
        """Open the files and join their connections."""
        paths = storage_files(self.path, about)
        for name in storage_names(about):
            if self.path / name not in paths:
                reason = f"expected the file {name}, got none in the folder"
                self.damage.append(Damage(0, 0, reason))
                self.lost = None
        if not paths:
            raise BagError(
                f"{self.path}: expected a ROS 2 recording with .db3 or .mcap files, got none"
            )
        found: dict[Connection, int] = {}
        self.counts: list[int] = []
        self._places: list[list[int]] = []
        for path in paths:
            file = self._open_one(path, open_file)
            if file is None:
                continue
            places = [found.setdefault(connection, len(found)) for connection in file.connections]
            self.counts += [0] * (len(found) - len(self.counts))
            for place, count in zip(places, file.counts, strict=True):
                self.counts[place] += count
            self._places.append(places)
        if not self.files:
            raise BagError(f"{self.path}: {self.damage[-1].reason}")
        self.connections = list(found)
        self._compare(about)

    def _open_one(self, path: Path, open_file: Callable[[Path], Container]) -> Container | None:
        """Open a file; one that can't be read at all costs itself alone."""
        try:
            file = open_file(path)
        except BagError as error:
            self.damage.append(Damage(0, 0, str(error)))
            self.lost = None
            return None
        self.files.append(file)
        self.paths.append(path)
        self.damage += file.damage
        self.notes += [f"{path.name}: {note}" for note in file.notes]
        self.lost = None if self.lost is None or file.lost is None else self.lost + file.lost
        return file

    def _compare(self, about: dict[str, Any] | None) -> None:
        """Compare what was found with what metadata.yaml tells."""
        if about is None or self.damage:
            return
        try:
            stated = {
                str(each["topic_metadata"]["name"]): int(each["message_count"])
                for each in about["topics_with_message_count"]
            }
        except (KeyError, TypeError, ValueError):
            self.notes.append(f"{METADATA} tells no counts")
            return
        first = {c.topic: k for k, c in reversed(list(enumerate(self.connections)))}
        by_place = {first[topic]: count for topic, count in stated.items() if topic in first}
        self.notes += count_mismatches(self.connections, self.counts, by_place)

    def read(self, wanted: Collection[int]) -> Iterator[RawMessage]:
        """Yield the messages of some connections by the time at which they were recorded."""
        streams = [
            _placed(file, places, wanted)
            for file, places in zip(self.files, self._places, strict=True)
        ]
        yield from heapq.merge(*streams, key=lambda message: message.stamp_ns)

    def close(self) -> None:
        """Close the files."""
        for file in self.files:
            file.close()


def _placed(file: Container, places: list[int], wanted: Collection[int]) -> Iterator[RawMessage]:
    """Yield the messages of one file with the folder's numbers of connections."""
    chosen = [k for k, place in enumerate(places) if place in wanted]
    for message in file.read(chosen):
        yield RawMessage(places[message.connection], message.stamp_ns, message.data)


def storage_files(folder: Path, about: dict[str, Any] | None) -> list[Path]:
    """Return a folder's files of messages: the listed ones first, then the others.

    Args:
        folder: The recording.
        about: What metadata.yaml tells; None without it.
    """
    there = [path for path in folder.iterdir() if path.name.endswith(STORAGE_SUFFIXES)]
    there.sort(key=_split_order)
    # A file that is there unpacked as well as packed is read once.
    names = {path.name for path in there}
    packed = {name for name in names if name.rpartition(".")[0] in names}
    listed = [folder / name for name in storage_names(about) if name in names]
    if listed:
        return listed
    return [path for path in there if path.name not in packed]


def _split_order(path: Path) -> tuple[str, int]:
    """Return a key that puts ``name_10`` behind ``name_9``."""
    stem = path.name.partition(".")[0]
    name, _, number = stem.rpartition("_")
    return (name, int(number)) if number.isdigit() else (stem, -1)
