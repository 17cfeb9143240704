"""Rules of a table that judges a release: fresh seeds, enough trials, null controllers beside.

Judging seeds are drawn once (``andabata.evaluation.ledger``); all other tables develop.
"""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

from andabata.configuration.usage import UsageError
from andabata.tasks.terminations import TerminationConfig
from worlds.splits import JUDGING_TRIALS, judging_world, refuse_judging


class JudgedWorld(NamedTuple):
    """Worlds off-road that judge a release.

    Attributes:
        first: Index of the first of them among the release's judging worlds.
        goals: Number of goals in a row.
        share: Least number of trials, as a share of ``JUDGED_TRIALS``.
    """

    first: int
    goals: int
    share: float


JUDGED_WORLD = "natural-test"
"""World preset of a judging table off-road where none is named."""

JUDGED_WORLDS: Mapping[str, JudgedWorld] = MappingProxyType(
    {
        JUDGED_WORLD: JudgedWorld(0, 3, 1.0),
        "natural-rough": JudgedWorld(1000, 3, 0.5),
        "natural-walkers": JudgedWorld(1500, 3, 0.5),
        "natural-far": JudgedWorld(2000, 1, 0.5),
        "maze": JudgedWorld(2500, 1, 0.5),
        "hollow": JudgedWorld(3000, 1, 0.5),
    }
)
"""World presets that judge a release, each with seeds of its own and in a table of its own."""

JUDGED_REALITY = "field"
"""Level of reality off-road at which the controllers of ``JUDGED_BESIDE`` stand beside; at another
one a table has the same worlds, and those controllers alone that are asked for."""

JUDGED_PLANTS = ("bullet", "mujoco")
"""Plants that judge off-road: in the first the controllers of ``JUDGED_BESIDE`` stand beside; in
the other a table has the same worlds, and those controllers alone that are asked for."""

JUDGED_FORM: Mapping[str, object] = MappingProxyType(
    {
        "suite": None,
        "world_seed": None,
        "perturb": {},
        "faults": (),
        "terminations": TerminationConfig(),
    }
)
"""Settings of a judging table off-road, beside its world and its goals."""

JUDGED_TRIALS = 200
"""Least number of trials of each controller in ``JUDGED_WORLD``, and of starts and goals in each
room."""

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


def judged_table(world: str, reality: str, plant: str) -> str:
    """Return the name of a judging table off-road in the ledger.

    Args:
        world: World preset.
        reality: Level of reality.
        plant: Name of the plant.
    """
    usual = ((world, JUDGED_WORLD), (reality, JUDGED_REALITY), (plant, JUDGED_PLANTS[0]))
    return ", ".join(["evaluate off-road", *(name for name, other in usual if name != other)])


def beside(reality: str, plant: str) -> tuple[str, ...]:
    """Return the controllers that have to stand in a judging table.

    Args:
        reality: Level of reality.
        plant: Name of the plant.
    """
    return JUDGED_BESIDE if (reality, plant) == (JUDGED_REALITY, JUDGED_PLANTS[0]) else ()


def refuse_other_form(release: str, given: Mapping[str, Any]) -> None:
    """Refuse a judging table off-road of another form, which would use up the release's seeds.

    Args:
        release: Release that is judged.
        given: Settings of the run by the names in ``JUDGED_FORM``, ``world``, ``goals``,
            ``reality``, ``plant``, ``trials`` and ``controllers``.

    Raises:
        ValueError: If one of them differs, world or plant judge no release, there are too few or
            too many trials, or a controller is missing.
    """
    world = given["world"]
    if world not in JUDGED_WORLDS:
        raise ValueError(
            f"world: expected {', '.join(JUDGED_WORLDS)} in a table that judges release {release}, "
            f"got {world}; name one of them, or develop without --release"
        )
    if given["plant"] not in JUDGED_PLANTS:
        raise ValueError(
            f"simulated_robot.plant: expected {' or '.join(JUDGED_PLANTS)} in a table that judges "
            f"release {release}, got {given['plant']}; name one of them, or develop without "
            "--release"
        )
    for name, value in {**JUDGED_FORM, "goals": JUDGED_WORLDS[world].goals}.items():
        if given[name] != value:
            raise ValueError(
                f"{name}: expected {value} in a table that judges release {release}, got "
                f"{given[name]}; leave it out, or develop without --release"
            )
    missing = [
        name
        for name in beside(given["reality"], given["plant"])
        if name not in given["controllers"]
    ]
    if missing:
        raise ValueError(
            f"controllers: expected {', '.join(JUDGED_BESIDE)} in a table that judges release "
            f"{release}, got none named {missing[0]}; name what is judged with --controllers"
        )
    judged_trials(release, given["trials"], "trials", world)


def judged_trials(release: str, count: int | None, name: str, world: str | None = None) -> int:
    """Return the number of trials of a judging table.

    Args:
        release: Release that is judged.
        count: Number that is asked for, None for the least.
        name: Name of the setting.
        world: World preset off-road, one of ``JUDGED_WORLDS``; None in rooms, whose starts and
            goals have no end.

    Raises:
        UsageError: If there are fewer than the least, or more than the release has worlds.
    """
    least, most, bounds = JUDGED_TRIALS, float("inf"), f"{JUDGED_TRIALS} or more"
    if world is not None:
        first, least = JUDGED_WORLDS[world].first, round(JUDGED_WORLDS[world].share * least)
        later = [each.first for each in JUDGED_WORLDS.values() if each.first > first]
        most = min([*later, JUDGING_TRIALS]) - first
        bounds = f"{least} to {most}"
    if count is not None and not least <= count <= most:
        raise UsageError(
            f"{name}: expected {bounds} in a table that judges release {release}, "
            f"got {count}; leave it out"
        )
    return least if count is None else count
