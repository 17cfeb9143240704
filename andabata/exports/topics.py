"""Export of recorded topics to a folder: clouds as files of points, other messages as CSV."""

import tempfile
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType

import numpy as np

from andabata.distribution import install_extra
from andabata.exports.csv_table import CsvTable
from andabata.records.bags import Bag, BagError, LeftOut, Message
from andabata.records.decoding.point_cloud2 import (
    PointCloudError,
    decode_point_cloud2,
    point_columns,
)
from andabata.records.decoding.sensor_decoder import frame_of
from andabata.records.frames.extrinsics import Extrinsics
from andabata.records.frames.names import FrameError, is_base, is_world
from andabata.records.frames.sensor_pose import GivenMounting
from andabata.records.frames.transform_tree import read_transforms
from andabata.records.messages import NS, header_ns
from andabata.records.topics import POINT_CLOUD, RosMessage
from traversability.decoding import DecodedCloud
from traversability.formats import las, pcd, ply
from traversability.formats.coordinate_units import CoordinateUnits
from traversability.formats.table import COORDINATES, Columns

CLOUD_KINDS = ("ply", "pcd", "las", "laz")
"""Formats of exported clouds."""


@dataclass(frozen=True)
class ExportResult:
    """Result of an export.

    Attributes:
        files: Paths of the files written.
        left_out: Messages that could not be read or written.
        notes: Facts that a user should know although no message is missing.
    """

    files: tuple[Path, ...]
    left_out: tuple[LeftOut, ...]
    notes: tuple[str, ...]


def decode_bag_cloud(
    path: Path,
    topic: str | None,
    number: int = 0,
    given: Mapping[str, GivenMounting] = MappingProxyType({}),
    unit: float | None = None,
) -> DecodedCloud:
    """Return one cloud of a recording with remarks on its decoding.

    Args:
        path: Path of the recording.
        topic: Topic of the cloud; None for the only topic with clouds.
        number: Number of the cloud, from 0; negative ones count from the end.
        given: Mountings that the user gives, by sensor.
        unit: Length of the unit of the coordinates [m]; None for metres, ROS's unit.

    Returns:
        Cloud in ``base_footprint``; in ``sensor``, with unchanged coordinates, if the laser's
        mounting is given.

    Raises:
        BagError: If there is no such topic or cloud.
        FrameError: If the mounting of its frame on the robot is unknown.
    """
    with Bag(path, damaged=True) as bag:
        message = _find_cloud(bag, topic, number)
        extrinsics = Extrinsics(given, read_transforms(bag))
        notes = bag.notes
    frame, stamp = frame_of(message) or "sensor", header_ns(message) / NS
    units = None if unit is None else CoordinateUnits.given(unit)
    decoded = decode_point_cloud2(message, frame, stamp, units).noting(*notes)
    cloud = decoded.cloud
    try:
        pose = extrinsics.pose_of("laser", cloud.frame)
    except FrameError as error:
        if not is_world(cloud.frame):
            raise
        raise FrameError(
            f"{error}; --sensor-at X,Y,Z with --mounting laser=0,0,HEIGHT,0,0,0 reads it from there"
        ) from error
    if pose.source == "option":
        return replace(decoded, cloud=replace(cloud, frame="sensor", stamps=None))
    cloud = replace(extrinsics.transform_cloud(cloud, 0.0), stamps=None)
    frame = "base_footprint" if is_base(cloud.frame) else cloud.frame
    rotation = pose.transform.rotation if pose.source == "name" else None
    decoded = replace(decoded, cloud=replace(cloud, frame=frame), rotation=rotation)
    return decoded.noting(*extrinsics.remarks)


def _find_cloud(bag: Bag, topic: str | None, number: int) -> RosMessage:
    """Return the message of a cloud.

    Raises:
        BagError: If there is no such topic or cloud.
    """
    clouds = {name: n for name, (kind, n) in bag.topics.items() if kind == POINT_CLOUD}
    if topic is None and len(clouds) == 1:
        topic = next(iter(clouds))
    if topic not in clouds:
        listed = ", ".join(f"{name} ({n})" for name, n in sorted(clouds.items())) or "none"
        lost = "".join(f"; {name}: {reason}" for name, reason in sorted(bag.unreadable.items()))
        text = (
            f"--topic: expected one of the clouds of {bag.path}: {listed}; got {topic or 'no name'}"
        )
        raise BagError(text + lost)
    if topic in bag.unreadable:
        raise BagError(f"{bag.path}: {topic} can't be read: {bag.unreadable[topic]}")
    messages = (each for each in bag.messages((topic,)) if each.kind == POINT_CLOUD)
    # Counting from the end needs the last ones: not every counted message can be read.
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
    clouds: str = "ply",
) -> ExportResult:
    """Write the topics of a recording to a folder.

    Every message type of a topic has files of its own. The files take their names, and replace
    old ones, when all of them are complete.

    Args:
        path: Path of the recording.
        out: Path of the folder, which is created if it does not exist.
        topics: Names of the topics; None for all.
        on_message: Function called after each message.
        clouds: Format of the clouds, one of ``CLOUD_KINDS``. Only PLY keeps points without a
            return, whose coordinates are NaN.

    Raises:
        BagError: If a topic is not in the recording, or the format's package is not installed.
        OSError: If a file cannot be written.
    """
    _check_cloud_kind(clouds)
    with Bag(path, damaged=True) as bag:
        missing = sorted(set(topics or ()) - set(bag.topics))
        if missing:
            known = ", ".join(sorted(bag.topics))
            raise BagError(f"--topic: expected some of {known}, got {', '.join(missing)}")
        with _staged(out) as folder, ExitStack() as tables:
            export = _Export(bag, folder, tables, clouds)
            for message in bag.messages(topics):
                export.add(message)
                if on_message is not None:
                    on_message()
            export.finish()
        left_out = [
            each for each in bag.left_out if topics is None or each.topic in (None, *topics)
        ]
    files = tuple(out / name for name in export.files)
    return ExportResult(files, (*left_out, *export.bad_clouds.values()), tuple(export.notes))


