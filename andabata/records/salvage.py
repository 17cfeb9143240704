"""Salvage of a damaged or unfinished recording: its whole messages in a new recording."""

import tempfile
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from andabata.records.bags import BagError, readable
from andabata.records.containers.compression import ZSTD_MAGIC
from andabata.records.containers.container import Container, Damage
from andabata.records.containers.mcap_copy import copy_mcap
from andabata.records.containers.mcap_file import McapFile
from andabata.records.containers.opening import DecompressedFile, open_container
from andabata.records.containers.ros2_folder import Ros2Folder
from andabata.records.containers.ros2_metadata import METADATA, metadata_text
from andabata.records.containers.rosbag1_copy import copy_bag
from andabata.records.containers.rosbag1_file import Rosbag1File
from andabata.records.containers.sqlite_copy import copy_sqlite
from andabata.records.containers.sqlite_file import SqliteFile
from andabata.records.manifest import changed_files
from andabata.runs import atomic_io

_UNFINISHED = "the recording has no end: its recorder did not finish it"
_COMPRESSED = (".zstd", ".zst")


@dataclass(frozen=True)
class SalvageResult:
    """Result of a salvage.

    Attributes:
        messages: Number of messages that were kept.
        lost: True if something was damaged.
        lost_messages: Number of messages lost; the least possible one if a part of the index is
            lost, too; None if it is unknown.
        reason: Description of the damage; empty without any.
        notes: Facts that a user should know although nothing is lost.
        finished: True if the recorder finished the file; otherwise its last second may be missing.
    """

    messages: int
    lost: bool
    lost_messages: int | None
    reason: str
    notes: tuple[str, ...]
    finished: bool = True


def salvage(source: Path, target: Path) -> SalvageResult:
    """Write the whole messages of a recording to a new one of the same format.

    Reading goes on behind damage. The new recording takes its name when it is complete.

    Args:
        source: Path of a ``.bag``, ``.mcap`` or ``.db3`` file or of a ROS 2 folder, which may be
            unfinished.
        target: Path of a new file with the same suffix, or of a new folder.

    Raises:
        BagError: If the suffix is another, the target exists already, or no message is whole.
        OSError: If the target cannot be written.
    """
    if target.exists():
        raise BagError(f"{target}: expected a new file, got an existing one; choose another name")
    if not source.exists():
        raise BagError(
            f"{source}: expected a .bag, an .mcap or a ROS 2 folder, got nothing; check the path"
        )
    with readable(source), closing(open_container(source)) as container:
        damage = list(container.damage)
        if damage and not any(container.counts):
            raise BagError(
                f"{source}: expected messages, got none that is whole: {damage[0].reason}"
            )
        if isinstance(container, Ros2Folder):
            with atomic_io.create_folder(target) as folder:
                count = _copy_folder(container, folder, damage)
        else:
            _check_suffix(container, target)
            count = _copy_file(container, target, damage)
        changed = "" if damage else changed_files(source)
        lost_messages = None if changed else container.lost
        return SalvageResult(
            count,
            bool(damage) or bool(changed),
            lost_messages,
            changed or _damage_text(damage) or ("" if container.finished else _UNFINISHED),
            tuple(container.notes),
            container.finished,
        )


def _check_suffix(container: Container, target: Path) -> None:
    """Check that the name of the new file fits its format.

    Raises:
        BagError: If it does not.
    """
    file = container.container if isinstance(container, DecompressedFile) else container
    kinds = {Rosbag1File: ".bag", McapFile: ".mcap", SqliteFile: ".db3"}
    suffix = next(name for kind, name in kinds.items() if isinstance(file, kind))
    if target.suffix != suffix:
        raise BagError(
            f"{target}: expected a name in {suffix}, the format of the recording, got "
            f"{target.suffix!r}"
        )


def _copy_file(container: Container, target: Path, damage: list[Damage]) -> int:
    """Copy one file.

    Args:
        container: The open file.
        target: Path of the new file.
        damage: Damage found so far, extended.

    Returns:
        Number of messages copied.
    """
    if isinstance(container, DecompressedFile):
        return _copy_file(container.container, target, damage)
    if isinstance(container, SqliteFile):
        # sqlite3 opens files by path only, and may write a journal beside them.
        with tempfile.TemporaryDirectory(prefix=f".{target.name}.", dir=target.parent) as folder:
            count = copy_sqlite(container, Path(folder) / target.name)
            (Path(folder) / target.name).replace(target)
        return count
    with atomic_io.open_file(target) as out:
        if isinstance(container, Rosbag1File):
            return copy_bag(container, out)
        if isinstance(container, McapFile):
            count, more = copy_mcap(container, out)
            damage += more
            return count
    raise BagError(f"{target}: expected a file of messages, got {type(container).__name__}")


def _copy_folder(container: Ros2Folder, folder: Path, damage: list[Damage]) -> int:
    """Copy the files of a folder and write its metadata.yaml.

    Args:
        container: The open folder.
        folder: Path of the new folder.
        damage: Damage found so far, extended.

    Returns:
        Number of messages copied.
    """
    names, count, compression = [], 0, ""
    for path, file in zip(container.paths, container.files, strict=True):
        name = path.name
        if path.suffix in _COMPRESSED:
            plain = folder / path.stem
            count += _copy_file(file, plain, damage)
            _compress(plain, folder / name)
            compression = "FILE"
        else:
            count += _copy_file(file, folder / name, damage)
        names.append(name)
    span: tuple[int, int] | None = None
    for message in container.read(range(len(container.connections))):
        span = (span[0] if span else message.stamp_ns, message.stamp_ns)
        if not compression and message.data.startswith(ZSTD_MAGIC):
            compression = "MESSAGE"
    text = metadata_text(
        container.metadata,
        names,
        container.connections,
        container.counts,
        span or (0, 0),
        compression,
    )
    with atomic_io.open_file(folder / METADATA) as out:
        out.write(text.encode())
    return count


def _compress(source: Path, target: Path) -> None:
    """Compress a file by zstd and remove the original."""
    import zstandard

    with source.open("rb") as file, target.open("wb") as out:
        zstandard.ZstdCompressor().copy_stream(file, out)
    source.unlink()


def _damage_text(damage: list[Damage]) -> str:
    """Return a description of the damage, on one line."""
    parts = [
        f"{each.reason} at byte {each.offset:,}" if each.size else each.reason
        for each in damage[:3]
    ]
    if len(damage) > 3:
        parts.append(f"{len(damage) - 3} more")
    return "; ".join(parts)
