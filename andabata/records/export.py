"""Recorded topics as files that anything reads: clouds as PLY, the rest as CSV."""

import csv
import io
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from andabata.records.bags import Bag, BagError
from andabata.records.frames import is_base
from andabata.records.gathering import frame_of
from andabata.records.messages import NS, cloud_of, header_ns
from andabata.records.mounts import GivenMounting, Mounts
from andabata.records.storage import write_atomically
from andabata.records.topics import POINT_CLOUD, RosMessage
from andabata.records.transform_tree import read_transforms
from traversability.cloud import PointCloud


def read_bag_cloud(path: Path, topic: str | None, number: int = 0) -> PointCloud:
    """Return one cloud of a recording, in ``base_footprint`` or in ``sensor``.

    Args:
        path: The recording.
        topic: Whose; None for the only topic with clouds.
        number: Which of them, from 0; negative ones count from the end.

    Raises:
        BagError: If there is no such topic or cloud.
        FrameError: If the place of its frame on the robot cannot be known.
    """
    return read_mounted_cloud(path, topic, number, {})[0]


def read_mounted_cloud(
    path: Path, topic: str | None, number: int, given: Mapping[str, GivenMounting]
) -> tuple[PointCloud, list[str]]:
    """Return one cloud of a recording as ``read_bag_cloud`` does, and remarks on its frame.

    A cloud whose mounting is given keeps its coordinates and is in ``sensor``.
    """
    with Bag(path) as bag:
        message = _find_cloud(bag, topic, number)
        mounts = Mounts(given, read_transforms(bag))
    cloud = cloud_of(message, frame_of(message) or "sensor", header_ns(message) / NS)
    if mounts.mount("laser", cloud.frame).source == "option":
        return replace(cloud, frame="sensor", stamps=None), []
    cloud = replace(mounts.cloud(cloud, 0.0), stamps=None)
    frame = "base_footprint" if is_base(cloud.frame) else cloud.frame
    return replace(cloud, frame=frame), mounts.remarks


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
    place = number if number >= 0 else clouds[topic] + number
    for k, message in enumerate(bag.messages((topic,))):
        if k == place:
            return message.content
    raise BagError(f"--number: expected one of the {clouds[topic]} clouds of {topic}, got {number}")


def export_bag(
    path: Path,
    out: Path,
    topics: tuple[str, ...] | None = None,
    on_message: Callable[[], None] | None = None,
) -> list[Path]:
    """Write the topics of a recording to a folder; return the files.

    Args:
        path: The recording.
        out: A folder that is there.
        topics: Which; None for all.
        on_message: Called after each message.

    Raises:
        BagError: If a topic is not in the recording.
    """
    from traversability.files import cloud_to_bytes

    tables: dict[str, tuple[list[str], list[list[object]]]] = {}
    written: list[Path] = []
    counts: dict[str, int] = {}
    with Bag(path) as bag:
        missing = sorted(set(topics or ()) - set(bag.topics))
        if missing:
            known = ", ".join(sorted(bag.topics))
            raise BagError(f"--topic: expected some of {known}, got {', '.join(missing)}")
        for message in bag.messages(topics):
            name = message.topic.strip("/").replace("/", "_")
            if message.kind == POINT_CLOUD:
                number = counts.get(name, 0)
                counts[name] = number + 1
                where = out / f"{name}_{number:05d}.ply"
                write_atomically(where, cloud_to_bytes(cloud_of(message.content), "ply"))
                written.append(where)
            else:
                row = dict(_flat("", message.content))
                columns, rows = tables.setdefault(name, (list(row), []))
                rows.append([message.stamp_ns, *(row.get(column) for column in columns)])
            if on_message is not None:
                on_message()
    for name, (columns, rows) in tables.items():
        text = io.StringIO()
        writer = csv.writer(text)
        writer.writerow(["recorded_ns", *columns])
        writer.writerows(rows)
        where = out / f"{name}.csv"
        write_atomically(where, text.getvalue().encode())
        written.append(where)
    return written


def _flat(name: str, value: RosMessage) -> Iterator[tuple[str, object]]:
    """Yield the numbers and words of a message by dotted names."""
    if hasattr(value, "__dataclass_fields__"):
        for part in value.__dataclass_fields__:
            if not part.isupper() and not part.startswith("__"):
                yield from _flat(f"{name}.{part}".strip("."), getattr(value, part))
    elif isinstance(value, np.ndarray | list):
        for k, part in enumerate(value):
            yield from _flat(f"{name}.{k}", part)
    else:
        yield name, value.item() if isinstance(value, np.generic) else value
