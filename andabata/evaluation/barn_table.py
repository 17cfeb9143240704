"""Tables of the BARN benchmark: runs, their scores, and rows with intervals and differences.

Runs of one world are alike, so worlds are what is counted: intervals are those of the same
controllers on other worlds of the kind.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from andabata.evaluation.statistics import clustered_interval, clustered_mean, paired_difference
from andabata.tasks.terminations import Outcome

Row = dict[str, Any]

_SLOWEST = 8.0
"""Multiple of the optimal time from which on a run's score falls no more."""


@dataclass(frozen=True)
class BarnRun:
    """One run.

    Attributes:
        controller: Name of the navigator.
        world: Name of the world.
        trial: Number of the run in its world.
        outcome: How it ended.
        time: Time by the clock [s]; 0 if the robot never left its start.
        optimal_time: Time of the world's path at 2 m/s [s].
        left: Distance from the goal at the end [m].
        speed: Speed at the end [m/s].
    """

    controller: str
    world: str
    trial: int
    outcome: Outcome
    time: float
    optimal_time: float
    left: float
    speed: float

    @property
    def is_success(self) -> bool:
        """True if the goal was reached."""
        return self.outcome is Outcome.GOAL

    @property
    def failure(self) -> str | None:
        """Kind of the failure: ``collision``, ``timeout`` or ``never_left``; None for none."""
        if self.is_success:
            return None
        if self.outcome is Outcome.TIMEOUT and self.time == 0.0:
            return "never_left"
        return str(self.outcome)

    @property
    def score(self) -> float:
        """Official score, at most 0.5."""
        return self._score(2.0)

    @property
    def uncapped(self) -> float:
        """Score without the official cap, at most 1."""
        return self._score(1.0)

    def _score(self, fastest: float) -> float:
        """Return the score of a run that is as good as one of so many optimal times at best."""
        best = self.optimal_time
        return self.is_success * best / min(max(self.time, fastest * best), _SLOWEST * best)

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Self:
        """Return the run of ``to_json``."""
        return cls(**{**data, "outcome": Outcome(data["outcome"])})

    def to_json(self) -> dict[str, Any]:
        """Return the run, ready for JSON."""
        return asdict(self)


def barn_rows(runs: Sequence[BarnRun]) -> list[Row]:
    """Return a row of each controller, in their order.

    Args:
        runs: Runs, as many trials of each controller in each world.
    """
    return [_row(name, mine) for name, mine in _by_controller(runs).items()]


def barn_differences(runs: Sequence[BarnRun]) -> list[Row]:
    """Return how each controller differs from the first one in the same worlds and trials.

    Args:
        runs: Runs, as many trials of each controller in each world.
    """
    (first, base), *others = _by_controller(runs).items()
    return [_difference(first, base, name, mine) for name, mine in others]


def barn_failures(runs: Sequence[BarnRun]) -> list[Row]:
    """Return the runs that failed, ready for JSON."""
    return [
        {
            "controller": run.controller,
            "world": run.world,
            "trial": run.trial,
            "failure": run.failure,
            "time_s": run.time,
            "left_m": run.left,
            "speed_m_s": run.speed,
        }
        for run in runs
        if not run.is_success
    ]


def _by_controller(runs: Sequence[BarnRun]) -> dict[str, list[BarnRun]]:
    """Return the runs of each controller."""
    found: dict[str, list[BarnRun]] = {}
    for run in runs:
        found.setdefault(run.controller, []).append(run)
    return found


def _by_world(runs: Sequence[BarnRun], values: Sequence[float]) -> NDArray[np.float64]:
    """Return values of runs by trial and world, shape (trials, worlds)."""
    worlds = list(dict.fromkeys(run.world for run in runs))
    found = np.zeros((len(runs) // len(worlds), len(worlds)))
    columns = {name: k for k, name in enumerate(worlds)}
    for run, value in zip(runs, values, strict=True):
        found[run.trial, columns[run.world]] = value
    return found


def _scores(runs: Sequence[BarnRun]) -> dict[str, NDArray[np.float64]]:
    """Return the scores of runs by name, shape (trials, worlds) each."""
    return {
        "score": _by_world(runs, [run.score for run in runs]),
        "uncapped": _by_world(runs, [run.uncapped for run in runs]),
    }


def _row(name: str, runs: Sequence[BarnRun]) -> Row:
    """Return the row of one controller."""
    arrived = [run for run in runs if run.is_success]
    successes = _by_world(runs, [float(run.is_success) for run in runs]) > 0
    low, high = clustered_interval(successes)
    failures = [run.failure for run in runs]
    row: Row = {
        "controller": name,
        "worlds": successes.shape[1],
        "runs": len(runs),
        "successes": len(arrived),
        "collisions": failures.count("collision"),
        "timeouts": failures.count("timeout"),
        "never_left": failures.count("never_left"),
        "success_rate": len(arrived) / len(runs),
        "success_low": low,
        "success_high": high,
        "mean_time_s": float(np.mean([run.time for run in arrived])) if arrived else None,
        "mean_speed_ratio": float(np.mean([run.optimal_time / run.time for run in arrived]))
        if arrived
        else None,
    }
    for kind, values in _scores(runs).items():
        found = clustered_mean(values)
        row |= {kind: found.mean, f"{kind}_low": found.low, f"{kind}_high": found.high}
    return row


def _difference(first: str, base: Sequence[BarnRun], name: str, runs: Sequence[BarnRun]) -> Row:
    """Return the row of a controller's difference from the first one."""
    one, other = (
        _by_world(each, [float(run.is_success) for run in each]) > 0 for each in (base, runs)
    )
    gain = paired_difference(one, other)
    row: Row = {
        "controller": name,
        "against": first,
        "worlds": one.shape[1],
        "success": gain.mean,
        "success_low": gain.low,
        "success_high": gain.high,
    }
    before = _scores(base)
    for kind, values in _scores(runs).items():
        found = clustered_mean(values - before[kind])
        row |= {kind: found.mean, f"{kind}_low": found.low, f"{kind}_high": found.high}
    return row
