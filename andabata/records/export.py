"""Recorded topics as files that anything reads: clouds as PLY, the rest as CSV."""

import tempfile
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

from andabata.records.bags import Bag, BagError, LeftOut, Message
from andabata.records.csv_table import CsvTable
from andabata.records.extrinsics import Extrinsics
from andabata.records.frames import is_base
from andabata.records.messages import NS, header_ns
from andabata.records.point_cloud2 import PointCloudError, decode_point_cloud2, point_columns
from andabata.records.sensor_decoder import frame_of
from andabata.records.sensor_pose import GivenMounting
from andabata.records.topics import POINT_CLOUD, RosMessage
from andabata.records.transform_tree import read_transforms
from traversability.cloud import PointCloud
from traversability.decoding import DecodedCloud
from traversability.formats import ply


@dataclass(frozen=True)
class Exported:
    """Result of an export.

    Attributes:
        files: Files written.
        left_out: Messages that could not be read or written.
        notes: What a user should know although no message is missing.
    """

    files: tuple[Path, ...]
    left_out: tuple[LeftOut, ...]
    notes: tuple[str, ...]


def read_bag_cloud(path: Path, topic: str | None, number: int = 0) -> PointCloud:
    """Return one cloud of a recording; see ``decode_bag_cloud``, which tells how it was read."""
    return decode_bag_cloud(path, topic, number).cloud


def decode_bag_cloud(
    path: Path,
    topic: str | None,
    number: int = 0,
    given: Mapping[str, GivenMounting] = MappingProxyType({}),
) -> DecodedCloud:
    """Return one cloud of a recording, in ``base_footprint`` or in ``sensor``, and how it was read.

    Args:
        path: The recording.
        topic: Topic of the cloud; None for the only topic with clouds.
        number: Number of the cloud, from 0; negative ones count from the end.
        given: Mountings that are told; the cloud of such a laser keeps its coordinates and is in
            ``sensor``.

    Raises:
        BagError: If there is no such topic or cloud.
        FrameError: If the place of its frame on the robot cannot be known.
    """
    with Bag(path, damaged=True) as bag:
        message = _find_cloud(bag, topic, number)
        extrinsics = Extrinsics(given, read_transforms(bag))
    decoded = decode_point_cloud2(message, frame_of(message) or "sensor", header_ns(message) / NS)
    cloud = decoded.cloud
    if extrinsics.pose_of("laser", cloud.frame).source == "option":
        return replace(decoded, cloud=replace(cloud, frame="sensor", stamps=None))
    cloud = replace(extrinsics.transform_cloud(cloud, 0.0), stamps=None)
    frame = "base_footprint" if is_base(cloud.frame) else cloud.frame
    return replace(decoded, cloud=replace(cloud, frame=frame)).noting(*extrinsics.remarks)


def _find_cloud(bag: Bag, topic: str | None, number: int) -> RosMessage:
    """Return the message of a cloud.

    Raises:
        BagError: If there is no such topic or cloud.
    """
    clouds = {name: n for name, (kind, n) in bag.topics.items() if kind == POINT_CLOUD}
    if topic is None and len(clouds) == 1:
        topic = next(iter(clouds))
    if topic not in clouds:
        found = ", ".join(f"{name} ({n})" for name, n in sorted(clouds.items())) or "none"
        raise BagError(f"--topic: expected one of the clouds of {bag.path}: {found}; got {topic}")
    if topic in bag.unreadable:
        raise BagError(f"{bag.path}: {topic} can't be read: {bag.unreadable[topic]}")
    messages = (each for each in bag.messages((topic,)) if each.kind == POINT_CLOUD)
    # The last ones are kept, since not every message that is counted can be read.
    kept: deque[Message] = deque(maxlen=max(-number, 1))
    for k, message in enumerate(messages):
        kept.append(message)
        if k == number:
            break
    else:
        k = len(kept) if number < 0 else -1
    if (number >= 0 and k == number) or (number < 0 and len(kept) == -number):
        return kept[-1 if number >= 0 else 0].content
    raise BagError(f"--number: expected one of the {clouds[topic]} clouds of {topic}, got {number}")


