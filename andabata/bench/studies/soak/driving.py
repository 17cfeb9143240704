"""Long drives, and drives that are started and stopped: memory, errors, ends of processes."""

import itertools
import os
import random
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np

from andabata.assembly.controllers import make_steering
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.bench.studies.soak.outcome import Outcome, Tally
from andabata.evaluation.trial import run_trial
from andabata.interrupts import INTERRUPTED
from andabata.machine.plants import default_plant
from andabata.models import Models
from andabata.tasks.episode_monitor import TerminationConfig
from worlds.scenes import SceneCache
from worlds.splits import DEVELOPMENT_SEEDS

_LARGEST_GROWTH = 50.0
"""Largest growth of the memory after the warm-up [MB]."""

_WORLDS, _WARM_UP = DEVELOPMENT_SEEDS[:2], 4
"""Seeds of the worlds, and number of drives after which memory begins to count: what is seen or
compiled for the first time is no growth."""

_PLANTS = (default_plant(), "kinematic")
"""Plants that take turns in loops."""

_LOOP_PERIODS = 15
"""Control periods of a loop."""

_PATIENCE = 5.0
"""Longest time from an interrupt to the end of a process [s]."""

_EARLIEST, _LATEST = 2.0, 9.0
"""Limits of the time from the start of a process to its interrupt [s]."""

_MEGABYTE = 2.0**20


def long_drives_keep_their_memory(count: int, folder: Path) -> Outcome:
    """Check that driving on and on raises no error and takes no more and more memory.

    Development worlds one after the other, in the plant ``kinematic``, with the planner.

    Args:
        count: Simulated seconds.
        folder: Folder for its files; none are made.
    """
    driven, memory, tally, numbers = 0.0, 0.0, Tally(), itertools.count(1)
    drive = _driver()
    for number in numbers:
        with tally.guarded(f"drive {number}"):
            driven += drive(number)
        if number == _WARM_UP:
            memory = _memory()
        if tally.failures or (driven >= count and number >= 2 * _WARM_UP):
            break
    growth = _memory() - memory
    tally.trials = round(driven)
    if not tally.failures:
        tally.expect(growth < _LARGEST_GROWTH, f"memory: expected less, got {growth:.0f} MB more")
    return tally.outcome(
        f"{driven / 3600:.2f} h in {number} drives, {max(growth, 0.0):.0f} MB more"
    )


