"""Compilation of all kernels of a drive: parts side by side, then a short drive for the rest."""

import os
from collections.abc import Callable
from dataclasses import dataclass
from time import monotonic
from typing import Any

from numba.core import event

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.assembly.warm_up import warm_up_localization, warm_up_simulation, warm_up_steering
from andabata.engine_processes import ProcessEngine
from andabata.evaluation.drive import drive_once
from worlds.splits import DEVELOPMENT_SEED

PARTS: dict[str, Callable[[], None]] = {
    "perception, planner and policy": warm_up_steering,
    "localization": warm_up_localization,
    "simulation": warm_up_simulation,
}
"""Parts that share few kernels, by name; those that take longest come first."""

_SECONDS = 5.0
"""Length of the drive: one cloud and a few decisions [s]."""


@dataclass
class _Counter(event.Listener):
    """Number of functions that this process compiled."""

    compiled: int = 0

    def on_start(self, event: "event.Event") -> None:
        """Count a function."""
        self.compiled += 1

    def on_end(self, event: "event.Event") -> None:
        """Do nothing."""


def compile_kernels(
    workers: int | None = None, on_part: Callable[[str], None] = lambda name: None
) -> dict[str, Any]:
    """Compile what a drive needs, in several processes, into the cache of machine code.

    Args:
        workers: Number of processes; None for the number of cores, at most one for each part.
        on_part: Function called with the name of each part that is done.

    Returns:
        Time taken [s], and the number of functions that only the drive at the end compiled; ready
        for JSON.
    """
    begin = monotonic()
    count = min(workers or os.cpu_count() or 1, len(PARTS))
    with ProcessEngine(count) as engine:
        for done in engine.run(_warm_up, PARTS):
            on_part(done.task)
    counter = _Counter()
    event.register("numba:compile", counter)
    try:
        config = SimulatedRobotConfig()
        drive_once("hill", DEVELOPMENT_SEED, "policy+planner", config, time_limit=_SECONDS)
    finally:
        event.unregister("numba:compile", counter)
    on_part("drive")
    return {"seconds": monotonic() - begin, "compiled_late": counter.compiled}


def _warm_up(name: str) -> None:
    """Compile a part, in any process."""
    PARTS[name]()
