"""How often a policy reaches its goals in mazes that it was not trained in.

Run with ``python tests/benchmarks/bench_maze.py POLICY [EPISODES]``; prints one line a plant.
Starts, goals and mazes are the judges': world seeds from one million on.
"""

import sys
from collections import Counter
from pathlib import Path

from andabata.tasks.offroad import make_offroad, stage_config
from andabata.tasks.seeds import evaluation_world
from rl.metrics import wilson_interval
from rl.policy import Policy
from rl.training import play


def main(policy: Path, episodes: int = 300) -> None:
    """Judge a policy file in 60 unseen mazes."""
    config = stage_config("Maze2D")
    seeds = tuple(evaluation_world(2, trial) for trial in range(60))
    loaded = Policy.load(policy)
    for plant in ("kinematic", "bullet"):
        rig = config.rig.model_copy(update={"plant": plant})
        env = make_offroad("Maze2D", config.model_copy(update={"seeds": seeds, "rig": rig}))
        played = [play(env, loaded, 1, (7, k), explore=False) for k in range(episodes)]
        env.close()
        reached = sum(episode.is_success for episode in played)
        low, high = wilson_interval(reached, episodes)
        outcomes = dict(Counter(episode.outcome for episode in played))
        rate = reached / episodes
        sys.stdout.write(f"{policy} {plant}: {rate:.3f} [{low:.3f}, {high:.3f}] {outcomes}\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]), *(int(word) for word in sys.argv[2:3]))
