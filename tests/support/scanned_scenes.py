"""Scene of flat ground and a wall, seen by a level laser, and its scan by the command line."""

import json
import re

import numpy as np
from matplotlib.figure import Figure

from andabata.app.cli import main


def scene(height=0.72, noise=0.01, ahead=4.0, seed=0):
    """Return the points of a laser [m]: ground ``height`` below it, a wall 4 m wide, shape (n, 3).

    The true ranges are 3.25 m straight ahead, the inner edge of the wall's ring, and 10 m beside.
    """
    bearing = np.linspace(-np.pi, np.pi, 512, endpoint=False)
    a, e = np.meshgrid(bearing, np.deg2rad(np.linspace(-45, 10, 64)))
    u = np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], -1).reshape(-1, 3)
    with np.errstate(all="ignore"):
        ground = np.where(u[:, 2] < 0, -height / u[:, 2], np.inf)
        wall = np.where(u[:, 0] > 0, ahead / u[:, 0], np.inf)
        hit = u * wall[:, None]
        t = np.minimum(ground, np.where((abs(hit[:, 1]) < 2) & (hit[:, 2] < 1), wall, np.inf))
        points = (u * t[:, None])[t < 30]
    return points + np.random.default_rng(seed).normal(0, noise, points.shape)


def unpainted(monkeypatch):
    """Let scans draw an empty picture, which takes most of their time."""
    monkeypatch.setattr(
        "andabata.app.scan_files.scan_figure", lambda scanned, title: Figure((1, 1))
    )


def scan(capsys, path, *options):
    """Return the result of ``andabata scan`` as it prints it, with its exit code."""
    picture = str(path.with_suffix(".png"))
    code = main(["scan", str(path), "--json", "--picture", picture, *options])
    out, err = capsys.readouterr()
    return json.loads(out) | {"code": code} if out else {"code": code, "error": err}


def is_right(result, tolerance=1):
    """Return True if the wall ends the sectors ahead and all others are free, but for a few."""
    ranges = np.array([np.nan if r is None else r for r in result["ranges"]])
    count = len(ranges)
    ahead = ranges[count // 2 - 1 : count // 2 + 1]
    beside = np.delete(ranges, np.arange(count // 2 - 4, count // 2 + 4))
    return bool((np.abs(ahead - 3.245) < 0.01).all() and (beside < 10.0).sum() <= tolerance)


def advised(note, option):
    """Return the option with the value that a note gives it, as words of a command line."""
    match = re.search(rf"{option} (?:should be about )?([-\d.,a-z=]*\d)", note)
    assert match, f"{option} in {note!r}"
    return [option, match.group(1)]
