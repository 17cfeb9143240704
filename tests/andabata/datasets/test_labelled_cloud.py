"""Labelled clouds: the truth is where the beams really were, whatever the robot believes."""

import numpy as np
import pytest

from andabata.app.settings import with_parts
from andabata.datasets.generate import plan
from andabata.datasets.labelled_cloud import CloudsConfig, cloud_scene, labelled_cloud
from terrain.classes import SemanticClass
from worlds.world import Start

SMALL = CloudsConfig(patch_size=40.0, patch_cell=0.25)


@pytest.fixture(scope="module")
def scene():
    return cloud_scene(SMALL, "forest", 12)


def take(scene, **changes):
    config = SMALL.model_copy(update=changes)
    return labelled_cloud(scene, config, np.random.default_rng(4))


def test_labels_do_not_follow_the_robots_errors(scene):
    sure = take(scene, drift_sigma=(0.0, 0.0), tilt_sigma=(0.0, 0.0))
    lost = take(scene, drift_sigma=(0.5, 0.5), tilt_sigma=(0.02, 0.02))
    np.testing.assert_array_equal(sure.severity, lost.severity)
    np.testing.assert_array_equal(sure.classes, lost.classes)
    np.testing.assert_array_equal(sure.forbidden, lost.forbidden)
    assert np.abs(sure.points - lost.points).max() > 0.05


def test_things_are_forbidden_and_level_ground_is_not(scene):
    cloud = take(scene)
    trunks = cloud.classes == SemanticClass.TRUNK
    ground = cloud.classes == SemanticClass.GROUND
    assert np.isposinf(cloud.severity[trunks]).all()
    assert np.isfinite(cloud.severity[ground]).all()
    np.testing.assert_array_equal(cloud.nontraversable, cloud.severity > 0)
    assert cloud.forbidden[trunks].mean() > 0.9  # Some trunks lean out over free ground.
    assert cloud.forbidden[ground].mean() < 0.5


def test_varied_clouds_are_thinner_and_from_other_heights(scene):
    plain, varied = take(scene), take(scene, varied=1.0, kept=(0.3, 0.3), heights=(1.0, 1.0))
    assert 0.2 * len(plain) < len(varied) < 0.45 * len(plain)
    nearest = [np.hypot(*cloud.points[:, :2].T).min() for cloud in (plain, varied)]
    assert nearest[1] > nearest[0]  # The blind cone grows with the height.


def test_a_tilted_laser_sees_the_same_ground(make_scene):
    scene = make_scene(size=40.0)
    start = Start(0.0, 0.0, 0.3)
    exact = {"drift_sigma": (0.0, 0.0), "tilt_sigma": (0.0, 0.0), "still": 1.0}
    config = with_parts(CloudsConfig, "vlp-16").model_copy(
        update={"varied": 1.0, "heights": (1.0, 1.0), "kept": (1.0, 1.0), **exact}
    )
    nearest = {}
    for tilt in (0.0, 0.1):
        leaning = config.model_copy(update={"tilts": (tilt, tilt)})
        cloud = labelled_cloud(scene, leaning, np.random.default_rng(1), start)
        assert np.abs(cloud.points[:, 2]).max() < 0.15  # Level, whatever way the laser leans.
        bearing = np.arctan2(cloud.points[:, 1], cloud.points[:, 0])
        distance = np.hypot(cloud.points[:, 0], cloud.points[:, 1])
        nearest[tilt] = [distance[np.abs(bearing - b) < 0.2].min() for b in np.arange(-3, 3.1, 0.5)]
    assert np.ptp(nearest[0.0]) < 0.3  # A level cone meets level ground in a circle.
    assert np.ptp(nearest[0.1]) > 1.0  # A leaning one does not.


def test_what_is_hidden_is_hidden_by_direction(scene):
    whole = take(scene, varied=1.0, heights=(0.72, 0.72), kept=(1.0, 1.0))
    part = take(scene, varied=1.0, heights=(0.72, 0.72), kept=(1.0, 1.0), hidden=64)
    assert 0.2 * len(whole) < len(part) < len(whole)


def test_low_grass_and_litter_lift_points_along_their_beams(make_scene):
    """Half of the clouds are covered; what covers the ground forbids nothing."""
    scene, start = make_scene(size=40.0), Start(0.0, 0.0, 0.3)
    exact = {"drift_sigma": (0.0, 0.0), "tilt_sigma": (0.0, 0.0), "noise": (0.0, 0.0)}
    config = with_parts(CloudsConfig, "vlp-16").model_copy(
        update={"varied": 1.0, "heights": (1.0, 1.0), "kept": (1.0, 1.0), "still": 1.0, **exact}
    )
    covers = {"grass": (0.15, 0.15)}, {"litter": (0.02, 0.02)}
    for cover, highest, spread in zip(covers, (0.15, 0.12), (0.02, 0.01), strict=True):
        heights = []
        for seed in range(8):
            rng = np.random.default_rng(seed)
            cloud = labelled_cloud(scene, config.model_copy(update=cover), rng, start)
            assert not cloud.nontraversable.any()
            heights.append(cloud.points[:, 2])
            # A point moves along its beam: seen from the laser, its elevation stays a beam's own.
            distance = np.hypot(cloud.points[:, 0], cloud.points[:, 1])
            elevation = np.rad2deg(np.arctan2(cloud.points[:, 2] - 1.0, distance))
            assert np.abs(elevation - np.round((elevation - 1) / 2) * 2 - 1).max() < 0.1
        covered = [z for z in heights if z.std() > 0.5 * spread]
        assert 1 <= len(covered) <= 7
        assert all(np.abs(z).max() <= highest + 1e-3 for z in heights)


def test_water_sends_few_beams_back():
    scene = cloud_scene(SMALL, "lake", 3)
    clouds = [
        labelled_cloud(scene, SMALL, np.random.default_rng(seed)).classes for seed in range(4)
    ]
    wet = np.concatenate(clouds) == SemanticClass.WATER
    assert 0 < wet.mean() < 0.05


def test_each_split_has_its_own_worlds_and_every_kind():
    parties = plan(CloudsConfig(clouds_per_world=10), {"train": 100, "validation": 30})
    clouds = [number for batch in parties for number in batch.clouds]
    assert sorted(clouds) == list(range(130))
    assert len({batch.world for batch in parties}) == len(parties)
    for split in ("train", "validation"):
        kinds = {batch.world % 7 for batch in parties if batch.split == split}
        assert len(kinds) == 7
        assert max(len(batch.clouds) for batch in parties if batch.split == split) <= 10


def test_a_span_has_to_grow():
    with pytest.raises(ValueError, match="expected 0 <= least <= most <= 1"):
        CloudsConfig(noise=(0.03, 0.01))
