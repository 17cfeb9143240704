"""Engine of a cluster: tasks of Ray core on any number of machines (extra ``ray``).

The package is installed on every node, at the commit of the driver; Ray carries tasks and results,
no code. A node writes nothing but its cache of compiled functions: results go to the driver.
"""

import os
import socket
import sys
from collections.abc import Collection, Iterable
from types import TracebackType
from typing import Any, Self

from andabata.distribution import install_extra
from andabata.engine import ParallelEngine, Reply, Tell, WorkerLostError, answer
from andabata.engine_origin import OriginError
from andabata.engine_processes import give_memory_back

_PATIENCE = 10.0
"""Time without a result after which it is asked whether any worker is left, and the time that a
head may take to answer [s]."""


class RayError(ValueError):
    """Ray that is not installed, or a cluster that does not answer."""


class RayEngine(ParallelEngine):
    """Runs tasks on a Ray cluster, or on a Ray of its own on this machine.

    Ray itself retries nothing, so that each retry is reported: a task whose process, raylet or node
    was lost is handed out again by ``ParallelEngine``.
    """

    def __init__(
        self, workers: int, address: str | None = None, tell: Tell = lambda text: None
    ) -> None:
        """Prepare for a cluster, which ``with`` joins.

        Args:
            workers: Number of tasks at a time; more than the cluster's processors may wait there.
            address: ``HOST:PORT`` of the head of a cluster that this machine is a node of,
                ``auto`` for the one that runs here, None to start one for the time of the block.
            tell: Function that takes a line for people.
        """
        # Of its own processors none waits for this process; on a cluster more would start.
        super().__init__(workers, workers if address else 2 * workers, tell)
        self._address, self._call, self._was_empty = address, None, False

    def __enter__(self) -> Self:
        """Join the cluster, or start one.

        Raises:
            RayError: If Ray is not installed, or the cluster does not answer.
        """
        ray = _ray()
        _check_address(self._address)
        # No measures of use leave the machine unless the user asks for it.
        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
        own = {} if self._address else {"num_cpus": self.workers, "include_dashboard": False}
        try:
            ray.init(
                address=self._address or "local", log_to_driver=False, logging_level="error", **own
            )
        except (ConnectionError, RuntimeError, ValueError) as error:
            raise RayError(
                f"--address {self._address or 'of this machine'}: expected a Ray cluster, got "
                f"{error}; start its head with `ray start --head`, give the command on a node of "
                "it, and set RAY_AUTH_MODE as it was there"
            ) from error
        self._call = ray.remote(num_cpus=1, max_retries=0, runtime_env=_ENVIRONMENT)(_answer)
        nodes = [node for node in ray.nodes() if node["Alive"]]
        processors = sum(node["Resources"].get("CPU", 0.0) for node in nodes)
        self._tell(f"ray: {processors:.0f} processors on {len(nodes)} node(s)")
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Leave the cluster, which ends what still runs for this process."""
        self._call = None
        _ray().shutdown()

    def _share(self, work: Any) -> Any:  # noqa: ANN401 - Ray's reference.
        """Put the work, with the models in it, into Ray's store: it goes to each node once."""
        if self._call is None:
            raise ValueError("engine: expected a `with` block for Ray, got none")
        return _ray().put(work)

    def _submit(self, work: Any, task: Any) -> Any:  # noqa: ANN401 - Ray's reference.
        """Hand out a task."""
        assert self._call is not None
        return self._call.remote(self.origin, work, task)

    def _wait(self, calls: Collection[Any]) -> Iterable[Any]:
        """Return the calls that are over, at least one; say so when no worker is left."""
        ray = _ray()
        while True:
            done, _ = ray.wait(list(calls), num_returns=1, timeout=_PATIENCE)
            if done:
                self._was_empty = False
                return done
            if not self._was_empty and not ray.cluster_resources().get("CPU"):
                self._was_empty = True
                self._tell("ray: no processor is left: waiting for a node to join")

    def _reply(self, call: Any) -> Reply[Any]:  # noqa: ANN401 - Ray's reference.
        """Return the reply of a call that is over, or raise the error of its work.

        Raises:
            OriginError: If the worker has other code, with which it may not even read the task.
            WorkerLostError: If its worker ended before.
        """
        ray = _ray()
        kinds = {getattr(ray.exceptions, name): text for name, text in _LOST.items()}
        try:
            return ray.get(call)
        except ray.exceptions.RayTaskError as error:
            if not isinstance(error.cause, ray.exceptions.RaySystemError):
                raise error.cause from error
            raise OriginError(
                "a worker of the cluster: expected the package andabata at commit "
                f"{self.origin.commit}, as the driver's, got one that cannot read a task "
                f"({str(error.cause).splitlines()[0]}); install that commit on every node and "
                "start its ray again"
            ) from error
        except tuple(kinds) as error:
            words = [text for kind, text in kinds.items() if isinstance(error, kind)]
            raise WorkerLostError(words[0]) from error


_LOST = {
    "WorkerCrashedError": "a worker process of the cluster was killed",
    "OutOfMemoryError": "a worker process of the cluster was killed for its memory",
    "NodeDiedError": "a node of the cluster was lost",
    "ObjectLostError": "a result was lost with its node",
}
"""Errors of Ray that tell of a lost worker, in words."""

_ENVIRONMENT = {"env_vars": {"OMP_NUM_THREADS": "1"}}
"""Environment of the workers: many threads of one would wait for each other."""


def _answer(expected: Any, work: Any, task: Any) -> Reply[Any]:  # noqa: ANN401
    """Run a task in a worker of Ray; see ``engine.answer``."""
    give_memory_back()
    return answer(expected, work, task)


def _ray() -> Any:  # noqa: ANN401 - a package that need not be there.
    """Return the package.

    Raises:
        RayError: If it is not installed.
    """
    try:
        import ray
        import ray._private.worker
        import ray.exceptions
    except ModuleNotFoundError as error:
        raise RayError(
            f"--engine ray: expected the package ray, got none in {sys.prefix}; "
            f"{install_extra('ray')}"
        ) from error
    # Else Ray writes of killed workers to stdout, which is for results; the engine tells of them.
    ray._private.worker._worker_logs_enabled = False
    return ray


def _check_address(address: str | None) -> None:
    """Refuse an address at which nobody answers: Ray itself would try for a minute.

    Raises:
        RayError: If it is no address, or nobody answers.
    """
    if address in (None, "auto"):
        return
    host, _, port = address.rpartition(":")
    if not (host and port.isdigit()):
        raise RayError(f"--address: expected auto or HOST:PORT, got {address!r}")
    try:
        socket.create_connection((host, int(port)), timeout=_PATIENCE).close()
    except OSError as error:
        raise RayError(
            f"--address {address}: expected the head of a Ray cluster, got no answer ({error}); "
            "start one with `ray start --head --port=6379`, or check the address"
        ) from error
