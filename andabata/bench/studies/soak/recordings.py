"""Recordings whose recorder is killed, and recordings that are damaged, in all three formats."""

import mmap
import os
import random
import shutil
import signal
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from andabata.bench.studies.soak.mutants import ends_within, flipped, truncated
from andabata.bench.studies.soak.outcome import Outcome, Tally, kept_input
from andabata.bench.studies.soak.synthetic_drive import synthetic_readings
from andabata.records import topics
from andabata.records.bag_writers import open_writer
from andabata.records.bags import Bag, BagError
from andabata.records.manifest import write_manifest
from andabata.records.messages import NS, MessageBuilder
from andabata.records.salvage import salvage
from andabata.records.topics import Ros, RosMessage, Topic

FORMATS = ("bag", "mcap", "db3")

_LONGEST = 10.0
"""Time after which reading counts as hanging [s]."""

_SECONDS, _DRIVEN = 2.0, 60.0
"""Length of a recording that is damaged, and of a drive whose recorder is killed [s]."""

_CHANGES_A_TRUNCATION = 5
"""Flipped bits for each truncation."""


class Sent(NamedTuple):
    """Message of a recording: topic, time of recording [ns] and content."""

    topic: Topic
    stamp_ns: int
    message: RosMessage


def messages(ros: Ros, seconds: float) -> list[Sent]:
    """Return the messages of a computed drive, in the order of their stamps."""
    builder, found = MessageBuilder(ros), []
    for readings in synthetic_readings(round(10 * seconds)):
        rows = [(topics.IMU, row, builder.imu(row)) for row in _rows(readings.imu)]
        rows += [(topics.MAG, row, builder.field(row)) for row in _rows(readings.mag)]
        rows += [(topics.FIX, row, builder.fix(row)) for row in _rows(readings.gnss)]
        rows += [
            (topics.ENCODERS, row, builder.wheels("Wheels_speed", *row.tolist()))
            for row in _rows(readings.encoders)
        ]
        found += [Sent(topic, builder.stamp_ns(row[0]), sent) for topic, row, sent in rows]
    return sorted(found, key=lambda sent: sent.stamp_ns)


def _rows(rows: "np.ndarray[tuple[int, ...], np.dtype[np.float64]] | None") -> list[np.ndarray]:
    """Return the rows of a sensor, none without any."""
    return [] if rows is None else list(rows)


def killed_recorders_lose_a_second(count: int, folder: Path) -> Outcome:
    """Check that the salvage of a killed recorder's file holds all but its last second."""
    drives = {kind: messages(1 if kind == "bag" else 2, _DRIVEN) for kind in FORMATS}
    pick, tally, most = random.Random(8007), Tally(), 0.0
    for kill in range(count):
        kind = FORMATS[kill % len(FORMATS)]
        drive, path = drives[kind], folder / f"{kill}.{kind}"
        written = _written_until_killed(path, drive, pick.uniform(0.1, 0.6))
        tally.add(kind)
        with tally.guarded(f"{kind}, kill {kill}"):
            kept = salvage(path, folder / f"{kill}-kept.{kind}").messages
            last = drive[written - 1].stamp_ns
            lost = (last - drive[kept - 1].stamp_ns) / NS
            most = max(most, lost)
            tally.expect(lost <= 1.0, f"{kind}: {kept} of {written}, the last {lost:.2f} s lost")
        for each in folder.glob(f"{kill}[.-]*"):
            shutil.rmtree(each) if each.is_dir() else each.unlink()
    return tally.outcome(f"at most {most:.2f} s lost in {count} kills")


def _written_until_killed(path: Path, drive: list[Sent], seconds: float) -> int:
    """Kill a recorder some time after two seconds of a drive; return its number of messages."""
    written = mmap.mmap(-1, 8)
    child = os.fork()
    if child == 0:
        writer = open_writer(path)
        for number, sent in enumerate(drive, start=1):
            writer.write(*sent)
            written[:] = number.to_bytes(8, "little")
        time.sleep(60.0)  # It is not finished: the kill comes.
    while int.from_bytes(written[:], "little") < 700:
        time.sleep(0.005)
    time.sleep(seconds)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return int.from_bytes(written[:], "little")


def damaged_recordings_are_noticed(count: int, folder: Path) -> Outcome:
    """Check that damage of recordings ends in named errors or is reported, and never hangs.

    A recording whose messages are others than before says so. Each truncation is followed by five
    flipped bits. Bags and sqlite3 files have a manifest beside them, as ``drive --record`` writes
    it; MCAP files have checksums of their own.

    Args:
        count: Number of damaged files of each format.
        folder: Folder for their files.
    """
    rng, tally = np.random.default_rng(8008), Tally()
    for kind in FORMATS:
        place = folder / kind
        place.mkdir()
        path, file = write_recording(place, kind, _SECONDS)
        data, whole = file.read_bytes(), _read(path)[0]
        for number in range(count):
            is_truncation = number % (_CHANGES_A_TRUNCATION + 1) == 0
            wrong = (truncated if is_truncation else flipped)(data, rng)
            file.write_bytes(wrong)
            tally.add("truncations" if is_truncation else "flipped bits")
            failures = len(tally.failures)
            with tally.guarded(kind):
                _compare(path, whole, tally, kind)
            if len(tally.failures) > failures:
                kept_input(folder.parent / "inputs", wrong)
    return tally.outcome(f"{_parts(tally)} of {len(FORMATS)} formats, 0 unnoticed")


def _parts(tally: Tally) -> str:
    """Return the numbers of truncations and of flipped bits in words."""
    return " and ".join(f"{count:,} {name}" for name, count in sorted(tally.results.items()))


def write_recording(folder: Path, kind: str, seconds: float) -> tuple[Path, Path]:
    """Write a recording of a computed drive, and a manifest where its format has no checksums.

    Args:
        folder: Existing folder.
        kind: One of ``FORMATS``.
        seconds: Length of the drive [s].

    Returns:
        Paths of the recording, and of the file that holds its messages.
    """
    path = folder / f"drive.{kind}"
    writer = open_writer(path)
    for sent in messages(writer.ros, seconds):
        writer.write(*sent)
    writer.close()
    if kind != "mcap":
        write_manifest(path, {})
    return path, next(path.glob("*.db3")) if path.is_dir() else path


def _read(path: Path) -> tuple[list[tuple[str, int, bytes]], bool]:
    """Return the messages of a recording and whether damage is reported."""
    with Bag(path, damaged=True) as bag:
        found = []
        for raw in bag.raw_messages():
            found.append((bag.connections[raw.connection].topic, raw.stamp_ns, bytes(raw.data)))
            bag.decode(raw)
        return found, bool(bag.left_out)


def _compare(path: Path, whole: list[tuple[str, int, bytes]], tally: Tally, kind: str) -> None:
    """Read and salvage a damaged recording, and record what is not as promised."""
    target = path.with_name(f"kept{path.suffix}")
    try:
        with ends_within(_LONGEST):
            found, is_reported = _read(path)
        tally.expect(found == whole or is_reported, f"{kind}: other messages, and no word of it")
        with ends_within(_LONGEST):
            salvage(path, target)
    except (BagError, OSError) as error:
        tally.expect(not isinstance(error, TimeoutError), f"{kind}: {error}")
    finally:
        if target.is_dir():
            shutil.rmtree(target)
        target.unlink(missing_ok=True)
