"""Many robots at once, over as many processes as there are cores."""

from collections.abc import Sequence
from contextlib import suppress
from functools import partial
from itertools import pairwise
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv
from numpy.typing import NDArray

from andabata.models import Models
from andabata.tasks.maze import MazeVectorEnv, is_planar
from andabata.tasks.offroad import (
    OffroadConfig,
    OffroadEnv,
    stage_config,
)
from andabata.tasks.planar import PlanarVectorEnv
from andabata.tasks.rooms.catalogue import RoomTaskConfig
from andabata.tasks.rooms.config import RoomConfig
from andabata.tasks.rooms.env import RoomVectorEnv, room_renderer
from andabata.tasks.rooms.observations import RoomRenderer
from rl.gym_spaces import action_box, observation_box
from worlds.scenes import SceneCache

State = NDArray[np.float32]

TaskConfig = OffroadConfig | RoomTaskConfig
"""Settings of an environment of any kind."""

_ENDED = (
    "worker: expected a running process, got one that has ended; a script that makes environments "
    'with workers does so under `if __name__ == "__main__":`, and the errors above say more'
)


def make_vector(
    stage: str,
    num_envs: int = 1,
    config: OffroadConfig | None = None,
    workers: int = 1,
    scenes: SceneCache | None = None,
) -> VectorEnv[Any, Any, Any]:
    """Make a stage's environment for many robots: the entry point of ``gymnasium.make_vec``.

    All of them begin the next episode in the step in which the last one ended
    (``AutoresetMode.SAME_STEP``), and do what as many single environments do.

    Args:
        stage: ``Maze2D``, ``Maze3D`` or ``Natural``.
        num_envs: Robots.
        config: Instead of the stage's own.
        workers: Processes, each with its share of the robots; stage 1 needs one.
        scenes: Scenes to share in this process.
    """
    config = config or stage_config(stage)
    if is_planar(config):
        return MazeVectorEnv(config, num_envs, scenes)
    if workers <= 1:
        return robots_in_one_process(config, num_envs, scenes=scenes)
    return OffroadVectorEnv(config, num_envs, workers)


def is_batched(config: TaskConfig) -> bool:
    """Return True if many robots of a task are driven in one compiled pass."""
    return isinstance(config, RoomConfig) or is_planar(config)


def make_batch(config: TaskConfig, count: int, scenes: SceneCache | None = None) -> PlanarVectorEnv:
    """Return planar robots that begin their episodes on request.

    Args:
        config: A task of which ``is_batched`` is true.
        count: Number of robots.
        scenes: Scenes to share, where the task has any.

    Raises:
        ValueError: If the task is another.
    """
    if isinstance(config, RoomConfig):
        return RoomVectorEnv(config, count, autoreset=False)
    return MazeVectorEnv(config, count, scenes, autoreset=False)


def renderer_of(config: TaskConfig) -> RoomRenderer | None:
    """Return what renders a task's observations from situations; None where states are kept."""
    if isinstance(config, RoomConfig) and config.keeps_situations:
        return room_renderer(config)
    return None


def robots_in_one_process(
    config: OffroadConfig,
    count: int,
    models: Models | None = None,
    scenes: SceneCache | None = None,
) -> SyncVectorEnv:
    """Return robots that share scenes, models and process, one after the other.

    What a robot costs is work on its own arrays: 16 robots that take each stage of a step together
    would be 1.09 times as fast (measured). What they share is the world.

    Args:
        config: The stage.
        count: Robots.
        models: Classifiers and policy; None for the shipped ones.
        scenes: Scenes to share with others of this process.
    """
    make = partial(OffroadEnv, config, models, scenes or SceneCache())
    return SyncVectorEnv([make] * count, autoreset_mode=AutoresetMode.SAME_STEP)


