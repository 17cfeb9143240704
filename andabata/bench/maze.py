"""How often a policy reaches its goals in mazes that it was not trained in.

Run with ``python tests/benchmarks/bench_maze.py POLICY [EPISODES [PLANT [FIRST [STAGE]]]]``; prints
one line. Starts, goals and mazes are the judges', world seeds from one million on, unless FIRST
says with which world seed to begin: 3000 for trying things out. STAGE is Maze2D, with its 32 beams
and the true pose, or Maze3D, with rotating laser, filter and classifier. A policy of the paper's
scheme heads for the goal, another for the sub-goals of a local map, as each was trained.
"""

import sys
from collections import Counter
from pathlib import Path

from andabata.evaluation.statistics import wilson_interval
from andabata.tasks.offroad import OffroadEnv, stage_config
from andabata.tasks.planar import FlatVectorEnv, is_flat
from rl.policy import Policy
from rl.training import EpisodeSpec, play, play_together
from worlds.splits import evaluation_world


def judge(
    policy: Path,
    episodes: int = 300,
    plant: str = "kinematic",
    first: int = evaluation_world(2, 0),
    stage: str = "Maze2D",
) -> Counter[str]:
    """Return how often a policy file's drives in 60 unseen mazes ended how."""
    config = stage_config(stage)
    seeds = tuple(range(first, first + 60))
    simulated_robot = config.simulated_robot.model_validate(
        config.simulated_robot.model_dump() | {"plant": plant}
    )
    loaded = Policy.load(policy)
    trained = loaded.info["config"]["stages"][stage]["environment"]["heading"]
    config = config.model_copy(
        update={"seeds": seeds, "simulated_robot": simulated_robot, "heading": trained}
    )
    drives = [EpisodeSpec(0, (7, k)) for k in range(episodes)]
    if is_flat(config):
        robots = FlatVectorEnv(config, 64, autoreset=False)
        played = play_together(robots, loaded, 1, drives, explore=False)
    else:
        env = OffroadEnv(config)
        played = [play(env, loaded, 1, drive, explore=False) for drive in drives]
        env.close()
    return Counter(str(episode.outcome) for episode in played)


if __name__ == "__main__":
    words = dict(enumerate(sys.argv))
    file, count, stage = Path(words[1]), int(words.get(2, "300")), words.get(5, "Maze2D")
    plant, begin = words.get(3, "kinematic"), int(words.get(4, evaluation_world(2, 0)))
    ended = judge(file, count, plant, begin, stage)
    low, high = wilson_interval(ended["goal"], count)
    rate = ended["goal"] / count
    sys.stdout.write(f"{file} {stage} {plant}: {rate:.3f} [{low:.3f}, {high:.3f}] {ended}\n")
