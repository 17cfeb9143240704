"""ROS 1 master on loopback, the reference tools, and our commands, for tests and benchmarks."""

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_TOOLS = ("rosmaster", "rosbag", "rostopic", "rosparam")


def has_tools() -> bool:
    """Return True if ROS 1's tools are installed as Debian does."""
    return all(shutil.which(tool, path="/usr/bin") for tool in _TOOLS)


def restore_interrupts() -> None:
    """Restore the default of SIGINT, which a shell ignores in background processes."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


class Graph:
    """A master on loopback and the processes around it."""

    def __init__(self, folder: Path) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.folder = folder
        self.environment = os.environ | {
            "ROS_MASTER_URI": f"http://127.0.0.1:{self.port}",
            "ROS_IP": "127.0.0.1",
            "ROS_HOME": str(folder / "home"),
            # The tools belong to the system's Python.
            "PATH": f"/usr/bin{os.pathsep}{os.environ['PATH']}",
        }
        self.processes: list[subprocess.Popen[bytes]] = []

    def start(self, *words: object) -> "subprocess.Popen[bytes]":
        """Start a process whose output goes to a file named after its number."""
        name = self.folder / f"{len(self.processes)}"
        with name.with_suffix(".out").open("wb") as out, name.with_suffix(".err").open("wb") as err:
            process = subprocess.Popen(
                [str(word) for word in words],
                env=self.environment,
                stdout=out,
                stderr=err,
                start_new_session=True,
                preexec_fn=restore_interrupts,
            )
        process.output = name.with_suffix(".out")
        self.processes.append(process)
        return process

    def andabata(self, *words: object) -> "subprocess.Popen[bytes]":
        """Start one of our commands."""
        return self.start(sys.executable, "-m", "andabata", "ros", *words, "--json", "--quiet")

    def tool(self, *words: object, seconds: float = 60.0) -> str:
        """Run a reference tool to its end; a tool without one is interrupted after ``seconds``."""
        process = self.start(*words)
        with suppress(subprocess.TimeoutExpired):
            process.wait(seconds)
        stop(process)
        return process.output.read_text()

    def wait_for(self, topic: str, kind: str) -> None:
        """Wait until a topic has a publisher or a subscriber."""
        for _ in range(60):
            info = self.tool("rostopic", "info", topic)
            part = info.split(kind)[-1] if kind in info else ""
            if part.strip() and not part.strip().startswith("None"):
                return
            time.sleep(0.5)
        raise AssertionError(f"{topic}: expected {kind}")


def stop(process: "subprocess.Popen[bytes]") -> None:
    """Interrupt a process and its children, as a terminal does."""
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGINT)
        try:
            process.wait(15)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def stopped(recorder: "subprocess.Popen[bytes]", path: Path) -> Path:
    """Stop the reference recorder and return its bag, which takes that name when it is whole."""
    stop(recorder)
    for _ in range(100):
        if path.exists():
            return path
        time.sleep(0.1)
    raise AssertionError(f"{path}: expected a finished bag")


def result(process: "subprocess.Popen[bytes]", seconds: float) -> dict[str, object]:
    """Return the JSON that one of our commands prints at its end."""
    assert process.wait(seconds) == 0, process.output.with_suffix(".err").read_text()
    return json.loads(process.output.read_text())


@contextmanager
def running(folder: Path) -> Iterator[Graph]:
    """Start a master and stop it, and everything around it, at the end."""
    found = Graph(folder)
    try:
        found.start("rosmaster", "--core", "-p", found.port)
        for _ in range(100):
            with suppress(OSError), socket.create_connection(("127.0.0.1", found.port), 1):
                break
            time.sleep(0.1)
        yield found
    finally:
        for process in reversed(found.processes):
            stop(process)
