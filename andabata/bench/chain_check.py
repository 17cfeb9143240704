"""Checks that no stage of the control loop has become slower than in the table that is shipped.

``python -m andabata.bench.chain_check`` measures the chain and fails when a stage has grown by more
than half; ``--write`` makes the table anew. Machines differ and have other work to do, so that what
counts is the ratio to a reference loop that is measured in the same run.
"""

import argparse
import json
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.bench.chain import bench_chains
from andabata.bench.table import Row, markdown_table
from andabata.runs import atomic_io
from terrain.kernel import kernel

TABLE = Path(__file__).with_name("chain_table.json")
"""Shipped table: time of each stage over that of the reference loop, by subject and stage."""

Ratios = dict[str, dict[str, float]]
"""Time of stages over that of the reference loop, by subject and stage."""

GROWTH = 1.5
"""Factor beyond which a stage has become slower."""

_LEAST = 25.0
"""Time by which a stage has to grow, besides, on the machine that measures [us] (assumption):
smaller ones double when somebody else empties the caches."""

_PLANTS = ("kinematic", "wheels", "bullet")
_TURNS = 20


def measured(steps: int, runs: int) -> tuple[Ratios, float]:
    """Return the ratios of all stages, and the time of the reference loop [us].

    Args:
        steps: Number of control steps of a run.
        runs: Number of runs.
    """
    configs = [SimulatedRobotConfig(plant=plant) for plant in _PLANTS]
    before = reference_time()
    rows = bench_chains(configs, (1,), "natural", 0, steps, runs)
    reference = (before + reference_time()) / 2
    return ratios_of(rows, reference), reference


def ratios_of(rows: Sequence[Row], reference: float) -> Ratios:
    """Return rows of ``bench_chains`` in microseconds as ratios to a reference [us]."""
    ratios: Ratios = {}
    for row in rows:
        if row["unit"] == "us":
            ratios.setdefault(row["subject"], {})[row["name"]] = row["value"] / reference
    return ratios


def slower(shipped: Ratios, now: Ratios, reference: float) -> list[Row]:
    """Return the stages that have grown too much, or that only one of the tables has.

    Args:
        shipped: Ratios of the table.
        now: Ratios of this run.
        reference: Time of the reference loop in this run [us].
    """
    changed: list[Row] = []
    for subject in dict.fromkeys([*shipped, *now]):
        old, new = shipped.get(subject, {}), now.get(subject, {})
        for stage in dict.fromkeys([*old, *new]):
            before, after = old.get(stage, np.nan), new.get(stage, np.nan)
            grown = (after - before) * reference
            # A comparison with NaN is false: a stage without a counterpart is told, too.
            if not (after <= GROWTH * before or grown <= _LEAST):
                row = {"robot": subject, "stage": stage, "shipped [us]": before * reference}
                changed.append(row | {"now [us]": after * reference})
    return changed


def reference_time() -> float:
    """Return the time of the reference loop, the least of some turns [us]."""
    rng = np.random.default_rng(0)
    values, order = rng.random(1 << 16), rng.integers(1 << 16, size=1 << 16)
    _loop(values, order)
    least = np.inf
    for _ in range(_TURNS):
        began = time.perf_counter()
        _loop(values, order)
        least = min(least, time.perf_counter() - began)
    return 1e6 * float(least)


@kernel
def _loop(values: NDArray[np.float64], order: NDArray[np.int64]) -> float:
    """Return a sum of roots in a random order: arithmetic, branches and places far apart.

    The stages do the same on arrays of that size; a loop in registers alone would not feel a busy
    cache as they do.
    """
    total = 0.0
    for k in range(len(order)):
        value = values[order[k]]
        total += np.sqrt(value) if value > 0.5 else 1.0 / (1.0 + value)
    return total


def main(argv: Sequence[str] | None = None) -> None:
    """Check, or write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="make the shipped table anew")
    parser.add_argument("--steps", type=int, default=200)
    parser.add_argument("--runs", type=int, default=3)
    options = parser.parse_args(argv)
    now, reference = measured(options.steps, options.runs)
    if options.write:
        atomic_io.write(TABLE, to_bytes(now))
        return
    changed = slower(json.loads(TABLE.read_text(encoding="utf-8")), now, reference)
    if changed:
        sys.stdout.write(markdown_table(changed))
        sys.exit(
            "stages are slower than in the shipped table; after a change that is worth it: "
            "python -m andabata.bench.chain_check --write"
        )


def to_bytes(ratios: Mapping[str, Mapping[str, float]]) -> bytes:
    """Return ratios as the content of the table's file."""
    rounded = {
        subject: {stage: float(f"{ratio:.3g}") for stage, ratio in stages.items()}
        for subject, stages in ratios.items()
    }
    return (json.dumps(rounded, indent=2) + "\n").encode()


if __name__ == "__main__":
    main()
