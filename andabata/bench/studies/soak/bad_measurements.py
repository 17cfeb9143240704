"""Bad measurements of each sense: none of them changes the state, and each is counted.

Two localizers drive the same drive; one of them is given a bad row beside each period's good ones.
All that the two believe is compared bit for bit, their dead reckoning too.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.bench.studies.soak.outcome import Outcome, Tally
from andabata.bench.studies.soak.synthetic_drive import fresh_localizer, synthetic_readings
from andabata.localization.ukf_localizer import UkfLocalizer
from andabata.machine.sensor_readings import SensorReadings

Row = NDArray[np.float64]
Damage = Callable[[Row, np.random.Generator], Row]

_WARM_UP = 300
"""Control periods before the first bad row: fixes have shown their noise by then."""

_PLACE = 4
"""Place among a period's inertial rows of the one whose specific force is bad."""

_HUGE = (1e4, 1e300)
"""Limits of a number that no sensor measures."""

ROWS = {"gyro": "imu", "accelerometer": "imu", "wheels": "encoders", "compass": "mag"}
"""Field of the readings of each sense but the satellite receiver, whose name is its own."""

COUNTS = {
    "gyro": "imu",
    "accelerometer": "gravity",
    "wheels": "wheels",
    "compass": "compass",
    "satellites": "gnss",
}
"""Name of each sense in the status of the estimator."""

COLUMNS = {"gyro": (1, 4), "accelerometer": (4, 7), "wheels": (1, 3), "compass": (1, 4)}
"""First column of the sense in a row, and the one after its last; see ``SensorReadings``."""

PLACE, VARIANCE = (1, 3), 4
"""Columns of the place in a fix, and that of its variance."""


