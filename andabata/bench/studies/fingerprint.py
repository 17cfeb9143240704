"""Prints SHA-256 digests of what the robot does, to show that a change of the code changed nothing.

Run ``python -m andabata.bench.studies.fingerprint`` before and after a refactoring, on one machine,
and compare. It uses the command line alone, so that it survives changes of the code's inner names.
"""

import argparse
import hashlib
import json
import os
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.bench.command import run_command

REAL_CLOUDS: tuple[tuple[str, ...], ...] = (
    ("libpointmatcher/cloud.00000.vtk", "--sensor-height", "0.95"),
    ("libpointmatcher/cloud.00001.vtk", "--sensor-height", "0.95"),
    ("libpointmatcher/cloud.00002.vtk", "--sensor-height", "0.95"),
    (
        *("monoforce_marv/1727353472_601360559.npz", "--sensor-height", "0.48"),
        *("--mounting", "0.065,0,0,0,135"),
    ),
)
"""Paths of real clouds in the folder ``ANDABATA_REAL_DATA``, each with the options of its scan."""

EVALUATIONS: dict[str, tuple[str, ...]] = {
    "rooms td3": ("--task", "td3", "--rooms", "random-7300,clutter-movers-7300", "--pairs", "4"),
    "rooms spn": (
        *("--task", "spn", "--rooms", "random-7300,clutter-movers-7300", "--pairs", "4"),
        *("--lidars", "hokuyo-270,ten-beams"),
    ),
    "BARN": (
        *("--task", "barn", "--trials", "1"),
        *("--set", "count=2", "--set", "first_seed=200000"),
    ),
    "BARN skid": (
        *("--task", "barn", "--trials", "1", "--vehicle", "barn-skid", "--controllers", "arcs,mpc"),
        *("--set", "count=2", "--set", "first_seed=200000"),
    ),
}
"""Options of evaluations in rooms and fields of cylinders, none of which judge."""


def digest(arrays: Iterable[NDArray[Any]]) -> str:
    """Return the SHA-256 of arrays, one after the other."""
    sha = hashlib.sha256()
    for array in arrays:
        sha.update(np.ascontiguousarray(array).tobytes())
    return sha.hexdigest()


def clouds(folder: Path) -> str:
    """Return the digest of the points and classes of 15 clouds of seed 7."""
    out = folder / "clouds"
    run_command(
        *("clouds", "generate", "--out", str(out), "--seed", "7", "--train", "10"),
        *("--validation", "5", "--quiet"),
    )
    files = [np.load(path) for path in sorted(out.rglob("*.npz"))]
    if len(files) != 15:
        raise ValueError(f"clouds: expected 15, got {len(files)}")
    return digest(file[name] for file in files for name in ("points", "classes"))


def drive(folder: Path, plant: str) -> str:
    """Return the digest of the path and the commands of one recorded drive."""
    from rosbags.highlevel import AnyReader

    out, record = folder / plant, folder / f"{plant}.bag"
    run_command(
        *("drive", "--world", "natural-test", "--seed", "3", "--set", f"plant={plant}"),
        *("--out", str(out), "--record", str(record), "--no-clouds", "--quiet"),
    )
    sha = hashlib.sha256()
    sha.update(json.dumps(json.loads((out / "drive.json").read_text())["path"]).encode())
    with AnyReader([record]) as reader:
        names = ("/cmd_vel", "/wheel_speed_cmd")
        wanted = [one for one in reader.connections if one.topic in names]
        if len(wanted) != 2:
            raise ValueError(f"topics: expected 2, got {[one.topic for one in wanted]}")
        for connection, stamp, data in reader.messages(wanted):
            sha.update(connection.topic.encode() + str(stamp).encode() + bytes(data))
    return sha.hexdigest()


def train(folder: Path, stage: int, name: str, episodes: int) -> str:
    """Return the digest of the policy after some episodes of one stage, seed 0.

    Args:
        folder: Folder for the run.
        stage: Number of the stage, from 1.
        name: Name of the stage.
        episodes: Number of episodes.
    """
    from safetensors.numpy import load_file

    out = folder / f"train{stage}"
    run_command(
        *("train", "--out", str(out), "--stages", str(stage), "--seed", "0", "--quiet"),
        *("--set", f"stages.{name}.episodes={episodes}", "--set", "validation=0"),
    )
    weights = load_file(out / "policy.safetensors")
    return digest(weights[key] for key in sorted(weights))


def evaluation(folder: Path, name: str, *words: str) -> str:
    """Return the digest of an evaluation's rows and of its journal, but for the journal's heading.

    Args:
        folder: Folder for the run.
        name: Name of the run.
        words: Options of ``evaluate``.
    """
    out = folder / name.replace(" ", "-")
    common = ("--seed", "7300", "--workers", "1", "--quiet", "--json", "--out", str(out))
    rows = json.loads(run_command("evaluate", *words, *common))["rows"]
    (journal,) = out.glob("*.jsonl")
    found = hashlib.sha256(json.dumps(rows).encode())
    for line in journal.read_text().splitlines()[1:]:  # Commit and settings are no behaviour.
        found.update(line.encode())
    return found.hexdigest()


def scans() -> Iterator[tuple[str, str]]:
    """Yield the digest of cell states and ranges of each real cloud, if there are any."""
    root = os.environ.get("ANDABATA_REAL_DATA")
    for name, *options in REAL_CLOUDS if root else ():
        with tempfile.TemporaryDirectory() as folder:
            picture = str(Path(folder) / "scan.png")
            path = str(Path(root or "") / name)
            text = run_command("scan", path, *options, "--json", "--picture", picture)
        data = json.loads(text)
        text = json.dumps([data["ranges"], data["cell_states"]])
        yield f"scan {name}", hashlib.sha256(text.encode()).hexdigest()


def fingerprints(only: str) -> Iterator[tuple[str, str]]:
    """Yield name and digest of each fingerprint whose name contains ``only``."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        makers: dict[str, Callable[[], str]] = {
            "clouds": lambda: clouds(folder),
            "drive kinematic": lambda: drive(folder, "kinematic"),
            "drive bullet": lambda: drive(folder, "bullet"),
            "drive wheels": lambda: drive(folder, "wheels"),
            "train Maze2D": lambda: train(folder, 1, "Maze2D", 16),
            "train Natural": lambda: train(folder, 3, "Natural", 16),
        }
        for name, words in EVALUATIONS.items():
            makers[name] = partial(evaluation, folder, name, *words)
        for label, make in makers.items():
            if only in label:
                yield label, make()
    if only in "scan":
        yield from scans()


def main(argv: Sequence[str] | None = None) -> None:
    """Print each fingerprint as it comes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="Part of the names of those to print.")
    for label, value in fingerprints(parser.parse_args(argv).only):
        sys.stdout.write(f"{label} {value}\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
