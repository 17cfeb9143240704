"""SHA-256 of what the robot does, to show that a change of the code changed nothing.

Run it before and after a refactoring, on one machine, and compare::

    python -m tests.benchmarks.fingerprint [--only drive]

It works through the command line alone, so that it survives changes of the code's inner names.
"""

import argparse
import hashlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

import numpy as np

REAL_CLOUDS = (
    ("libpointmatcher/cloud.00000.vtk", "--sensor-height", "0.95"),
    ("libpointmatcher/cloud.00001.vtk", "--sensor-height", "0.95"),
    ("libpointmatcher/cloud.00002.vtk", "--sensor-height", "0.95"),
    (
        *("monoforce_marv/1727353472_601360559.npz", "--sensor-height", "0.48"),
        *("--mounting", "0.065,0,0,0,135"),
    ),
)


def andabata(*words: str) -> str:
    """Run a command in a process of its own and return what it prints."""
    command = [sys.executable, "-m", "andabata", *words]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    return done.stdout


def digest(arrays: Iterable[np.ndarray]) -> str:
    """Return the SHA-256 of some arrays, one after the other."""
    found = hashlib.sha256()
    for array in arrays:
        found.update(np.ascontiguousarray(array).tobytes())
    return found.hexdigest()


def clouds(folder: Path) -> str:
    """Hash the points and classes of 15 clouds of seed 7."""
    out = folder / "clouds"
    andabata(
        *("clouds", "generate", "--out", str(out), "--seed", "7", "--train", "10"),
        *("--validation", "5", "--quiet"),
    )
    files = [np.load(path) for path in sorted(out.rglob("*.npz"))]
    if len(files) != 15:
        raise ValueError(f"clouds: expected 15, got {len(files)}")
    return digest(file[name] for file in files for name in ("points", "classes"))


def drive(folder: Path, plant: str) -> str:
    """Hash path and commands of one recorded drive."""
    from rosbags.highlevel import AnyReader

    out, record = folder / plant, folder / f"{plant}.bag"
    andabata(
        *("drive", "--world", "natural-test", "--seed", "3", "--set", f"plant={plant}"),
        *("--out", str(out), "--record", str(record), "--no-clouds", "--quiet"),
    )
    found = hashlib.sha256()
    found.update(json.dumps(json.loads((out / "drive.json").read_text())["path"]).encode())
    with AnyReader([record]) as reader:
        names = ("/cmd_vel", "/wheel_speed_cmd")
        wanted = [one for one in reader.connections if one.topic in names]
        if len(wanted) != 2:
            raise ValueError(f"topics: expected 2, got {[one.topic for one in wanted]}")
        for connection, stamp, data in reader.messages(wanted):
            found.update(connection.topic.encode() + str(stamp).encode() + bytes(data))
    return found.hexdigest()


def train(folder: Path, stage: int, name: str, episodes: int) -> str:
    """Hash the policy that two generations of a stage come to at seed 0."""
    from safetensors.numpy import load_file

    out = folder / f"train{stage}"
    andabata(
        *("train", "--out", str(out), "--stages", str(stage), "--seed", "0", "--quiet"),
        *("--set", f"stages.{name}.episodes={episodes}", "--set", "validation=0"),
    )
    weights = load_file(out / "policy.safetensors")
    return digest(weights[name] for name in sorted(weights))


def scans() -> dict[str, str]:
    """Hash cell states and ranges of each real cloud, where there are any."""
    root = os.environ.get("ANDABATA_REAL_DATA")
    found = {}
    for name, *options in REAL_CLOUDS if root else ():
        with tempfile.TemporaryDirectory() as folder:
            picture = str(Path(folder) / "scan.png")
            path = str(Path(root or "") / name)
            text = andabata("scan", path, *options, "--json", "--picture", picture)
        data = json.loads(text)
        text = json.dumps([data["ranges"], data["cell_states"]])
        found[f"scan {name}"] = hashlib.sha256(text.encode()).hexdigest()
    return found


def main() -> None:
    """Print each fingerprint as it comes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="Fingerprints whose name holds this.")
    only = parser.parse_args().only
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for label, make in (
            ("clouds", lambda: clouds(folder)),
            ("drive kinematic", lambda: drive(folder, "kinematic")),
            ("drive bullet", lambda: drive(folder, "bullet")),
            ("train Maze2D", lambda: train(folder, 1, "Maze2D", 16)),
            ("train Natural", lambda: train(folder, 3, "Natural", 16)),
        ):
            if only in label:
                print(label, make(), flush=True)  # noqa: T201
        if only in "scan":
            for label, value in scans().items():
                print(label, value, flush=True)  # noqa: T201


if __name__ == "__main__":
    main()
