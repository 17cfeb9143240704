"""A ROS 1 master on loopback with the reference tools and our nodes around it, as processes.

The live benchmark and the tests of the live graph use it; Debian's ROS 1 packages have to be there
(``make ros``).
"""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any


def enable_interrupts() -> None:
    """Let Ctrl-C reach this process; a shell starts background processes without it."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


class LoggedProcess(subprocess.Popen[bytes]):
    """Process whose output goes to files.

    Attributes:
        output: File of its standard output; that of its messages ends in ``.err`` instead.
    """

    output: Path


class Graph:
    """ROS master on loopback and the processes around it.

    Attributes:
        port: Port of the master.
        folder: Folder of the processes' outputs.
        environment: Environment variables of the processes.
        processes: Processes in the order of their start.
    """

    def __init__(self, folder: Path) -> None:
        """Choose a free port; nothing is started yet."""
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port: int = free.getsockname()[1]
        self.folder = folder
        self.environment = os.environ | {
            "ROS_MASTER_URI": f"http://127.0.0.1:{self.port}",
            "ROS_IP": "127.0.0.1",
            "ROS_HOME": str(folder / "home"),
            # The tools belong to the system's Python.
            "PATH": f"/usr/bin{os.pathsep}{os.environ['PATH']}",
        }
        self.processes: list[LoggedProcess] = []

    def start(self, *words: object) -> LoggedProcess:
        """Start a process whose output goes to a file named after its number."""
        name = self.folder / f"{len(self.processes)}"
        with name.with_suffix(".out").open("wb") as out, name.with_suffix(".err").open("wb") as err:
            process = LoggedProcess(
                [str(word) for word in words],
                env=self.environment,
                stdout=out,
                stderr=err,
                start_new_session=True,
                preexec_fn=enable_interrupts,
            )
        process.output = name.with_suffix(".out")
        self.processes.append(process)
        return process

    def andabata(self, *words: object) -> LoggedProcess:
        """Start one of the nodes of ``andabata ros``."""
        return self.start(sys.executable, "-m", "andabata", "ros", *words, "--json", "--quiet")

    def tool(self, *words: object, seconds: float = 60.0) -> str:
        """Return the output of a reference tool, which is interrupted after ``seconds``."""
        process = self.start(*words)
        with suppress(subprocess.TimeoutExpired):
            process.wait(seconds)
        stop(process)
        return process.output.read_text()

    def wait_for(self, topic: str, kind: str) -> None:
        """Wait until a topic has a publisher or a subscriber.

        Args:
            topic: Name of the topic.
            kind: Heading in the output of ``rostopic info``: ``Publishers:`` or ``Subscribers:``.

        Raises:
            TimeoutError: If there is none after half a minute.
        """
        for _ in range(60):
            info = self.tool("rostopic", "info", topic)
            part = info.split(kind)[-1] if kind in info else ""
            if part.strip() and not part.strip().startswith("None"):
                return
            time.sleep(0.5)
        raise TimeoutError(f"{topic}: expected {kind.lower().rstrip(':')}, got none in 30 s")


def stop(process: LoggedProcess) -> None:
    """Interrupt a process and its children, as a terminal does."""
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGINT)
        try:
            process.wait(15)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def finished_bag(recorder: LoggedProcess, path: Path) -> Path:
    """Stop the reference recorder and return its bag, which takes that name when it is complete.

    Raises:
        TimeoutError: If there is no bag after ten seconds.
    """
    stop(recorder)
    for _ in range(100):
        if path.exists():
            return path
        time.sleep(0.1)
    raise TimeoutError(f"{path}: expected a finished bag, got none in 10 s")


def result(process: LoggedProcess, seconds: float) -> dict[str, Any]:
    """Return the JSON object that one of our nodes prints at its end.

    Args:
        process: Node that ends when its time is over.
        seconds: Longest time to wait for that [s].

    Raises:
        RuntimeError: If the node fails.
    """
    if process.wait(seconds) != 0:
        raise RuntimeError(process.output.with_suffix(".err").read_text())
    printed: dict[str, Any] = json.loads(process.output.read_text())
    return printed


@contextmanager
def running(folder: Path) -> Iterator[Graph]:
    """Yield a graph whose master runs; the master and all processes around it end with it."""
    graph = Graph(folder)
    try:
        graph.start("rosmaster", "--core", "-p", graph.port)
        for _ in range(100):
            with suppress(OSError), socket.create_connection(("127.0.0.1", graph.port), 1):
                break
            time.sleep(0.1)
        yield graph
    finally:
        for process in reversed(graph.processes):
            stop(process)
