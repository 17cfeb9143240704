"""Scenarios of an evaluation: one world a trial, of one preset or of a suite."""

from dataclasses import dataclass, replace

from andabata.evaluation.judging import JUDGED_WORLDS
from worlds.splits import DEVELOPMENT_SEEDS, evaluation_world, judging_world


@dataclass(frozen=True)
class Scenario:
    """World of one trial.

    Attributes:
        world: World preset.
        seed: Seed of the world.
        difficulty: Difficulty from 0 to 1; None for the preset's own.
    """

    world: str
    seed: int
    difficulty: float | None = None


_HARDEST = 0.8
"""Difficulty of the hardest natural worlds of the suite; at 1 many have no safe path at all."""


def generalisation(seed: int) -> tuple[Scenario, ...]:
    """Return 100 natural worlds from easy to hard, 20 mazes, 20 hollows and 20 test worlds.

    Args:
        seed: Seed of the suite; each has worlds of its own, which nothing trains on. All of them
            are development: they were looked at many times.
    """
    natural = [
        Scenario("natural-far", evaluation_world(seed, k), round(_HARDEST * k / 99, 3))
        for k in range(100)
    ]
    others = [
        Scenario(world, evaluation_world(seed, k))
        for world in ("maze", "hollow", "natural-test")
        for k in range(20)
    ]
    return (*natural, *others)


def development(seed: int) -> tuple[Scenario, ...]:
    """Return the 24 test worlds that changes are compared on; the seed only draws the noise."""
    return tuple(Scenario("natural-test", world_seed) for world_seed in DEVELOPMENT_SEEDS)


def walkers(seed: int) -> tuple[Scenario, ...]:
    """Return the worlds of ``development`` with walkers in them: the two suites make pairs."""
    return tuple(replace(each, world="natural-walkers") for each in development(seed))


SUITES = {"generalisation": generalisation, "development": development, "walkers": walkers}
"""Suites by name."""


def scenarios(
    suite: str | None,
    world: str,
    trials: int,
    seed: int,
    release: str | None = None,
    world_seed: int | None = None,
) -> tuple[Scenario, ...]:
    """Return the scenario of each trial: a suite's, as many worlds of one preset, or one world.

    Args:
        suite: Name of a suite, or None.
        world: World preset, without a suite.
        trials: Number of worlds, without a suite.
        seed: Seed of the worlds.
        release: Release whose worlds of this preset judge, whatever the seed; None to develop.
        world_seed: Seed of the one world of all trials, without a suite; None for a world each.

    Raises:
        ValueError: If there is no such suite, or the release is no version.
    """
    if release is not None:
        first = JUDGED_WORLDS[world].first
        return tuple(Scenario(world, judging_world(release, first + k)) for k in range(trials))
    if suite is None and world_seed is not None:
        return (Scenario(world, world_seed),) * trials
    if suite is None:
        return tuple(Scenario(world, evaluation_world(seed, trial)) for trial in range(trials))
    if suite not in SUITES:
        raise ValueError(f"--suite: expected one of {', '.join(SUITES)}, got {suite!r}")
    return SUITES[suite](seed)