def export_bag(
    path: Path,
    out: Path,
    topics: tuple[str, ...] | None = None,
    on_message: Callable[[], None] | None = None,
) -> Exported:
    """Write the topics of a recording to a folder.

    Every message type of a topic has files of its own. The files, new ones and those that replace
    old ones, get their names when all of them are whole.

    Args:
        path: The recording.
        out: A folder, made if it is not there.
        topics: Which; None for all.
        on_message: Called after each message.

    Raises:
        BagError: If a topic is not in the recording.
        OSError: If a file cannot be written.
    """
    with Bag(path, damaged=True) as bag:
        missing = sorted(set(topics or ()) - set(bag.topics))
        if missing:
            known = ", ".join(sorted(bag.topics))
            raise BagError(f"--topic: expected some of {known}, got {', '.join(missing)}")
        with _staged(out) as folder, ExitStack() as tables:
            export = _Export(bag, folder, tables)
            for message in bag.messages(topics):
                export.add(message)
                if on_message is not None:
                    on_message()
            export.finish()
        left_out = [
            each for each in bag.left_out if topics is None or each.topic in (None, *topics)
        ]
    files = tuple(out / name for name in export.files)
    return Exported(files, (*left_out, *export.bad_clouds.values()), tuple(export.notes))


class _Export:
    """One export on its way."""

    def __init__(self, bag: Bag, folder: Path, tables: ExitStack) -> None:
        self._names = file_names([(each.topic, each.kind) for each in bag.connections])
        self._folder, self._open_tables = folder, tables
        self._tables: dict[str, CsvTable] = {}
        self._counts: dict[str, int] = {}
        self.files: list[str] = []
        self.notes = list(bag.notes)
        self.bad_clouds: dict[str, LeftOut] = {}

    def add(self, message: Message) -> None:
        """Take a message."""
        name = self._names[message.topic, message.kind]
        if message.kind == POINT_CLOUD:
            self._add_cloud(name, message)
            return
        if name not in self._tables:
            table = CsvTable(self._folder / f"{name}.csv")
            self._tables[name] = self._open_tables.enter_context(table)
        self._tables[name].add(message.stamp_ns, message.content)

    def _add_cloud(self, name: str, message: Message) -> None:
        """Write a cloud."""
        number = self._counts.get(name, 0)
        self._counts[name] = number + 1
        try:
            data = ply.render(point_columns(message.content))
        except PointCloudError as error:
            self.bad_clouds[message.topic] = _one_more(self.bad_clouds, message.topic, str(error))
            return
        self.files.append(f"{name}_{number:05d}.ply")
        (self._folder / self.files[-1]).write_bytes(data)

    def finish(self) -> None:
        """Write the tables."""
        for name, table in self._tables.items():
            self.files.append(table.finish().name)
            self.notes += [f"{name}.csv: {note}" for note in table.notes]


@contextmanager
def _staged(out: Path) -> Iterator[Path]:
    """Give a folder whose files go to another one when the block ends without an error."""
    new = not out.exists()
    out.mkdir(parents=True, exist_ok=True)
    try:
        with tempfile.TemporaryDirectory(prefix=".export-", dir=out) as name:
            yield Path(name)
            for path in sorted(Path(name).iterdir()):
                path.replace(out / path.name)
    except BaseException:
        if new:
            out.rmdir()
        raise


def _one_more(found: dict[str, LeftOut], topic: str, reason: str) -> LeftOut:
    """Return a topic's damaged clouds with one more."""
    before = found.get(topic)
    if before is None or before.messages is None:
        return LeftOut(topic, 1, reason)
    return LeftOut(topic, before.messages + 1, before.reason)


def file_names(streams: list[tuple[str, str]]) -> dict[tuple[str, str], str]:
    """Return a file's name without suffix for each topic and type; no two are the same.

    Args:
        streams: Topics and types.
    """
    names: dict[tuple[str, str], str] = {}
    # File systems that ignore case would take /Imu and /imu for one.
    taken: set[str] = set()
    for stream in sorted(set(streams)):
        base = "".join(c if c.isalnum() or c in "-._" else "_" for c in stream[0].strip("/"))
        base = base.lstrip(".") or "topic"
        name, number = base, 1
        while name.lower() in taken:
            number += 1
            name = f"{base}_{number}"
        taken.add(name.lower())
        names[stream] = name
    return names
