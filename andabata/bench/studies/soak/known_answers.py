"""Promises that tests of the checkout state with known answers: the row runs them.

What is no law of many trials needs no more: the requests that the live view refuses, and the ways
in which a planner or a table could argue a collision away.
"""

import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from andabata.bench.studies.soak.outcome import Outcome, Tally, not_run

_ROOT = Path(__file__).parents[4]
"""Checkout, which has the tests; an installed package has none."""

LIVE_VIEW = ("tests/andabata/viewer/test_guard.py", "tests/andabata/viewer/test_server.py")
"""Tests of requests with a foreign Origin or Host, and of those that are too large."""

COLLISIONS = (
    "tests/andabata/evaluation/test_strict_verdict.py",
    "tests/andabata/evaluation/test_trial_monitor.py",
    "tests/andabata/navigation/planning/test_cost_to_go_laws.py",
    "tests/andabata/navigation/planning/test_trajectory_rollouts.py",
    "tests/andabata/navigation/planning/test_trajectory_rollouts_laws.py",
    "tests/andabata/navigation/planning/test_speed_limit.py",
)
"""Tests of the goal's radius, the price of a turn, the share of the speed, and mirrored maps."""

_COUNT = re.compile(r"(\d+) (passed|failed|errors?)")


def live_view_refuses_strangers(count: int, folder: Path) -> Outcome:
    """Check that the live view refuses foreign origins and hosts, and what is too large."""
    return _tested(LIVE_VIEW)


def collisions_stay_collisions(count: int, folder: Path) -> Outcome:
    """Check the known answers of goals, costs and mirrored maps."""
    return _tested(COLLISIONS)


def _tested(files: Sequence[str]) -> Outcome:
    """Return the outcome of some test files of the checkout."""
    if not all((_ROOT / name).is_file() for name in files):
        return not_run("it needs the tests of a checkout")
    words = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *files]
    done = subprocess.run(words, cwd=_ROOT, capture_output=True, text=True, check=False)
    tally, lines = Tally(), done.stdout.splitlines() or [""]
    for number, result in _COUNT.findall(lines[-1]):
        tally.trials += int(number)
        tally.results[f"tests {result}"] += int(number)
    failed = [line for line in lines if line.startswith(("FAILED", "ERROR"))]
    for line in failed or (lines[-1:] if done.returncode else []):
        tally.fail(line)
    return tally.outcome()
