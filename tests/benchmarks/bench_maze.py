"""How often a policy reaches its goals in mazes that it was not trained in.

Run with ``python tests/benchmarks/bench_maze.py POLICY [EPISODES [PLANT [FIRST]]]``; prints one
line. Starts, goals and mazes are the judges', world seeds from one million on, unless FIRST says
with which world seed to begin: 3000 for trying things out.
"""

import sys
from collections import Counter
from pathlib import Path

from andabata.tasks.flat import FlatVectorEnv, is_flat
from andabata.tasks.offroad import OffroadEnv, stage_config
from andabata.tasks.seeds import evaluation_world
from rl.metrics import wilson_interval
from rl.policy import Policy
from rl.training import play, play_together


def main(
    policy: Path,
    episodes: int = 300,
    plant: str = "kinematic",
    first: int = evaluation_world(2, 0),
) -> None:
    """Judge a policy file in 60 unseen mazes."""
    config = stage_config("Maze2D")
    seeds = tuple(range(first, first + 60))
    rig = config.rig.model_validate(config.rig.model_dump() | {"plant": plant})
    config = config.model_copy(update={"seeds": seeds, "rig": rig})
    loaded, drives = Policy.load(policy), [(7, k) for k in range(episodes)]
    if is_flat(config):
        robots = FlatVectorEnv(config, 64, autoreset=False)
        played = play_together(robots, loaded, 1, drives, explore=False)
    else:
        env = OffroadEnv(config)
        played = [play(env, loaded, 1, drive, explore=False) for drive in drives]
        env.close()
    reached = sum(episode.is_success for episode in played)
    low, high = wilson_interval(reached, episodes)
    outcomes = dict(Counter(episode.outcome for episode in played))
    rate = reached / episodes
    sys.stdout.write(f"{policy} {plant}: {rate:.3f} [{low:.3f}, {high:.3f}] {outcomes}\n")


if __name__ == "__main__":
    words = dict(enumerate(sys.argv))
    main(
        Path(words[1]),
        int(words.get(2, "300")),
        words.get(3, "kinematic"),
        int(words.get(4, evaluation_world(2, 0))),
    )
