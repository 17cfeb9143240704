"""Rounds of imitation that go on where they were killed (DAgger; Ross, Gordon and Bagnell 2011).

Each round drives by turns of a teacher and of the last policy, and labels every state by the
teacher; then a policy is fitted to all labels so far. What the policy gets into by its own mistakes
is labelled, too, which drives of the teacher alone never show.
"""

import io
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from andabata.engine_processes import run_tasks
from andabata.runs import atomic_io
from andabata.runs.folder import make_folder
from andabata.runs.strict_json import dumps
from rl.policy import Policy, load_policy

Drive = TypeVar("Drive")
Driven = TypeVar("Driven")

Arrays = dict[str, NDArray[Any]]
"""Arrays of a round by name, such as observations and labels."""

_DESCRIPTION = "rounds.json"
"""Name of the file that says what a folder holds."""


def check_rounds(drives: Sequence[int], shares: Sequence[float], name: str) -> None:
    """Refuse rounds without drives or without a driver.

    Args:
        drives: Number of drives of each round.
        shares: Share of the time that the teacher drives in each.
        name: Name of the setting of the shares.

    Raises:
        ValueError: If the numbers do not fit together.
    """
    if len(shares) != len(drives) or min(drives) < 1:
        raise ValueError(
            f"drives, {name}: expected one number for each round, 1 drive at least, got "
            f"{tuple(drives)} and {tuple(shares)}"
        )
    if shares[0] != 1.0 or not all(0 <= share <= 1 for share in shares):
        raise ValueError(
            f"{name}: expected 1 in the first round, which has no policy, and shares from 0 to 1, "
            f"got {tuple(shares)}"
        )


def drive_round(
    work: Callable[[Drive], Driven],
    drives: Sequence[Drive],
    workers: int,
    on_drive: Callable[[], None],
) -> list[Driven]:
    """Return the results of a round's drives in their order.

    Args:
        work: Function that drives and labels, for any process.
        drives: Drives.
        workers: Number of processes; the result does not depend on it.
        on_drive: Function that is called after each drive.
    """
    driven = []
    for _, one in run_tasks(work, drives, workers):
        driven.append(one)
        on_drive()
    return driven


def run_rounds(
    folder: Path,
    description: Mapping[str, Any],
    count: int,
    drive: Callable[[int, Policy | None], Arrays],
    fit: Callable[[int, list[Arrays], Policy | None], Policy],
    on_kept: Callable[[int], None],
) -> list[Policy]:
    """Return the policy of each round.

    Each finished round is a file of labels and one of the policy, from which rounds that were
    killed go on.

    Args:
        folder: Folder of the rounds.
        description: Settings and seed, which a folder has to agree with.
        count: Number of rounds.
        drive: Function from a round and the last policy to the round's labels.
        fit: Function from a round, the labels of all rounds so far and the last policy to a policy.
        on_kept: Function that is called with each round whose labels are there already.

    Raises:
        ValueError: If the folder holds something else, or its files are damaged.
    """
    _check_folder(description, folder)
    policies: list[Policy] = []
    labels: list[Arrays] = []
    for k in range(count):
        last = policies[-1] if policies else None
        labels_file, policy_file = (folder / f"round-{k}.{end}" for end in ("npz", "safetensors"))
        if labels_file.exists():
            on_kept(k)
        else:
            atomic_io.write(labels_file, _archive(drive(k, last)))
        labels.append(kept_round(labels_file))
        if not policy_file.exists():
            atomic_io.write(policy_file, fit(k, labels, last).to_bytes())
        policies.append(load_policy(policy_file))
    return policies


def kept_round(file: Path) -> Arrays:
    """Return the arrays of a round's file."""
    with np.load(file, allow_pickle=False) as kept:
        return {name: kept[name] for name in kept.files}


def _archive(arrays: Arrays) -> bytes:
    """Return arrays as the bytes of an npz file: maps shrink to a tenth."""
    buffer = io.BytesIO()
    save: Callable[..., None] = np.savez_compressed
    save(buffer, **arrays)
    return buffer.getvalue()


def _check_folder(description: Mapping[str, Any], folder: Path) -> None:
    """Write what a folder holds, or refuse one that holds something else.

    Raises:
        ValueError: If it holds rounds of other settings or of another seed.
    """
    file = make_folder(folder) / _DESCRIPTION
    text = dumps(dict(description), indent=1)
    if file.exists() and file.read_text() != text:
        raise ValueError(
            f"{folder}: expected rounds with these settings and this seed, got others; "
            "give another --out"
        )
    atomic_io.write(file, text.encode())
