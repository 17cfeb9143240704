"""Measures the live view: frames a second in a headless Chromium, and what it costs the drive.

``python -m andabata.bench.viewer --json`` drives one world three times by the command line alone:
for a moment, from begin to end without the view, and with it and a page that is open. All drives go
as fast as they can. The browser draws without a graphics card, on the processors that the drive
runs on: a lower bound of what a user sees.
"""

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from andabata.bench import chromium
from andabata.bench.command import run_command

if TYPE_CHECKING:
    from playwright.sync_api import Page, WebSocket

_VIEWPORT = {"width": 640, "height": 400}
"""Size of the page [pixels]."""

_SETTLE = 6.0
"""Time after which the browser has compiled what it draws with [s]."""

_COUNT_DRAWINGS = """
() => {
  window.drawings = 0;
  const count = () => { window.drawings += 1; requestAnimationFrame(count); };
  count();
}
"""

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
    with tempfile.TemporaryDirectory() as name:
        folder = ("--out", str(Path(name) / "drive"))
        bare = _speed_without(words, folder)
        seen = _watched((*words, *folder), points, seconds)
    return {
        "points": points,
        "viewport": [_VIEWPORT["width"], _VIEWPORT["height"]],
        **seen,
        "drive_without_view": bare,
        "drive_ratio": seen["drive_with_view"] / bare,
        "processors": os.cpu_count(),
        "load": round(os.getloadavg()[0], 2),
    }


def _speed_without(words: Sequence[str], folder: Sequence[str]) -> float:
    """Return the simulated seconds in a second of a drive without the view."""
    spans = []
    for limit in ("1", "300"):
        begin = time.monotonic()
        data = json.loads(run_command(*words, *folder, "--quiet", "--time-limit", limit))
        driven = sum(attempt["time_s"] for attempt in data["attempts"])
        spans.append((driven, time.monotonic() - begin))
    (short, start), (long, whole) = spans
    # What both take is the start of the process, and the world.
    return float((long - short) / (whole - start))


def _watched(words: Sequence[str], points: int, seconds: float) -> dict[str, Any]:
    """Return the figures of a drive while a page shows it."""
    view = ("--view", "--view-port", "0", "--view-speed", "0", "--view-points", str(points))
    command = [sys.executable, "-m", "andabata", *words, *view]
    pipes: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True}
    with chromium.browser() as browser, subprocess.Popen(command, **pipes) as drive:
        try:
            assert drive.stderr is not None
            url = _url(drive.stderr)
            page = browser.new_page(viewport=_VIEWPORT)  # type: ignore[arg-type]
            frames: list[float] = []
            page.on("websocket", lambda socket: _count(socket, frames))
            page.goto(url)
            page.wait_for_selector("canvas")
            time.sleep(_SETTLE)
            return _counted(page, frames, seconds)
        finally:
            drive.terminate()


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
    page.evaluate(_COUNT_DRAWINGS)
    begin, first, drawn = time.monotonic(), _stamp(page), page.evaluate("window.drawings")
    frames.clear()
    # The page's events are heard while this thread waits for the page, not while it sleeps.
    page.wait_for_timeout(1000 * seconds)
    drawn, last = page.evaluate("window.drawings") - drawn, _stamp(page)
    span = time.monotonic() - begin
    if last <= first:
        raise RuntimeError("drive: expected one that goes on, got its end; watch it for less time")
    return {
        "frames_per_s": len(frames) / span,
        "drawings_per_s": drawn / span,
        "drive_with_view": (last - first) / span,
    }


def _stamp(page: "Page") -> float:
    """Return the time of the drive that a page tells [s]."""
    found = _STAMP.search(page.inner_text("body"))
    if found is None:
        raise RuntimeError("page: expected the time of the drive, got none")
    return float(found.group(1))


def main(argv: Sequence[str] | None = None) -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=7300, help="Seed of the drive.")
    parser.add_argument("--plant", default="bullet", help="Plant: bullet or kinematic.")
    parser.add_argument("--points", type=int, default=32_000, help="Number of points shown.")
    parser.add_argument("--seconds", type=float, default=8.0, help="Time to watch.")
    parser.add_argument("--json", action="store_true", help="Print one JSON object.")
    options = parser.parse_args(argv)
    data = measure(options.seed, options.plant, options.points, options.seconds)
    if options.json:
        sys.stdout.write(json.dumps(data) + "\n")
        return
    for name, value in data.items():
        shown = f"{value:.2f}" if isinstance(value, float) else value
        sys.stdout.write(f"{name}: {shown}\n")


if __name__ == "__main__":
    main()
