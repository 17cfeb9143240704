"""Plays a curriculum's episodes over several processes."""

from collections.abc import Sequence
from functools import partial

from andabata.engine import Engine
from andabata.models import Models
from andabata.tasks.maze import is_planar
from andabata.tasks.offroad import OffroadEnv
from andabata.tasks.planar import PlanarVectorEnv
from andabata.tasks.rooms.config import RoomConfig
from andabata.tasks.vector import TaskConfig, is_batched, make_batch
from rl.policy import Policy, policy_from_bytes
from rl.training import Episode, EpisodeSpec, play, play_together
from worlds.scenes import SceneCache

_Files = tuple[bytes, bytes, bytes]
_Share = tuple[int, ...]

_environments: dict[tuple[int, _Files], OffroadEnv] = {}
_batches: dict[int, PlanarVectorEnv] = {}
_scenes = SceneCache(4)  # Few worlds of a pool are drawn again soon, and each takes 17 MB.

_ROBOTS = {"offroad": 8, "spn": 16, "td3": 32}
"""Number of planar robots that a process drives side by side, by task."""


class ParallelSampler:
    """Plays each episode in whichever process is free; an episode depends on its seed alone.

    Planar robots are driven side by side in one compiled pass, a share of them in each process.
    """

    def __init__(self, stages: Sequence[TaskConfig], models: Models, engine: Engine) -> None:
        """Prepare.

        Args:
            stages: Environment of each stage.
            models: Classifiers.
            engine: Engine that runs the episodes; its processes keep their environments.
        """
        self._stages = tuple(stages)
        self._files = models.to_bytes()
        self._engine = engine

    def __call__(
        self,
        policy: Policy,
        action_repeat: int,
        specs: Sequence[EpisodeSpec],
        explore: bool,
    ) -> list[Episode]:
        """Play episodes; see ``rl.training.RolloutFunction``."""
        work = partial(_play, self._stages, self._files, policy.to_bytes(), action_repeat, explore)
        shares = self._shares(specs)
        jobs = [tuple(specs[k] for k in share) for share in shares]
        episodes_by_index = {
            number: episode
            for share, episodes in zip(shares, self._engine.map(work, jobs), strict=True)
            for number, episode in zip(share, episodes, strict=True)
        }
        return [episodes_by_index[number] for number in range(len(specs))]

    def _shares(self, specs: Sequence[EpisodeSpec]) -> list[_Share]:
        """Return which episodes are played together: those of a planar stage, else each alone."""
        planar: dict[int, list[int]] = {}
        alone: list[_Share] = []
        for number, spec in enumerate(specs):
            if is_batched(self._stages[spec.stage]):
                planar.setdefault(spec.stage, []).append(number)
            else:
                alone.append((number,))
        workers = self._engine.workers
        shares = [
            tuple(numbers[k::workers])
            for numbers in planar.values()
            for k in range(min(workers, len(numbers)))
        ]
        return alone + shares


def _play(
    stages: Sequence[TaskConfig],
    files: _Files,
    policy: bytes,
    action_repeat: int,
    explore: bool,
    specs: Sequence[EpisodeSpec],
) -> list[Episode]:
    """Play one stage's episodes in this process, which keeps its environments."""
    config, actor = stages[specs[0].stage], policy_from_bytes(policy)
    name = hash(config.model_dump_json())
    if isinstance(config, RoomConfig) or is_planar(config):
        if name not in _batches:
            _batches[name] = make_batch(config, _ROBOTS[config.task], _scenes)
        return play_together(_batches[name], actor, action_repeat, specs, explore)
    key = (name, files)
    if key not in _environments:
        _environments[key] = OffroadEnv(config, Models.from_bytes(files), _scenes)
    return [play(_environments[key], actor, action_repeat, spec, explore) for spec in specs]
