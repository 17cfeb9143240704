"""Measures the live view: frames a second in a headless Chromium, and what it costs the drive.

``python -m andabata.bench.studies.viewer --json`` drives one world by the command line alone, as
fast as it goes: without the view, with it and a reader that takes in all that a browser is sent, as
one on another computer does, and with a page in a browser of this machine. That one draws without a
graphics card on the processors that the drive runs on: a lower bound of what a user sees.
"""

import argparse
import json
import os
import re
import resource
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, NamedTuple

from andabata.bench import chromium
from andabata.bench.studies.ros_graph import enable_interrupts
from andabata.runs.strict_json import dumps
from worlds.splits import DEVELOPMENT_SEED

if TYPE_CHECKING:
    from playwright.sync_api import Page, WebSocket

_VIEWPORT = {"width": 640, "height": 400}
"""Size of the page [pixels]."""

_COUNT_DRAWINGS = """
() => {
  window.drawings = 0;
  const count = () => { window.drawings += 1; requestAnimationFrame(count); };
  count();
}
"""

CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (0.0, 0.0, 5.0),
    "fov": 1.0,
    "near": 0.01,
    "far": 1000.0,
    "image_height": _VIEWPORT["height"],
    "image_width": _VIEWPORT["width"],
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
}
"""Message of a reader that is no browser."""

_STAMP = re.compile(r"([\d.]+) s, estimate")


def measure(seed: int, plant: str, points: int, seconds: float) -> dict[str, Any]:
    """Return the figures of one drive, ready for JSON.

    Args:
        seed: Seed of the drive and of its world.
        plant: Plant of the robot.
        points: Largest number of points that are shown.
        seconds: Time for which the page is watched [s].

    Raises:
        RuntimeError: If there is no browser, or the drive ends before the page is open.
    """
    if (reason := chromium.missing()) is not None:
        raise RuntimeError(f"browser: expected Chromium and playwright, got {reason}")
    words = ("drive", "--seed", str(seed), "--set", f"plant={plant}", "--json")
    view = ("--view", "--view-port", "0", "--view-points", str(points))
    fast = (*view, "--view-speed", "0")
    with tempfile.TemporaryDirectory() as name:
        command = (*words, "--out", str(Path(name) / "drive"))
        bare, read = _speed(command), _speed((*command, *fast))
        seen = _seen((*command, *view), seconds)
    return {
        "points": points,
        "viewport": [_VIEWPORT["width"], _VIEWPORT["height"]],
        "drive_alone": bare.speed,
        "drive_with_reader": read.speed,
        "reader_ratio": read.speed / bare.speed,
        "reader_cpu_ratio": bare.cpu / read.cpu,
        "reader_frames_per_s": read.frames_per_s,
        **seen,
        "page_ratio": seen["drive_with_page"] / bare.speed,
        "processors": os.cpu_count(),
        "load": round(os.getloadavg()[0], 2),
    }


class _Speed(NamedTuple):
    """Speed of a drive.

    Attributes:
        speed: Simulated seconds in a second.
        cpu: Processor seconds of the process in a simulated second, which other programs on the
            machine change less.
        frames_per_s: Frames that a reader took in a second; 0 without the view.
    """

    speed: float
    cpu: float
    frames_per_s: float


def _speed(words: Sequence[str]) -> _Speed:
    """Return the speed of a drive from begin to end, with a reader where there is a view."""
    runs = []
    for limit in ("1", "300"):
        begin, spent = time.monotonic(), _children_time()
        data = _driven((*words, "--time-limit", limit))
        driven = sum(attempt["time_s"] for attempt in data["attempts"])
        frames = data.get("view", {}).get("frames", 0)
        runs.append((driven, time.monotonic() - begin, _children_time() - spent, frames))
    # What both take is the start of the process, and the world.
    driven, span, cpu, frames = (long - short for short, long in zip(*runs, strict=True))
    return _Speed(float(driven / span), float(cpu / driven), float(frames / span))


