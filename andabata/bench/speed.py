"""Compares the speed of andabata and of installed peers: same scene, in turns, in one run."""

from collections.abc import Iterator, Sequence

from andabata.bench.contenders import Case, run_case
from andabata.bench.reporter import Reporter
from andabata.bench.robot_speed_cases import loop_cases, many_robots_case, training_case
from andabata.bench.speed_cases import cloud_cases, filter_case, flat_case, laser_case
from andabata.bench.table import Row
from worlds.scenes import SceneCache
from worlds.splits import evaluation_world


def bench_speed(
    world: str, seed: int, runs: int, seconds: float, only: str, reporter: Reporter
) -> list[Row]:
    """Return the rows of all cases whose name contains a text.

    Args:
        world: World preset; the world is one of the evaluation's.
        seed: Seed of world and noise.
        runs: Number of turns.
        seconds: Shortest duration of a turn of one contender [s].
        only: Part of the names of the cases to run.
        reporter: Receiver of the cases' names and of the peers that are left out.

    Raises:
        ValueError: If no case is named so.
    """
    rows: list[Row] = []
    names = []
    for case in make_cases(world, seed):
        names.append(case.name)
        if only in case.name:
            reporter.status(case.name)
            rows += run_case(case, runs, seconds, reporter.status)
    if not rows:
        raise ValueError(f"only: expected part of one of {', '.join(names)}, got {only!r}")
    return rows


def speed_table(rows: Sequence[Row]) -> list[Row]:
    """Return the rows of ``bench_speed`` as a table for people."""
    return [
        {
            "work": row["name"],
            "subject": row["subject"],
            "speed": f"{row['value']:.4g} {row['unit']}",
            "ratio to ours": f"{row['ratio_to_ours']:.3g}",
            "least to most": f"{row['low']:.4g} to {row['high']:.4g}",
        }
        for row in rows
    ]


def make_cases(world: str, seed: int) -> Iterator[Case]:
    """Yield every case; its scene is made when it is asked for.

    Args:
        world: World preset; the world is one of the evaluation's.
        seed: Seed of world and noise.
    """
    from rl.networks import use_one_thread

    use_one_thread()
    scenes = SceneCache()
    scene = scenes.get(world, evaluation_world(seed, 0))
    yield laser_case(scene, seed)
    maze = scenes.get("maze", evaluation_world(seed, 0))
    yield flat_case(maze, evaluation_world(seed, 0), scenes)
    yield from cloud_cases(scene, seed)
    yield filter_case()
    yield from loop_cases(scene, seed)
    yield training_case(scenes)
    yield many_robots_case(world, seed, scenes)
