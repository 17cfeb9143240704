"""Cells of foreign labelled clouds."""

import hashlib

import numpy as np
import pytest

from andabata.datasets.foreign_clouds import foreign_samples, read_foreign_manifest
from tests.support.driven_ground import level_ground
from traversability.cloud import PointCloud
from traversability.dataset import DatasetError
from traversability.features import cell_features
from traversability.files import cloud_to_bytes
from traversability.grid import PolarGrid

GRID = PolarGrid()
TABLE = '[free]\n1 = "moss"\n[blocked]\n2 = "wall"\n'


@pytest.fixture
def manifest(tmp_path):
    """Return the manifest of two clouds of level ground with a wall ahead, by a table beside it."""
    points = level_ground()
    ahead = (points[:, 0] > 1.5) & (np.abs(points[:, 1]) < 0.5)
    points[:, 2] = np.where(ahead, 0.5, 0.0) - 1.2
    cloud = PointCloud(points, "sensor", classes=np.where(ahead, 2, 1))
    (tmp_path / "a.ply").write_bytes(cloud_to_bytes(cloud, "ply"))
    (tmp_path / "mine.toml").write_text(TABLE)
    entry = '[[clouds]]\nfile = "a.ply"\nsensor_height = 1.2\nlabels = "mine.toml"\n'
    path = tmp_path / "foreign.toml"
    path.write_text(entry + entry + "own_body = 2.0\n")
    return path


def test_cells_are_those_of_the_standing_cloud(manifest):
    """Features are of the cloud raised by its sensor's height; each cloud is its own world."""
    found = foreign_samples(manifest, GRID)
    cells = found.cells
    assert found.clouds == 2
    assert found.sha256 == hashlib.sha256(manifest.read_bytes()).hexdigest()
    assert set(cells.world) == {-1, -2}
    first = cells.select(cells.cloud == 0)
    assert 5 < first.blocked.sum() < len(first.blocked) / 2
    points = level_ground()
    ahead = (points[:, 0] > 1.5) & (np.abs(points[:, 1]) < 0.5)
    points[:, 2] = np.where(ahead, 0.5, 0.0)
    values = cell_features(points, GRID).values.reshape(-1, cells.features.shape[1])
    for row in first.features[:: len(first.features) // 5]:
        assert np.isclose(values, row, atol=2e-3).all(axis=1).any()
    # Within 2 m of the sensor, 1.2 m up, the second cloud has lost its own body.
    near = GRID.ring_edges[:-1][cells.ring] < 1.3
    assert near[cells.cloud == 0].any()
    assert not near[cells.cloud == 1].any()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("clouds = 3\n", "clouds: "),
        ("", "clouds: Field required"),
        ('[[clouds]]\nfile = "a"\nlabels = "goose"\n', "clouds.0.sensor_height: Field required"),
        ("[[clouds]\n", "expected TOML"),
    ],
)
def test_a_wrong_manifest_is_refused(tmp_path, text, words):
    """The error names the file, the place and what is expected there."""
    path = tmp_path / "foreign.toml"
    path.write_text(text)
    with pytest.raises(DatasetError, match=r"foreign\.toml: ") as error:
        read_foreign_manifest(path)
    assert words in str(error.value)


def test_clouds_without_a_labelled_cell_are_refused(manifest):
    """A cloud far above the rings' heights labels nothing, which points to its height."""
    manifest.write_text(manifest.read_text().replace("1.2", "9.0"))
    with pytest.raises(DatasetError, match="are sensor_height and labels right"):
        foreign_samples(manifest, GRID)
