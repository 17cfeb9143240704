"""Playing a curriculum's episodes in several processes."""

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from functools import partial
from types import TracebackType
from typing import Self

from andabata.engine import open_pool
from andabata.models import Models
from andabata.tasks.offroad import OffroadConfig, OffroadEnv
from andabata.tasks.planar import FlatVectorEnv, is_flat
from rl.policy import Policy
from rl.training import Episode, EpisodeSpec, play, play_together
from worlds.scenes import SceneCache

_Files = tuple[bytes, bytes, bytes]
_Share = tuple[int, ...]

_environments: dict[tuple[int, _Files], OffroadEnv] = {}
_robots: dict[int, FlatVectorEnv] = {}
_scenes = SceneCache(4)  # Few worlds of a pool are drawn again soon, and each takes 17 MB.

_LANES = 8
"""Robots of the first stage that a process drives side by side."""


class ParallelSampler:
    """Plays each episode in whichever process is free; an episode depends on its seed alone.

    With one worker everything happens in this process. The robots of the first stage are driven
    side by side in one compiled pass, a share of them in each process.
    """

    def __init__(self, stages: Sequence[OffroadConfig], models: Models, workers: int) -> None:
        """Prepare.

        Args:
            stages: Environment of each stage.
            models: Classifiers of cells and squares.
            workers: Processes.
        """
        self._stages = tuple(stages)
        self._files = models.to_bytes()
        self._workers = workers
        self._stack = ExitStack()
        self._pool: ProcessPoolExecutor | None = None

    def __call__(
        self,
        policy: Policy,
        hold: int,
        specs: Sequence[EpisodeSpec],
        explore: bool,
    ) -> list[Episode]:
        """Play what is assigned; see ``rl.training.Sampler``."""
        work = partial(_play, self._stages, self._files, policy.to_bytes(), hold, explore)
        shares = self._shares(specs)
        jobs = [tuple(specs[k] for k in share) for share in shares]
        played = map(work, jobs) if self._pool is None else self._pool.map(work, jobs)
        found = {
            number: episode
            for share, episodes in zip(shares, played, strict=True)
            for number, episode in zip(share, episodes, strict=True)
        }
        return [found[number] for number in range(len(specs))]

    def _shares(self, specs: Sequence[EpisodeSpec]) -> list[_Share]:
        """Return which episodes are played together: the flat stage's, else each alone."""
        flat: dict[int, list[int]] = {}
        alone: list[_Share] = []
        for number, one in enumerate(specs):
            if is_flat(self._stages[one.stage]):
                flat.setdefault(one.stage, []).append(number)
            else:
                alone.append((number,))
        shares = [
            tuple(numbers[k :: self._workers])
            for numbers in flat.values()
            for k in range(min(self._workers, len(numbers)))
        ]
        return alone + shares

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
    stages: Sequence[OffroadConfig],
    files: _Files,
    policy: bytes,
    hold: int,
    explore: bool,
    share: Sequence[EpisodeSpec],
) -> list[Episode]:
    """Play one stage's episodes in this process, whose environments live as long as it does."""
    config, actor = stages[share[0].stage], Policy.from_bytes(policy)
    name = hash(config.model_dump_json())
    if is_flat(config):
        if name not in _robots:
            _robots[name] = FlatVectorEnv(config, _LANES, _scenes, autoreset=False)
        return play_together(_robots[name], actor, hold, share, explore)
    key = (name, files)
    if key not in _environments:
        _environments[key] = OffroadEnv(config, Models.from_bytes(files), _scenes)
    return [play(_environments[key], actor, hold, one, explore) for one in share]
