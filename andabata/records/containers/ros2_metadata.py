"""File metadata.yaml of a ROS 2 recording."""

from collections.abc import Mapping, Sequence
from io import StringIO
from pathlib import Path, PurePath
from typing import Any

from andabata.records.containers.container import Connection

METADATA = "metadata.yaml"

_ROOT = "rosbag2_bagfile_information"
_VERSION = 5
"""Version of the format that ROS 2 reads since Humble."""


def read_metadata(path: Path) -> dict[str, Any] | None:
    """Return the contents of a metadata.yaml; None if it is damaged."""
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError

    try:
        about = YAML(typ="safe").load(path.read_text())[_ROOT]
    except (YAMLError, KeyError, TypeError, ValueError):
        return None
    return about if isinstance(about, dict) else None


def storage_names(about: dict[str, Any] | None) -> list[str]:
    """Return the names of the files that a metadata.yaml lists."""
    listed = (about or {}).get("relative_file_paths")
    return [PurePath(str(name)).name for name in listed] if isinstance(listed, list) else []


def metadata_text(
    about: Mapping[str, Any] | None,
    files: Sequence[str],
    connections: Sequence[Connection],
    counts: Sequence[int],
    span_ns: tuple[int, int],
    compression: str,
) -> str:
    """Return the text of a metadata.yaml.

    Args:
        about: Contents of the source's metadata.yaml, whose other entries are kept; None without
            one.
        files: Names of the files with messages.
        connections: Connections of the recording.
        counts: Number of messages of each connection.
        span_ns: Stamps of the first and the last message [ns].
        compression: Compressed unit: ``FILE``, ``MESSAGE``, or empty for none.
    """
    from ruamel.yaml import YAML

    topics: dict[str, dict[str, Any]] = {}
    for connection, count in zip(connections, counts, strict=True):
        fields = {
            "name": connection.topic,
            "type": connection.kind,
            "serialization_format": connection.encoding,
            "offered_qos_profiles": connection.qos,
        }
        entry = topics.setdefault(connection.topic, {"topic_metadata": fields, "message_count": 0})
        entry["message_count"] += count
    known: dict[str, Any] = {**about} if about else {"version": _VERSION}
    for old in known.get("topics_with_message_count") or ():
        name = old.get("topic_metadata", {}).get("name")
        if name in topics:
            topics[name]["topic_metadata"] = old["topic_metadata"]
    known.pop("files", None)  # Counts and times by file, which may have changed.
    known |= {
        "storage_identifier": "mcap" if ".mcap" in files[0] else "sqlite3",
        "duration": {"nanoseconds": span_ns[1] - span_ns[0]},
        "starting_time": {"nanoseconds_since_epoch": span_ns[0]},
        "message_count": sum(counts),
        "topics_with_message_count": list(topics.values()),
        "compression_format": "zstd" if compression else "",
        "compression_mode": compression,
        "relative_file_paths": list(files),
    }
    text = StringIO()
    YAML(typ="safe").dump({_ROOT: known}, text)
    return text.getvalue()