class _Export:
    """Export in progress.

    Attributes:
        files: Names of the files written.
        notes: Facts that a user should know although no message is missing.
        bad_clouds: Clouds that cannot be decoded, by topic.
    """

    def __init__(self, bag: Bag, folder: Path, tables: ExitStack, clouds: str) -> None:
        self._clouds = clouds
        self._names = file_names([(each.topic, each.kind) for each in bag.connections])
        self._folder, self._open_tables = folder, tables
        self._tables: dict[str, CsvTable] = {}
        self._counts: dict[str, int] = {}
        self.files: list[str] = []
        self.notes = list(bag.notes)
        self.bad_clouds: dict[str, LeftOut] = {}

    def add(self, message: Message) -> None:
        """Write a message to the file of its topic and type."""
        name = self._names[message.topic, message.kind]
        if message.kind == POINT_CLOUD:
            self._add_cloud(name, message)
            return
        if name not in self._tables:
            table = CsvTable(self._folder / f"{name}.csv")
            self._tables[name] = self._open_tables.enter_context(table)
        self._tables[name].add(message.stamp_ns, message.content)

    def _add_cloud(self, name: str, message: Message) -> None:
        """Write a cloud to a file of its own."""
        number = self._counts.get(name, 0)
        self._counts[name] = number + 1
        try:
            columns, remarks = point_columns(message.content)
            data = _render(columns, self._clouds)
        except PointCloudError as error:
            self.bad_clouds[message.topic] = _one_more(self.bad_clouds, message.topic, str(error))
            return
        notes = [f"{message.topic}: {text}" for text in remarks]
        self.notes += [note for note in notes if note not in self.notes]
        self.files.append(f"{name}_{number:05d}.{self._clouds}")
        (self._folder / self.files[-1]).write_bytes(data)

    def finish(self) -> None:
        """Write the CSV files."""
        for name, table in self._tables.items():
            self.files.append(table.finish().name)
            self.notes += [f"{name}.csv: {note}" for note in table.notes]


def _check_cloud_kind(kind: str) -> None:
    """Check that clouds can be written in a format.

    Raises:
        BagError: If it is unknown, or its package is not installed.
    """
    if kind not in CLOUD_KINDS:
        raise BagError(f"clouds: expected one of {', '.join(CLOUD_KINDS)}, got {kind!r}")
    if kind in ("las", "laz") and find_spec("laspy") is None:
        raise BagError(
            f"clouds: expected laspy for {kind}, got none; install the extra `las` "
            f"({install_extra('las')}), or choose ply or pcd"
        )


def _render(columns: Columns, kind: str) -> bytes:
    """Return the file of a cloud's columns."""
    if kind == "ply":
        return ply.render(columns)
    are_returns = np.isfinite(np.stack([columns[name] for name in COORDINATES])).all(axis=0)
    kept = {name: column[are_returns] for name, column in columns.items()}
    return pcd.render(kept) if kind == "pcd" else las.render(kept, kind == "laz")


@contextmanager
def _staged(out: Path) -> Iterator[Path]:
    """Yield a temporary folder whose files move to ``out`` when the block has succeeded."""
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


def _one_more(left_out: dict[str, LeftOut], topic: str, reason: str) -> LeftOut:
    """Return the damaged clouds of a topic with one more."""
    before = left_out.get(topic)
    if before is None or before.messages is None:
        return LeftOut(topic, 1, reason)
    return LeftOut(topic, before.messages + 1, before.reason)


def file_names(streams: list[tuple[str, str]]) -> dict[tuple[str, str], str]:
    """Return file names without suffix by topic and type; no two are the same.

    Args:
        streams: Pairs of topic and message type.
    """
    names: dict[tuple[str, str], str] = {}
    # File systems that ignore case do not distinguish /Imu from /imu.
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
