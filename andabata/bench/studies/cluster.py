"""Kills raylets, workers and drivers of a small cluster and compares the bytes that come out.

``python -m andabata.bench.studies.cluster`` (extra ``ray``) runs ``clouds generate`` on two raylets
of this machine again and again, kills one of the three in the middle, and fails unless every run
ends with the files of a run in one process, each written once. Twenty runs of each take half an
hour on two cores, too long for the test suite.
"""

import argparse
import hashlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rich.console import Console
from rich.progress import track

from andabata.bench.studies.raylets import Raylets, raylets
from andabata.bench.table import markdown_table
from andabata.datasets.generate import JOURNAL
from traversability.dataset import MANIFEST

KILLED = ("raylet", "worker", "driver")
"""What is killed: a raylet with its workers, one of its workers, or the command itself."""

_UNLIKE = "run.json"
"""File that holds the command line, which differs."""

_CLOUDS = 12
_COMMAND = (
    *(sys.executable, "-m", "andabata"),
    *("clouds", "generate", "--train", "9", "--validation", "3", "--seed", "7", "--quiet"),
    *("--set", "patch_size=40", "--set", "patch_cell=0.25", "--set", "clouds_per_world=1"),
)
"""A set of twelve clouds, each in a world of its own, and the command that makes it."""


@dataclass
class Watched:
    """What was seen of a data set while it came into being.

    Attributes:
        folder: Folder of the data set.
        inodes: Number of the file that each noted cloud was first seen in; a cloud that is written
            again has another one.
        worlds: Worlds of the journal, in its order, as last seen.
    """

    folder: Path
    inodes: dict[str, int] = field(default_factory=dict)
    worlds: list[int] = field(default_factory=list)

    def look(self) -> None:
        """Read the journal, if there is one, and note its clouds."""
        try:
            lines = (self.folder / JOURNAL).read_text(encoding="utf-8").split("\n")[1:-1]
        except FileNotFoundError:
            return
        self.worlds = [json.loads(line)["world"] for line in lines]
        for world in self.worlds:  # A cloud a world: they have the same numbers.
            name = f"cloud_{world:05d}.npz"
            self.inodes.setdefault(name, (self.folder / name).stat().st_ino)

    @property
    def done_twice(self) -> int:
        """Number of worlds that stand in the journal twice."""
        return len(self.worlds) - len(set(self.worlds))

    @property
    def written_twice(self) -> int:
        """Number of noted clouds whose file was written again."""
        there = {name: (self.folder / name).stat().st_ino for name in self.inodes}
        return sum(there[name] != inode for name, inode in self.inodes.items())


def digests(folder: Path, *but: str) -> dict[str, str]:
    """Return the SHA-256 of a folder's files, by their paths in it.

    Args:
        folder: Folder with its folders.
        but: Names of files that are left out.
    """
    paths = (path for path in folder.rglob("*") if path.is_file() and path.name not in but)
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in paths
    }


def one_run(cluster: Raylets, killed: str, after: int, folder: Path) -> Watched:
    """Make the set on a cluster, with something killed once some worlds are done.

    Args:
        cluster: Cluster of two raylets.
        killed: One of ``KILLED``.
        after: Number of worlds after which it is killed.
        folder: Folder of the set.

    Raises:
        CalledProcessError: If the command fails.
    """
    command = [*_COMMAND, "--out", str(folder), "--engine", "ray", "--workers", "2"]
    command += ["--address", cluster.address]
    watched, is_killed = Watched(folder), False
    while not (folder / MANIFEST).exists():
        with subprocess.Popen(command, stdout=subprocess.DEVNULL) as driver:
            for _ in _while_it_runs(driver, watched):
                if is_killed or len(watched.worlds) < after:
                    continue
                is_killed = True
                if killed == "driver":
                    driver.kill()
                elif killed == "worker":
                    os.kill(cluster.worker(), signal.SIGKILL)
                else:
                    cluster.kill_one()
        if driver.returncode not in (0, -signal.SIGKILL):
            raise subprocess.CalledProcessError(driver.returncode, command)
    if killed == "raylet":
        cluster.start_one()
    return watched


def _while_it_runs(driver: "subprocess.Popen[bytes]", watched: Watched) -> Iterator[None]:
    """Look at the set a hundred times a second until the command ends."""
    while driver.poll() is None:
        watched.look()
        yield
        time.sleep(0.01)


def soak(kinds: Sequence[str], runs: int, folder: Path) -> list[dict[str, int | str]]:
    """Return a row of counts for each kind of what is killed.

    Args:
        kinds: Some of ``KILLED``.
        runs: Number of runs of each.
        folder: Empty folder for the data sets.
    """
    alone = folder / "alone"
    subprocess.run(
        [*_COMMAND, "--out", str(alone), "--engine", "serial"],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    expected, rows = digests(alone, _UNLIKE), []
    with raylets(2) as cluster:
        for kind in kinds:
            row: dict[str, int | str] = {"killed": kind, "runs": runs}
            counts = dict.fromkeys(("same bytes", "done twice", "written twice"), 0)
            for run in track(range(runs), kind, console=Console(stderr=True)):
                one = folder / f"{kind}-{run}"
                watched = one_run(cluster, kind, 1 + run % (_CLOUDS - 4), one)
                counts["same bytes"] += digests(one, _UNLIKE) == expected
                counts["done twice"] += watched.done_twice
                counts["written twice"] += watched.written_twice
            rows.append({**row, **counts})
    return rows


def main(argv: Sequence[str] | None = None) -> int:
    """Kill, print a Markdown table, and return 1 if a run differs, else 0."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=20, help="Number of runs of each kind.")
    parser.add_argument("--killed", choices=KILLED, action="append", help="What is killed; all.")
    options = parser.parse_args(argv)
    with tempfile.TemporaryDirectory() as folder:
        rows = soak(options.killed or KILLED, options.runs, Path(folder))
    sys.stdout.write(markdown_table(rows))
    good = {"same bytes": options.runs, "done twice": 0, "written twice": 0}
    return int(any(row[name] != count for row in rows for name, count in good.items()))


if __name__ == "__main__":
    sys.exit(main())
