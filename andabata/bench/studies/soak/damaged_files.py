"""Damaged files of every kind: each is read, or refused with a named error, and in time."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from andabata.bench.studies.soak.archives import with_changed_entry
from andabata.bench.studies.soak.mutants import ends_within, mutant
from andabata.bench.studies.soak.outcome import Outcome, Tally
from andabata.bench.studies.soak.readers import READERS, Reader, name_of_file

_LONGEST = 10.0
"""Time after which reading counts as hanging [s]."""


def damaged_clouds_are_refused(count: int, folder: Path) -> Outcome:
    """Check that damaged clouds are read, or refused with a named error."""
    chosen = {name: each for name, each in READERS.items() if each.group == "clouds"}
    return damaged_files_are_refused(chosen, count, folder)


def other_damaged_files_are_refused(count: int, folder: Path) -> Outcome:
    """Check that other damaged files than clouds are read, or refused with a named error."""
    chosen = {name: each for name, each in READERS.items() if each.group != "clouds"}
    return damaged_files_are_refused(chosen, count, folder)


def damaged_files_are_refused(readers: Mapping[str, Reader], count: int, folder: Path) -> Outcome:
    """Check that damaged files are read, or refused with a named error, and in time.

    Args:
        readers: Readers by the names of what they read.
        count: Number of damaged files of each.
        folder: Folder for a file; those that fail are kept beside it.
    """
    rng, tally = np.random.default_rng(8010), Tally()
    for name, reader in readers.items():
        path, seeds, errors = folder / name_of_file(reader), reader.seeds(), reader.errors()
        for number in range(count):
            data = _changed(seeds[number % len(seeds)], reader, rng)
            # The file stands there while it is read: a reader that ends the process leaves it.
            path.write_bytes(data)
            tally.add(_result(name, reader, path, (OSError, *errors), tally))
    read, refused = tally.results["read"], tally.results["refused"]
    return tally.outcome(f"{len(readers)} kinds, {read:,} read, {refused:,} refused by name")


def _result(
    name: str, reader: Reader, path: Path, errors: tuple[type[Exception], ...], tally: Tally
) -> str:
    """Read a damaged file and return what came of it; what is foreign is recorded."""
    failures, result = len(tally.failures), "refused"
    data = path.read_bytes()
    with tally.guarded(name, data, path.parent.parent / "inputs"), ends_within(_LONGEST):
        try:
            reader.read(path)
            result = "read"
        except TimeoutError:
            raise
        except errors:
            pass
    return "failed" if len(tally.failures) > failures else result


def _changed(data: bytes, reader: Reader, rng: np.random.Generator) -> bytes:
    """Return a damaged file; of every second npz archive an entry, with right checksums."""
    if reader.suffix == ".npz" and rng.random() < 0.5:
        return with_changed_entry(
            data, lambda count: int(rng.integers(count)), lambda entry: mutant(entry, rng)
        )
    return mutant(data, rng)