def bad_measurements_change_nothing(count: int, folder: Path) -> Outcome:
    """Check that no bad measurement of five senses changes the state, and that all are counted."""
    rng, tally = np.random.default_rng(8004), Tally()
    for sense, kinds in damages().items():
        for kind, damage in kinds.items():
            _try(sense, kind, damage, -(-count // len(kinds)), rng, tally)
    return tally.outcome(f"none of {tally.trials:,} bad rows of {len(damages())} senses")


def damages() -> dict[str, dict[str, Damage]]:
    """Return the kinds of damage of a row by sense and kind."""
    found: dict[str, dict[str, Damage]] = {}
    for sense, (first, end) in COLUMNS.items():
        found[sense] = {
            "not a number": _put(first, end, lambda rng: np.nan),
            "infinite": _put(first, end, lambda rng: rng.choice([-np.inf, np.inf])),
            "huge": _put(first, end, _huge),
        }
    found["gyro"] |= {"old": _shift(-1e3, -0.1), "again": _same, "ahead": _shift(3.0, 1e3)}
    for sense in ("wheels", "compass"):
        found[sense] |= {"old": _shift(-1e3, -1.2), "again": _same, "ahead": _shift(3.0, 1e3)}
    # A field of zero has no direction; zeros of the other senses are good.
    found["compass"]["zero"] = _put_all(1, 4, lambda rng: 0.0)
    found["satellites"] = {
        "not a number": _put(*PLACE, lambda rng: np.nan),
        "infinite": _put(*PLACE, lambda rng: rng.choice([-np.inf, np.inf])),
        "zero": _put_all(*PLACE, lambda rng: 0.0),
        "huge": _put(*PLACE, _huge),
        "negative variance": _put(VARIANCE, VARIANCE + 1, lambda rng: -rng.uniform(1e-6, 1e6)),
        "huge variance": _put(VARIANCE, VARIANCE + 1, lambda rng: rng.uniform(1.1e6, 1e300)),
        "old": _shift(-1e3, -3.0),
        "ahead": _shift(3.0, 1e3),
        "again": _same,
    }
    return found


def _try(
    sense: str, kind: str, damage: Damage, count: int, rng: np.random.Generator, tally: Tally
) -> None:
    """Give one of two localizers a bad row in each of some periods, until they differ."""
    good, bad = fresh_localizer(), fresh_localizer()
    field, last = ROWS.get(sense, "gnss"), np.empty((0, 0))
    for number, readings in enumerate(synthetic_readings(_WARM_UP + count)):
        rows = getattr(readings, field)
        # A receiver's last fix, where the period has none.
        last = rows if rows is not None else last
        if number < _WARM_UP:
            for localizer in (good, bad):
                localizer.update(readings)
            continue
        before = _reasons(bad, sense) - _reasons(good, sense)
        good.update(_without_force(readings) if sense == "accelerometer" else readings)
        changes: dict[str, Any] = {field: _with_bad(sense, rows, last, damage, rng)}
        bad.update(replace(readings, **changes))
        tally.add(sense)
        if _beliefs(good) != _beliefs(bad):
            tally.fail(f"{sense}, {kind}: expected the state as without it, got another")
            return
        counted = _reasons(bad, sense) - _reasons(good, sense) - before
        if counted != 1:
            tally.fail(
                f"{sense}, {kind}: expected one row more to be counted by its reason, got {counted}"
            )
            return


def _with_bad(
    sense: str, rows: Row | None, last: Row, damage: Damage, rng: np.random.Generator
) -> Row:
    """Return the rows of a period with a bad one.

    Args:
        sense: Sense; an accelerometer's numbers stand in the row of the gyro, which stays good.
        rows: Good rows of the period, or None.
        last: Latest good rows.
        damage: Damage.
        rng: Source of chance.
    """
    if sense == "accelerometer":
        return np.array([*last[:_PLACE], damage(last[_PLACE].copy(), rng), *last[_PLACE + 1 :]])
    wrong = damage(last[-1].copy(), rng)
    return wrong[None] if rows is None else np.vstack([rows, wrong])


def _without_force(readings: SensorReadings) -> SensorReadings:
    """Return readings in which the row that is made bad has no specific force."""
    assert readings.imu is not None
    rows = readings.imu.copy()
    rows[_PLACE, slice(*COLUMNS["accelerometer"])] = np.nan
    return replace(readings, imu=rows)


def _reasons(localizer: UkfLocalizer, sense: str) -> int:
    """Return the number of a sense's rows that were not used so far, over all reasons."""
    return sum(localizer.status.unused.get(COUNTS[sense], {}).values())


def _beliefs(localizer: UkfLocalizer) -> tuple[bytes, ...]:
    """Return state, covariance and dead reckoning, bit for bit."""
    belief, odometry = localizer.belief, localizer.odometry
    parts = (belief.x, belief.P, odometry.position, odometry.quaternion)
    return tuple(part.tobytes() for part in parts)


def _put(first: int, end: int, value: Callable[[np.random.Generator], float]) -> Damage:
    """Return a damage that replaces one of some columns."""

    def damage(row: Row, rng: np.random.Generator) -> Row:
        row[rng.integers(first, end)] = value(rng)
        return row

    return damage


def _put_all(first: int, end: int, value: Callable[[np.random.Generator], float]) -> Damage:
    """Return a damage that replaces all of some columns."""

    def damage(row: Row, rng: np.random.Generator) -> Row:
        row[first:end] = value(rng)
        return row

    return damage


def _shift(earliest: float, latest: float) -> Damage:
    """Return a damage that moves the stamp by a time between two [s]."""

    def damage(row: Row, rng: np.random.Generator) -> Row:
        row[0] += rng.uniform(earliest, latest)
        return row

    return damage


def _same(row: Row, rng: np.random.Generator) -> Row:
    """Return a row as it was: it is sent again."""
    return row


def _huge(rng: np.random.Generator) -> float:
    """Return a number that no sensor measures."""
    low, high = np.log10(_HUGE)
    return float(rng.choice([-1, 1]) * 10 ** rng.uniform(low, high))
