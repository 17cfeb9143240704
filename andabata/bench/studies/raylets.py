"""A Ray cluster of several raylets on this machine, to kill some of them (extra ``ray``)."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

_WATCHFUL = {"health_check_period_ms": 500, "health_check_failure_threshold": 3}
"""Ray misses a dead node after 1.5 s of silence instead of 15 s."""


class Raylets:
    """Raylets of one processor each; the first has the head beside it.

    Attributes:
        address: Address of the head, ``HOST:PORT``.
    """

    def __init__(self, cluster: Any, others: list[Any]) -> None:  # noqa: ANN401 - Ray is untyped.
        """Take a cluster and the nodes beside its head."""
        self.address: str = cluster.address
        self._cluster, self._others = cluster, others

    def kill_one(self) -> None:
        """Kill a raylet, and so its workers, as a machine that is switched off."""
        self._cluster.remove_node(self._others.pop(), allow_graceful=False)

    def worker(self) -> int:
        """Return the process of a worker of the last raylet that runs a task (Linux).

        Raises:
            LookupError: If none runs one.
        """
        (raylet,) = self._others[-1].all_processes["raylet"]
        for folder in Path("/proc").glob("[0-9]*"):
            with suppress(OSError):
                parent = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
                title = (folder / "cmdline").read_bytes()
                if parent == raylet.process.pid and title.startswith(b"ray::_answer"):
                    return int(folder.name)
        raise LookupError("worker: expected one that runs a task, got none")

    def start_one(self) -> None:
        """Start a raylet more."""
        self._others.append(self._cluster.add_node(num_cpus=1))


@contextmanager
def raylets(count: int = 2) -> Iterator[Raylets]:
    """Yield a cluster of raylets, which ends with the block.

    Args:
        count: Number of raylets.

    Raises:
        ModuleNotFoundError: If Ray is not installed.
    """
    from ray.cluster_utils import Cluster

    head = {"num_cpus": 1, "include_dashboard": False, "_system_config": _WATCHFUL}
    cluster = Cluster(initialize_head=True, head_node_args=head)
    try:
        fleet = Raylets(cluster, [])
        for _ in range(count - 1):
            fleet.start_one()
        yield fleet
    finally:
        cluster.shutdown()
