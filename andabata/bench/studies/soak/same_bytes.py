"""Same seed, same bytes: results of commands in several processes and with several workers."""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

from andabata.bench.studies.soak.outcome import Outcome, Tally
from worlds.splits import DEVELOPMENT_SEED

_WORKERS = (1, 2, 4)

_SHORT_EPISODES = (
    *("--set", "validation=1", "--set", "learner.episodes_per_iteration=2"),
    *("--set", "stages.Maze2D.episodes=6", "--set", "stages.Maze2D.environment.seeds=[0, 1]"),
    *("--set", "stages.Maze2D.environment.terminations.time_limit=3"),
)

COMMANDS = {
    "clouds": f"clouds generate --seed {DEVELOPMENT_SEED} --train 3 --validation 1".split(),
    "evaluation": [
        *f"evaluate --world natural-test --trials 4 --seed {DEVELOPMENT_SEED}".split(),
        *("--controllers", "planner", "--set", "simulated_robot.plant=kinematic"),
        *("--set", "terminations.time_limit=10"),
    ],
    "training": ["train", "--stages", "1", "--seed", "7", *_SHORT_EPISODES],
}
"""Commands by what they make."""

RESULTS = {
    "clouds": ("*.npz", "manifest.json"),
    "evaluation": ("evaluation.json",),
    "training": ("*.safetensors", "history.jsonl"),
}
"""Patterns of the files whose bytes are compared; descriptions of runs name their command."""


def same_seed_gives_the_same_bytes(count: int, folder: Path) -> Outcome:
    """Check that commands leave equal bytes in each process, whatever the number of workers.

    Args:
        count: Number of processes of each command; of two or more, each number of workers has one.
        folder: Folder for their files.
    """
    tally = Tally()
    for name, command in COMMANDS.items():
        found: dict[str, list[str]] = {}
        for number in range(count):
            workers = _WORKERS[number % len(_WORKERS)]
            out = folder / f"{name}-{number}"
            _run([*command, "--workers", str(workers), "--out", str(out)], number)
            found.setdefault(digest(out, RESULTS[name]), []).append(f"{number} ({workers} workers)")
            tally.add(name)
        tally.expect(len(found) == 1, f"{name}: expected equal bytes, got {list(found.values())}")
    return tally.outcome(f"one digest each of {', '.join(COMMANDS)}")


def digest(folder: Path, patterns: tuple[str, ...]) -> str:
    """Return a digest of names and bytes of files in a folder.

    Raises:
        ValueError: If no file has a name of a pattern.
    """
    files = sorted({path for pattern in patterns for path in folder.rglob(pattern)})
    if not files:
        raise ValueError(f"{folder}: expected files {', '.join(patterns)}, got none")
    sums = [f"{path.name} {hashlib.sha256(path.read_bytes()).hexdigest()}" for path in files]
    return hashlib.sha256("\n".join(sums).encode()).hexdigest()


def _run(words: list[str], hash_seed: int) -> None:
    """Run a command with its own order of hashes.

    Raises:
        subprocess.CalledProcessError: If it fails.
    """
    environment = os.environ | {"PYTHONHASHSEED": str(hash_seed)}
    command = [sys.executable, "-m", "andabata", *words, "--quiet"]
    subprocess.run(command, env=environment, check=True)
