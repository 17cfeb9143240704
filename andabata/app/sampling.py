"""Playing a curriculum's episodes in several processes."""

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from functools import partial
from types import TracebackType
from typing import Self

from andabata.app.workers import open_pool
from andabata.tasks.flat import FlatVectorEnv, is_flat
from andabata.tasks.offroad import OffroadConfig, OffroadEnv
from andabata.tasks.scenes import SceneShelf
from rl.policy import Policy
from rl.training import Episode, Seed, play, play_together
from traversability.forest import Forest

_environments: dict[tuple[int, bytes | None], OffroadEnv] = {}
_shelf = SceneShelf()

_LANES = 16
"""Robots of the first stage that are played side by side."""


class PoolSampler:
    """Plays each episode in whichever process is free; an episode depends on its seed alone.

    With one worker everything happens in this process; so does the first stage, whose robots are
    driven in one compiled pass.
    """

    def __init__(self, stages: Sequence[OffroadConfig], forest: bytes | None, workers: int) -> None:
        """Prepare.

        Args:
            stages: Environment of each stage.
            forest: The cell classifier's file; None for the shipped one.
            workers: Processes.
        """
        self._stages = tuple(stages)
        self._forest = forest
        self._workers = workers
        self._stack = ExitStack()
        self._pool: ProcessPoolExecutor | None = None
        self._flat: FlatVectorEnv | None = None

    def __call__(
        self,
        stage: int,
        policy: Policy,
        hold: int,
        seeds: Sequence[Seed],
    ) -> list[Episode]:
        """Play an episode for each seed; see ``rl.training.Sampler``."""
        config = self._stages[stage]
        if is_flat(config):
            return play_together(self._robots(config), policy, hold, seeds)
        work = partial(_play, config, self._forest, policy.to_bytes(), hold)
        if self._pool is None:
            return [work(seed) for seed in seeds]
        return list(self._pool.map(work, seeds))

    def _robots(self, config: OffroadConfig) -> FlatVectorEnv:
        """Return the robots of the first stage, which are played in this process."""
        if self._flat is None or self._flat.config is not config:
            self._flat = FlatVectorEnv(config, _LANES, _shelf, autoreset=False)
        return self._flat

    def __enter__(self) -> Self:
        """Start the processes."""
        if self._workers > 1:
            self._pool = self._stack.enter_context(open_pool(self._workers))
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> bool | None:
        """Stop the processes, at once after an error or Ctrl-C."""
        return self._stack.__exit__(kind, error, trace)


def _play(
    config: OffroadConfig,
    forest: bytes | None,
    policy: bytes,
    hold: int,
    seed: Seed,
) -> Episode:
    """Play one episode in this process, whose environments live as long as it does."""
    key = (hash(config.model_dump_json()), forest)
    if key not in _environments:
        loaded = Forest.from_bytes(forest) if forest is not None else None
        _environments[key] = OffroadEnv(config, loaded, _shelf)
    return play(_environments[key], Policy.from_bytes(policy), hold, seed)
