"""A laser of your own: its beams as settings, a labelled cloud of it, and its virtual scan.

A spinning laser is a table of beams that turn. ``own_laser.toml``, which this writes, is for every
command that has a laser: ``andabata drive --config own_laser.toml``, ``andabata clouds generate
--config own_laser.toml``.
"""

import tomllib
from pathlib import Path

import numpy as np

from andabata.datasets.labelled_cloud import CloudsConfig, cloud_scene, labelled_cloud
from andabata.models import shipped_forest
from traversability.labels import CellState, label_cells
from traversability.scanner import TraversabilityScanner
from traversability.virtual_scan import virtual_scan

LASER = """
[sensing.lidar]
beams = 16
elevations_deg = [-24, -20, -17, -14, -11, -9, -7, -5, -3, -2, -1, 0, 1, 3, 7, 12]
sweep_hz = 18000.0   # columns a second, 1800 of each turn
head_rate = 62.83    # rad/s: ten turns a second
min_range = 0.4      # m
max_range = 60.0
noise = 0.02

[assembly]
turn = 6.2832        # a cloud is a whole turn of beams that look to one side
"""


def main() -> None:
    """Take a cloud in a wood, scan it, and compare its cells with those of the truth."""
    Path("own_laser.toml").write_text(LASER)
    settings = {"presets": ["forest"], "patch_size": 40.0} | tomllib.loads(LASER)
    config = CloudsConfig.model_validate(settings)
    cloud = labelled_cloud(cloud_scene(config, "forest", 7300), config, np.random.default_rng(0))
    scanner = TraversabilityScanner(shipped_forest())
    cells = scanner.cells(cloud.points)
    truth = label_cells(cloud.points, cloud.nontraversable, scanner.grid)
    known = truth != CellState.EMPTY
    print(f"{len(cloud)} points, {cloud.nontraversable.mean():.0%} of them on what blocks")
    print(f"{known.sum()} cells seen, {(cells == truth)[known].mean():.0%} as in truth")
    ranges = virtual_scan(cells, scanner.grid).ranges  # Infinite: free; NaN: unknown.
    ahead = np.abs(scanner.grid.bearings) < np.pi / 4
    print("free ahead [m]:", " ".join(f"{free:.1f}" for free in ranges[ahead]))


if __name__ == "__main__":
    main()
