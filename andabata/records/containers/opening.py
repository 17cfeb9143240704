"""Opening of recordings: the content decides on the format, not the name."""

import tempfile
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import IO

from andabata.records.containers import mcap_records, rosbag1_records, sqlite_file
from andabata.records.containers.compression import ZSTD_MAGIC
from andabata.records.containers.container import BagError, Container, RawMessage
from andabata.records.containers.mcap_file import McapFile
from andabata.records.containers.ros2_folder import Ros2Folder
from andabata.records.containers.rosbag1_file import Rosbag1File
from andabata.records.containers.sqlite_file import SqliteFile
from traversability.unpacked_size import largest_unpacked


def open_container(path: Path) -> Container:
    """Open a recording and scan it from begin to end.

    Args:
        path: Path of a ROS 1 bag, of an MCAP or sqlite3 file, which may be compressed by zstd, or
            of a ROS 2 folder of such files.

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
        return DecompressedFile(path)
    got = "an empty file" if not begin else f"one that begins with {begin[:8]!r}"
    raise BagError(f"{path}: expected a .bag, .mcap or .db3 file or a ROS 2 folder, got {got}")


def is_recording(path: Path) -> bool:
    """Return True if a file looks like a recording by its first bytes, or is a folder.

    Args:
        path: Path of a file or a folder.

    Raises:
        OSError: If it cannot be read.
    """
    if path.is_dir():
        return True
    with path.open("rb") as file:
        begin = file.read(16)
    magics = (rosbag1_records.MAGIC[:8], mcap_records.MAGIC, sqlite_file.MAGIC, ZSTD_MAGIC)
    return begin.startswith(magics)


class DecompressedFile:
    """File compressed by zstd, decompressed to a temporary file while it is open.

    Attributes:
        container: Decompressed file.
    """

    def __init__(self, path: Path) -> None:
        """Decompress and open a file.

        Raises:
            BagError: If it is damaged, or holds no recording.
        """
        import zstandard

        self._folder = tempfile.TemporaryDirectory(prefix="andabata-")
        decompressed = Path(self._folder.name) / path.stem
        reason = ""
        try:
            with path.open("rb") as compressed, decompressed.open("wb") as file:
                try:
                    self._decompress(path, compressed, file)
                except zstandard.ZstdError as error:
                    reason = str(error)
            self.container = open_container(decompressed)
        except BaseException as error:
            self._folder.cleanup()
            if isinstance(error, BagError):
                raise BagError(str(error).replace(str(decompressed), str(path))) from error
            raise
        self.connections, self.counts = self.container.connections, self.container.counts
        self.damage, self.notes = self.container.damage, self.container.notes
        self.lost, self.finished = self.container.lost, self.container.finished
        if reason and not self.damage:
            raise BagError(f"{path}: expected a whole zstd file, got {reason}")

    @staticmethod
    def _decompress(path: Path, compressed: IO[bytes], out: IO[bytes]) -> None:
        """Decompress a file as far as it is whole.

        Raises:
            BagError: If it decompresses to far more than itself.
            ZstdError: If it is damaged.
        """
        import zstandard

        size, limit = 0, largest_unpacked(path.stat().st_size)
        for piece in zstandard.ZstdDecompressor().read_to_iter(compressed):
            size += len(piece)
            if size > limit:
                raise BagError(
                    f"{path}: expected at most {limit:,} bytes decompressed, for its size, got "
                    "more; if you trust it, decompress it with `zstd -d`"
                )
            out.write(piece)

    def read(self, wanted: Collection[int]) -> Iterator[RawMessage]:
        """Yield the messages of some connections in the order of their times of recording."""
        return self.container.read(wanted)

    def close(self) -> None:
        """Close and remove the temporary file."""
        self.container.close()
        self._folder.cleanup()