class OffroadVectorEnv(VectorEnv[State, NDArray[np.float32], Any]):
    """Robots over several processes; see ``OffroadEnv`` for actions, states and rewards.

    Robot ``k`` does the same with any number of processes. What one step's infos hold is merged;
    entries that only some robots have are masked as Gymnasium does.
    """

    def __init__(
        self, config: OffroadConfig, num_envs: int, workers: int, models: Models | None = None
    ) -> None:
        """Start the processes.

        Args:
            config: The stage.
            num_envs: Robots.
            workers: Processes.
            models: Classifiers and policy; None for the shipped ones.

        Raises:
            ValueError: If a process ends before it has begun.
        """
        self.num_envs = num_envs
        self.metadata = {"autoreset_mode": AutoresetMode.SAME_STEP, "render_modes": []}
        self.single_observation_space, self.single_action_space = (
            observation_box(config.observations),
            action_box(config.actions),
        )
        self.observation_space = gym.vector.utils.batch_space(
            self.single_observation_space, num_envs
        )
        self.action_space = gym.vector.utils.batch_space(self.single_action_space, num_envs)
        edges = np.linspace(0, num_envs, min(workers, num_envs) + 1).astype(int)
        self._shares = [slice(a, b) for a, b in pairwise(edges.tolist())]
        files = (models or Models()).to_bytes()
        context = get_context("spawn")
        self._pipes: list[Connection] = []
        self._processes = []
        for share in self._shares:
            ours, theirs = context.Pipe()
            count = share.stop - share.start
            process = context.Process(target=_serve, args=(theirs, config, count))
            process.daemon = True
            process.start()
            theirs.close()
            self._pipes.append(ours)
            self._processes.append(process)
        # Not among the arguments: they fill the pipe of a process that ends at once, and starting
        # it would wait for ever.
        for pipe in self._pipes:
            _ask(pipe, files)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[State, dict[str, Any]]:
        """Begin an episode of each robot; an integer seeds robot ``k`` with ``seed + k``."""
        if seed is None or isinstance(seed, int):
            seed = [None if seed is None else seed + k for k in range(self.num_envs)]
        for pipe, share in zip(self._pipes, self._shares, strict=True):
            _ask(pipe, ("reset", list(seed[share]), options))
        answers = [_answer(pipe) for pipe in self._pipes]
        return np.concatenate([states for states, _ in answers]), self._merged(
            [info for _, info in answers]
        )

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[State, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Steer every robot for one control period of 0.1 s."""
        for pipe, share in zip(self._pipes, self._shares, strict=True):
            _ask(pipe, ("step", actions[share]))
        answers = [_answer(pipe) for pipe in self._pipes]
        states, rewards, terminated, truncated = (
            np.concatenate([answer[n] for answer in answers]) for n in range(4)
        )
        return states, rewards, terminated, truncated, self._merged([one[4] for one in answers])

    def _merged(self, infos: list[dict[str, Any]]) -> dict[str, Any]:
        """Return the infos of all shares as one."""
        merged: dict[str, Any] = {}
        names = {name: value for info in infos for name, value in info.items()}
        for name, sample in names.items():
            parts = [info.get(name) for info in infos]
            if isinstance(sample, dict):
                merged[name] = self._merged([part or {} for part in parts])
                continue
            whole = np.zeros((self.num_envs, *sample.shape[1:]), dtype=sample.dtype)
            for share, part in zip(self._shares, parts, strict=True):
                if part is not None:
                    whole[share] = part
            merged[name] = whole
        return merged

    def close_extras(self, **_: Any) -> None:  # noqa: ANN401 - Gymnasium's own form.
        """End the processes."""
        for pipe, process in zip(self._pipes, self._processes, strict=True):
            with suppress(ValueError):  # It may have ended already.
                _ask(pipe, ("close",))
            process.join(timeout=5)
            if process.is_alive():
                process.terminate()
            pipe.close()


def _ask(pipe: Connection, message: object) -> None:
    """Send a message to a process.

    Raises:
        ValueError: If the process has ended.
    """
    try:
        pipe.send(message)
    except OSError as error:
        raise ValueError(_ENDED) from error


def _answer(pipe: Connection) -> Any:  # noqa: ANN401 - what the environment returns.
    """Return what a process answers.

    Raises:
        ValueError: If the process reports an error, with its message.
    """
    try:
        answer = pipe.recv()
    except (EOFError, OSError) as error:
        raise ValueError(_ENDED) from error
    if isinstance(answer, str):
        raise ValueError(answer)
    return answer


def _serve(pipe: Connection, config: OffroadConfig, count: int) -> None:
    """Drive a share of the robots until told to stop; Ctrl-C is for the parent.

    The first message holds the files of the models.
    """
    import signal

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        models = Models.from_bytes(pipe.recv())
    except EOFError:
        return  # The parent is gone.
    robots = robots_in_one_process(config, count, models)
    try:
        while True:
            kind, *rest = pipe.recv()
            if kind == "close":
                return
            try:
                if kind == "reset":
                    answer: Any = robots.reset(seed=rest[0], options=rest[1])
                else:
                    answer = robots.step(rest[0])
            except ValueError as error:
                answer = str(error)
            pipe.send(answer)
    except (EOFError, BrokenPipeError):
        return  # The parent is gone.
    finally:
        robots.close()
