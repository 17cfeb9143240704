"""Measures how often a policy reaches its goals in mazes that it was not trained in.

``python -m andabata.bench.studies.maze POLICY`` prints one row. By default starts, goals and mazes
are those of a development seed; ``--first-world 1020000`` gives those of the evaluation. Stage
Maze2D has 32 horizontal beams and the true pose, Maze3D has the rotating laser, the filter and the
classifier. A policy steers by the heading that it was trained with: towards the goal, or towards
the sub-goals of a local map.
"""

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import get_args

from andabata.bench.table import Row, markdown_table
from andabata.evaluation.statistics import wilson_interval
from andabata.machine.plants import Plant
from andabata.tasks.maze import MazeVectorEnv, is_planar
from andabata.tasks.offroad import OffroadEnv, stage_config
from rl.policy import load_policy, with_observations
from rl.training import EpisodeSpec, play, play_together
from worlds.splits import DEVELOPMENT_SEED, evaluation_world

_MAZES = 60
"""Number of mazes that the episodes are drawn from."""

_FIRST_WORLD = evaluation_world(DEVELOPMENT_SEED, 0)
"""World seed of the first maze, unless another is given."""


def evaluate_in_mazes(
    policy: Path,
    episodes: int = 300,
    plant: str = "kinematic",
    first_world: int = _FIRST_WORLD,
    stage: str = "Maze2D",
    sectors: int = 32,
) -> Counter[str]:
    """Return the number of episodes by outcome.

    Args:
        policy: File of the policy.
        episodes: Number of episodes, spread over 60 mazes.
        plant: Name of the vehicle's plant: ``kinematic``, ``wheels``, ``bullet`` or ``mujoco``.
        first_world: World seed of the first maze.
        stage: Name of the training stage whose sensors are simulated.
        sectors: Number of sectors of the virtual scan (paper: 32).

    Raises:
        ValueError: If the policy cannot read as many sectors.
    """
    config = stage_config(stage)
    robot = config.simulated_robot.model_dump() | {"plant": plant}
    for part in (robot, robot["sensing"]):  # A horizontal scanner has one beam a sector.
        part["grid"]["n_sectors"] = sectors
    loaded = load_policy(policy)
    trained = loaded.info["config"]["stages"][stage]["environment"]
    config = config.model_copy(
        update={
            "seeds": tuple(range(first_world, first_world + _MAZES)),
            "simulated_robot": config.simulated_robot.model_validate(robot),
            "heading": trained["heading"],
            "scan": trained.get("scan", "ranges"),
        }
    )
    loaded = with_observations(loaded, config.observations)
    drives = [EpisodeSpec(0, (7, k)) for k in range(episodes)]
    if is_planar(config):
        robots = MazeVectorEnv(config, 64, autoreset=False)
        played = play_together(robots, loaded, 1, drives, explore=False)
    else:
        env = OffroadEnv(config)
        played = [play(env, loaded, 1, drive, explore=False) for drive in drives]
        env.close()
    return Counter(str(episode.outcome) for episode in played)


def success_row(outcomes: Counter[str]) -> Row:
    """Return the success rate with its 95 % Wilson interval, and the number of each outcome."""
    episodes = outcomes.total()
    low, high = wilson_interval(outcomes["goal"], episodes)
    return {
        "episodes": episodes,
        "success": f"{outcomes['goal'] / episodes:.3f} [{low:.3f}, {high:.3f}]",
        **dict(sorted(outcomes.items())),
    }


def main(argv: Sequence[str] | None = None) -> None:
    """Evaluate one policy and print its row."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("policy", type=Path, help="File of the policy.")
    parser.add_argument("--episodes", type=int, default=300, help="Number of episodes.")
    parser.add_argument("--plant", default="kinematic", choices=get_args(Plant))
    parser.add_argument("--first-world", type=int, default=_FIRST_WORLD, help="First world seed.")
    parser.add_argument("--stage", default="Maze2D", choices=("Maze2D", "Maze3D"))
    parser.add_argument("--sectors", type=int, default=32, help="Sectors of the virtual scan.")
    options = parser.parse_args(argv)
    outcomes = evaluate_in_mazes(
        options.policy,
        options.episodes,
        options.plant,
        options.first_world,
        options.stage,
        options.sectors,
    )
    names = ("policy", "stage", "plant", "sectors")
    chosen = {name: getattr(options, name) for name in names}
    sys.stdout.write(markdown_table([chosen | success_row(outcomes)]))


if __name__ == "__main__":
    main()