def _driver() -> Callable[[int], float]:
    """Return a function that drives for the n-th time, and returns the simulated time [s]."""
    models, scenes, rules = Models(), SceneCache(len(_WORLDS)), TerminationConfig()
    config = SimulatedRobotConfig(plant="kinematic")

    def drive(number: int) -> float:
        seed = _WORLDS[number % len(_WORLDS)]
        scene = scenes.get("natural-test", seed)
        task = scene.world.tasks[number // len(_WORLDS) % len(scene.world.tasks)]
        steering = make_steering("planner", scene.world, config, models)
        robot = SimulatedRobot(scene, config, models, steering)
        try:
            attempts = run_trial(robot, task, rules, np.random.default_rng([seed, number]))
        finally:
            robot.close()
        return sum(attempt.time for attempt in attempts)

    return drive


def loops_of_drives_end(count: int, folder: Path) -> Outcome:
    """Check that robots that are made, driven for a moment and closed leave nothing behind.

    The plants take turns: one of them has an engine of its own in each robot.

    Args:
        count: Number of loops.
        folder: Folder for its files; none are made.
    """
    tally, models, scenes = Tally(), Models(), SceneCache(1)
    longest, opened, memory = 0.0, 0, 0.0
    scene = scenes.get("natural-test", _WORLDS[0])
    for number in range(count):
        config = SimulatedRobotConfig(plant=_PLANTS[number % len(_PLANTS)])
        begin = time.monotonic()
        with tally.guarded(f"loop {number}"):
            steering = make_steering("planner", scene.world, config, models)
            robot = SimulatedRobot(scene, config, models, steering)
            try:
                rng, task = np.random.default_rng(number), scene.world.tasks[0]
                readings = robot.place(task.start, np.array(task.goals[0]), rng)
                for _ in range(_LOOP_PERIODS):
                    readings = robot.step(readings)
            finally:
                robot.close()
        tally.trials += 1
        longest = max(longest, time.monotonic() - begin if number >= _WARM_UP else 0.0)
        if number == min(_WARM_UP, count) - 1:
            opened, memory = _open_files(), _memory()
    left, growth = _open_files() - opened, max(_memory() - memory, 0.0)
    tally.expect(left <= 0, f"expected no file to stay open, got {left} more")
    tally.expect(growth < _LARGEST_GROWTH, f"memory: expected less, got {growth:.0f} MB more")
    return tally.outcome(
        f"{tally.trials:,} loops, the longest of {longest:.1f} s, {left} left open, "
        f"{growth:.0f} MB more"
    )


def _open_files() -> int:
    """Return the number of open files and sockets of this process."""
    return len(list(Path("/proc/self/fd").iterdir()))


def _memory() -> float:
    """Return the memory of this process that is in use [MB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / _MEGABYTE


def interrupted_drives_end(count: int, folder: Path) -> Outcome:
    """Check that Ctrl-C and SIGTERM end commands at any moment, in time, with all they started.

    Args:
        count: Number of commands; every second one has workers.
        folder: Folder for their files.
    """
    pick, tally, longest = random.Random(8012), Tally(), 0.0
    commands = (
        ["drive"],
        ["evaluate", "--world", "natural-test", "--trials", "50", "--workers", "2"],
    )
    for number in range(count):
        words, out = commands[number % 2], folder / f"{number}"
        kind = (signal.SIGINT, signal.SIGTERM)[number // 2 % 2]
        process = _started([*words, "--quiet", "--out", str(out)])
        time.sleep(pick.uniform(_EARLIEST, _LATEST))
        if process.poll() is not None:
            tally.fail(f"{words[0]}: expected it to go on, it ended with {process.returncode}")
            continue
        seconds = _ended(process, kind)
        longest = max(longest, seconds)
        tally.add(f"{kind.name}")
        text = f"{words[0]} after {kind.name}"
        tally.expect(seconds <= _PATIENCE, f"{text}: expected an end, got none in {seconds:.1f} s")
        tally.expect(
            process.returncode == INTERRUPTED,
            f"{text}: expected code 130, got {process.returncode}",
        )
        left = orphans(process.pid)
        tally.expect(not left, f"{text}: expected no process to stay, got {left}")
    return tally.outcome(f"{_all(tally)}, at most {longest:.1f} s, no orphan")


def _all(tally: Tally) -> str:
    """Return the numbers of interrupts in words."""
    return " and ".join(f"{count} {name}" for name, count in sorted(tally.results.items()))


def _started(words: list[str]) -> "subprocess.Popen[bytes]":
    """Start a command in a session of its own, which Ctrl-C reaches."""
    return subprocess.Popen(
        [sys.executable, "-m", "andabata", *words],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler) and None,
    )


def _ended(process: "subprocess.Popen[bytes]", kind: signal.Signals) -> float:
    """Interrupt a process; return the time that it took to end, at the latest twice as long [s]."""
    begin = time.monotonic()
    process.send_signal(kind)
    with suppress(subprocess.TimeoutExpired):
        process.wait(2 * _PATIENCE)
    seconds = time.monotonic() - begin
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    return seconds


def orphans(session: int) -> list[int]:
    """Return the processes of a session that have not ended."""
    found = []
    for entry in Path("/proc").iterdir():
        with suppress(OSError):
            if entry.name.isdigit():
                # pid (name) state parent group session ...; a name may hold spaces.
                state, _, _, number = re.sub(r".*\) ", "", (entry / "stat").read_text()).split()[:4]
                if int(number) == session and state != "Z":
                    found.append(int(entry.name))
    return found
