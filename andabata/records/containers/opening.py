"""Recordings opened by what is in them, whatever their names."""

import tempfile
from collections.abc import Collection, Iterator
from pathlib import Path

from andabata.records.containers import mcap_records, rosbag1_records, sqlite_file
from andabata.records.containers.compression import ZSTD_MAGIC
from andabata.records.containers.container import BagError, Container, RawMessage
from andabata.records.containers.mcap_file import McapFile
from andabata.records.containers.ros2_folder import Ros2Folder
from andabata.records.containers.rosbag1_file import Rosbag1File
from andabata.records.containers.sqlite_file import SqliteFile


def open_container(path: Path) -> Container:
    """Return a recording, scanned from begin to end.

    Args:
        path: A ROS 1 bag, an MCAP or sqlite3 file, one of the latter two compressed by zstd, or a
            ROS 2 folder of such.

    Raises:
        BagError: If it is none of them.
        OSError: If it cannot be read.
    """
    if path.is_dir():
        if path.suffix == ".db3" and not any(path.iterdir()):
            raise BagError(f"{path}: expected a ROS 2 recording, got an empty folder")
        return Ros2Folder(path, open_container)
    with path.open("rb") as file:
        begin = file.read(16)
    if begin.startswith(rosbag1_records.MAGIC[:8]):
        return Rosbag1File(path)
    if begin.startswith(mcap_records.MAGIC):
        return McapFile(path)
    if begin == sqlite_file.MAGIC:
        return SqliteFile(path)
    if begin.startswith(ZSTD_MAGIC):
        return UnpackedFile(path)
    came = "an empty file" if not begin else f"one that begins with {begin[:8]!r}"
    raise BagError(f"{path}: expected a .bag, .mcap or .db3 file or a ROS 2 folder, got {came}")


def is_recording(path: Path) -> bool:
    """Return whether a path is a recording, by what is in it and not by its name.

    Args:
        path: A file or a folder.

    Raises:
        OSError: If it cannot be read.
    """
    if path.is_dir():
        return True
    with path.open("rb") as file:
        begin = file.read(16)
    magics = (rosbag1_records.MAGIC[:8], mcap_records.MAGIC, sqlite_file.MAGIC, ZSTD_MAGIC)
    return begin.startswith(magics)


class UnpackedFile:
    """A file compressed by zstd, unpacked among the system's temporary files while it is open.

    Attributes:
        container: The unpacked file.
    """

    def __init__(self, path: Path) -> None:
        """Unpack and open a file.

        Raises:
            BagError: If it is damaged, or holds no recording.
        """
        import zstandard

        self._folder = tempfile.TemporaryDirectory(prefix="andabata-")
        unpacked = Path(self._folder.name) / path.stem
        reason = ""
        try:
            with path.open("rb") as packed, unpacked.open("wb") as file:
                try:
                    zstandard.ZstdDecompressor().copy_stream(packed, file)
                except zstandard.ZstdError as error:
                    reason = str(error)
            self.container = open_container(unpacked)
        except BaseException as error:
            self._folder.cleanup()
            if isinstance(error, BagError):
                raise BagError(str(error).replace(str(unpacked), str(path))) from error
            raise
        self.connections, self.counts = self.container.connections, self.container.counts
        self.damage, self.notes = self.container.damage, self.container.notes
        self.lost = self.container.lost
        if reason and not self.damage:
            raise BagError(f"{path}: expected a whole zstd file, got {reason}")

    def read(self, wanted: Collection[int]) -> Iterator[RawMessage]:
        """Yield messages as the unpacked file does."""
        return self.container.read(wanted)

    def close(self) -> None:
        """Close and remove the unpacked file."""
        self.container.close()
        self._folder.cleanup()
