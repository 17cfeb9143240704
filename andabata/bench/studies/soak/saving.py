"""Kills while files are written: what is read afterwards is whole and of the last interval."""

import itertools
import json
import mmap
import os
import random
import signal
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch

from andabata.bench.studies.soak.outcome import Outcome, Tally
from andabata.models import shipped_forest, shipped_policy
from andabata.runs import atomic_io
from andabata.runs.folder import write_json
from andabata.runs.journal import Journal
from rl.checkpoint import progress_of, to_bytes
from rl.policies.mlp import MlpPolicy
from rl.policy import load_policy
from traversability.cloud import PointCloud
from traversability.files import cloud_to_bytes, read_cloud
from traversability.forest import Forest

_LONGEST = 0.03
"""Longest time from the first file to the kill [s]."""

_ABOUT, _TEXT = {"run": "of the soak"}, "x" * 10_000


Save = Callable[[int], object]
"""Function that saves a file with a number in it."""


class Kept(NamedTuple):
    """Kind of a file that is saved again and again.

    Attributes:
        begin: Function of the folder that returns the function that saves.
        read: Function of the folder that returns the number that was saved last.
    """

    begin: Callable[[Path], Save]
    read: Callable[[Path], int]


def kills_leave_whole_files(count: int, folder: Path) -> Outcome:
    """Check that a process that is killed while it saves leaves files that can be read.

    A number that was on the disk when the process went on is still there: what is lost is at most
    what was being saved.
    """
    kinds, pick, tally = kept_kinds(), random.Random(8005), Tally()
    for kill in range(count):
        name = list(kinds)[kill % len(kinds)]
        place = folder / f"{kill}"
        place.mkdir()
        saved = _saved_until_killed(kinds[name], place, pick.uniform(0.0, _LONGEST))
        tally.add(name)
        with tally.guarded(f"{name}, kill {kill}"):
            found = kinds[name].read(place)
            tally.expect(
                saved <= found <= saved + 1, f"{name}: expected number {saved} or more, got {found}"
            )
    lost = len(tally.failures)
    return tally.outcome(f"{lost} of {count} unreadable or older, {len(kinds)} kinds of files")


def _saved_until_killed(kind: Kept, folder: Path, seconds: float) -> int:
    """Kill a process that saves, a time after its first file; return its last finished number."""
    finished = mmap.mmap(-1, 8)
    child = os.fork()
    if child == 0:
        save = kind.begin(folder)
        for number in itertools.count(1):
            save(number)
            finished[:] = number.to_bytes(8, "little")
    while not any(finished[:]):
        time.sleep(0.001)
    time.sleep(seconds)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return int.from_bytes(finished[:], "little")


def kept_kinds() -> dict[str, Kept]:
    """Return what a robot and its training save, by name."""
    return {
        "policies": Kept(
            _writer("a.safetensors", _policy),
            lambda at: load_policy(at / "a.safetensors").info["n"],
        ),
        "checkpoints": Kept(
            _writer("checkpoint", _checkpoint),
            lambda at: progress_of((at / "checkpoint").read_bytes())["n"],
        ),
        "forests": Kept(
            _writer("a.npz", _forest), lambda at: Forest.load(at / "a.npz").summary["n"]
        ),
        "clouds": Kept(_writer("a.npz", _cloud), lambda at: len(read_cloud(at / "a.npz"))),
        "run folders": Kept(
            lambda at: lambda number: write_json(at / "run.json", {"n": number, "text": _TEXT}),
            lambda at: json.loads((at / "run.json").read_bytes())["n"],
        ),
        "journals": Kept(
            lambda at: _journal_appender(Journal(at / "a.jsonl", _ABOUT)),
            lambda at: Journal(at / "a.jsonl", _ABOUT).entries[-1]["n"],
        ),
    }


def _writer(name: str, data: Callable[[int], bytes]) -> Callable[[Path], Save]:
    """Return what begins to save the bytes of a number under a name."""
    return lambda folder: lambda number: atomic_io.write(folder / name, data(number))


def _journal_appender(journal: Journal) -> Save:
    """Return a function that appends an entry."""
    return lambda number: journal.append({"n": number})


def _policy(number: int) -> bytes:
    """Return the bytes of a policy."""
    policy = shipped_policy()
    assert isinstance(policy, MlpPolicy)
    return replace(policy, info={"n": number}).to_bytes()


def _checkpoint(number: int) -> bytes:
    """Return the bytes of a checkpoint of some weights."""
    return to_bytes({"weight": torch.full((64, 64), float(number))}, {}, {}, {"n": number})


def _forest(number: int) -> bytes:
    """Return the bytes of a forest."""
    return replace(shipped_forest(), summary={"n": number}).to_bytes()


def _cloud(number: int) -> bytes:
    """Return the bytes of a cloud of as many points."""
    return cloud_to_bytes(PointCloud(np.ones((number, 3), dtype=np.float32), "sensor"))
