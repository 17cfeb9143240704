"""Rules of a table that judges a release: fresh seeds, enough trials, null controllers beside.

Judging seeds are drawn once (``andabata.evaluation.ledger``); all other tables develop.
"""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

from andabata.configuration.usage import UsageError
from worlds.splits import judging_world, refuse_judging

JUDGED_WORLD, JUDGED_GOALS = "natural-test", 3
"""World preset and number of goals in a row off-road."""

JUDGED_REALITY = "field"
"""Level of reality off-road."""

JUDGED_FORM: Mapping[str, object] = MappingProxyType(
    {
        "suite": None,
        "world": JUDGED_WORLD,
        "world_seed": None,
        "goals": JUDGED_GOALS,
        "perturb": {},
        "faults": (),
    }
)
"""Settings of a judging table off-road, beside its reality."""

JUDGED_TRIALS = 200
"""Least number of trials of each controller, and of starts and goals in each room."""

JUDGED_BESIDE = ("random+planner", "away+planner", "reactive", "oracle")
"""Controllers beside those that are asked for: noise in the policy's place, the opposite of what it
should do, a plain law that sees, and the upper bound."""

JUDGED_SENSES: Mapping[str, float] = MappingProxyType({"drift": 1.0, "noise": 0.01})
"""Least drift and noise of the robot in rooms, by the names of the task's settings: those of
BARN's robot."""


def judging_seed(release: str) -> int:
    """Return the seed of a judging run: its first world; noise, starts and goals come from it, too.

    Raises:
        ValueError: If the release is no version.
    """
    return judging_world(release, 0)


def checked_seed(seed: int, release: str | None, count: int | None = None) -> int:
    """Return the seed of an evaluation after a check that it is of the right split.

    Args:
        seed: Seed.
        release: Release that is judged, None for none.
        count: Number of the evaluation's seeds that develop; None for no bound.

    Raises:
        ValueError: If it is a judging seed without its release, or another one with it.
    """
    if release is not None and seed != judging_seed(release):
        raise ValueError(
            f"seed: expected that of release {release}, {judging_seed(release)}, got {seed}; "
            "leave it out"
        )
    refuse_judging(seed, release)
    if release is None and count is not None and seed >= count:
        raise ValueError(f"seed: input should be less than {count}, got {seed}")
    return seed


def with_those(asked: Sequence[str], beside: Sequence[str]) -> tuple[str, ...]:
    """Return what is asked for, then what has to stand beside it, each once."""
    return tuple(dict.fromkeys((*asked, *beside)))


def refuse_other_form(release: str, given: Mapping[str, Any]) -> None:
    """Refuse a judging table off-road of another form, which would use up the release's seeds.

    Args:
        release: Release that is judged.
        given: Settings of the run by the names in ``JUDGED_FORM``, ``reality``, ``trials`` and
            ``controllers``.

    Raises:
        ValueError: If one of them differs, there are too few trials, or a controller is missing.
    """
    for name, value in {**JUDGED_FORM, "reality": JUDGED_REALITY}.items():
        if given[name] != value:
            raise ValueError(
                f"{name}: expected {value} in a table that judges release {release}, got "
                f"{given[name]}; leave it out, or develop without --release"
            )
    missing = [name for name in JUDGED_BESIDE if name not in given["controllers"]]
    if missing:
        raise ValueError(
            f"controllers: expected {', '.join(JUDGED_BESIDE)} in a table that judges release "
            f"{release}, got none named {missing[0]}; name what is judged with --controllers"
        )
    judged_trials(release, given["trials"], "trials")


def judged_trials(release: str, count: int | None, name: str) -> int:
    """Return the number of trials of a judging table.

    Args:
        release: Release that is judged.
        count: Number that is asked for, None for the least.
        name: Name of the setting.

    Raises:
        UsageError: If there are fewer than ``JUDGED_TRIALS``.
    """
    if count is not None and count < JUDGED_TRIALS:
        raise UsageError(
            f"{name}: expected {JUDGED_TRIALS} or more in a table that judges release {release}, "
            f"got {count}; leave it out"
        )
    return JUDGED_TRIALS if count is None else count
