"""Folders of the BARN benchmark, written by the tests that read them."""

from pathlib import Path

import numpy as np

from tests.support.sdf_worlds import PLANE, POST, document, pose, solid


def world_text(places=((0.9, 4.0), (-4.0, 6.0)), extra=""):
    """Return a world of ground and posts of 0.1 m at places of the benchmark's frame [m]."""
    posts = [solid(f"c{k}", POST, pose(x, y, 0.5)) for k, (x, y) in enumerate(places)]
    return document(solid("ground", PLANE), *posts, *([extra] if extra else []))


def write_world(folder: Path, number: int = 1, path=((14, 0), (15, 29)), **settings) -> Path:
    """Write a world and its path, and return the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"world_{number}.world").write_text(world_text(**settings), encoding="utf-8")
    np.save(folder / f"path_{number}.npy", np.array(path))
    return folder