def _children_time() -> float:
    """Return the processor time of this process's children that have ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _driven(words: Sequence[str]) -> dict[str, Any]:
    """Return the result of a drive; its view, if it has one, is read until it ends."""
    with _process(words) as drive:
        assert drive.stdout is not None
        assert drive.stderr is not None
        if "--view" in words:
            url = _url(drive.stderr)
            threading.Thread(target=read_page, args=(url,), daemon=True).start()
        else:
            threading.Thread(target=drive.stderr.read, daemon=True).start()
        result: dict[str, Any] = json.loads(drive.stdout.readline())
        # The page stays for its reader until it is interrupted.
        drive.send_signal(signal.SIGINT)
        return result


def read_page(url: str) -> None:
    """Take in all that a page is sent, until the server closes."""
    import msgspec
    import viser
    from websockets.exceptions import ConnectionClosed
    from websockets.sync.client import connect
    from websockets.typing import Subprotocol

    protocol = Subprotocol(f"viser-v{viser.__version__}")
    address = url.replace("http:", "ws:")
    with (
        suppress(ConnectionClosed, OSError),
        connect(address, subprotocols=[protocol], max_size=None, compression=None) as socket,
    ):
        # A page counts as open once its camera is known.
        socket.send(msgspec.msgpack.encode(CAMERA))
        while True:
            socket.recv()


def _process(words: Sequence[str]) -> subprocess.Popen[str]:
    """Start a command whose output can be read, and that Ctrl-C reaches."""
    return subprocess.Popen(
        [sys.executable, "-m", "andabata", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=enable_interrupts,
    )


def _seen(words: Sequence[str], seconds: float) -> dict[str, Any]:
    """Return the figures of a drive while a page of this machine shows it."""
    with chromium.browser() as browser, _process(words) as drive:
        try:
            assert drive.stderr is not None
            url = _url(drive.stderr)
            page = browser.new_page(viewport=_VIEWPORT)  # type: ignore[arg-type]
            frames: list[float] = []
            page.on("websocket", lambda socket: _count(socket, frames))
            page.goto(url)
            _settle(page)
            return _counted(page, frames, seconds)
        finally:
            drive.kill()


def _settle(page: "Page") -> None:
    """Wait until a page draws, and let the drive go as fast as it can from then on."""
    page.wait_for_selector("canvas", timeout=60_000)
    page.evaluate(_COUNT_DRAWINGS)
    page.wait_for_function("window.drawings > 20", timeout=60_000)
    page.get_by_label("Speed", exact=True).first.click(timeout=60_000)
    page.get_by_role("option", name="as fast as it goes").click(timeout=60_000)


def _url(messages: IO[str]) -> str:
    """Return the address that a command says its view has; its later messages are read away.

    Raises:
        RuntimeError: If it ends without any.
    """
    for line in messages:
        if line.startswith("view: "):
            threading.Thread(target=messages.read, daemon=True).start()
            return line.split()[1]
    raise RuntimeError("view: expected an address, got none; run the drive by hand to see why")


def _count(socket: "WebSocket", frames: list[float]) -> None:
    """Note the time at which each message comes over a page's socket."""
    socket.on("framereceived", lambda payload: frames.append(time.monotonic()))


def _counted(page: "Page", frames: list[float], seconds: float) -> dict[str, Any]:
    """Return frames, drawings and simulated seconds in a second of a page.

    Raises:
        RuntimeError: If the page says nothing of a drive.
    """
    begin, first, drawn = time.monotonic(), _stamp(page), page.evaluate("window.drawings")
    frames.clear()
    # The page's events are heard while this thread waits for the page, not while it sleeps.
    page.wait_for_timeout(1000 * seconds)
    drawn, last = page.evaluate("window.drawings") - drawn, _stamp(page)
    span = time.monotonic() - begin
    if last <= first:
        raise RuntimeError("drive: expected one that goes on, got its end; watch it for less time")
    return {
        "page_frames_per_s": len(frames) / span,
        "page_drawings_per_s": drawn / span,
        "drive_with_page": (last - first) / span,
    }


def _stamp(page: "Page") -> float:
    """Return the time of the drive that a page tells [s]."""
    match = _STAMP.search(page.inner_text("body"))
    if match is None:
        raise RuntimeError("page: expected the time of the drive, got none")
    return float(match.group(1))


def main(argv: Sequence[str] | None = None) -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=DEVELOPMENT_SEED, help="Seed of the drive.")
    parser.add_argument(
        "--plant", default="bullet", help="Plant: bullet, mujoco, wheels or kinematic."
    )
    parser.add_argument("--points", type=int, default=32_000, help="Number of points shown.")
    parser.add_argument("--seconds", type=float, default=8.0, help="Time to watch.")
    parser.add_argument("--json", action="store_true", help="Print one JSON object.")
    options = parser.parse_args(argv)
    data = measure(options.seed, options.plant, options.points, options.seconds)
    if options.json:
        sys.stdout.write(dumps(data) + "\n")
        return
    for name, value in data.items():
        shown = f"{value:.2f}" if isinstance(value, float) else value
        sys.stdout.write(f"{name}: {shown}\n")


if __name__ == "__main__":
    main()
