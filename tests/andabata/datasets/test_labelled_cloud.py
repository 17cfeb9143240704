"""Labelled clouds: the truth is where the beams really were, whatever the robot believes."""

import numpy as np
import pytest

from andabata.configuration.settings import with_parts
from andabata.datasets.labelled_cloud import (
    CloudsConfig,
    cloud_scene,
    labelled_cloud,
    take_cloud,
)
from terrain.classes import SemanticClass
from terrain.objects import box
from worlds.traversability_map import Reason
from worlds.world import Start

SMALL = CloudsConfig(patch_size=40.0, patch_cell=0.25)


@pytest.fixture(scope="module")
def scene():
    return cloud_scene(SMALL, "forest", 12)


def take(scene, **changes):
    config = SMALL.model_copy(update=changes)
    return labelled_cloud(scene, config, np.random.default_rng(4))


def test_labels_do_not_follow_the_robots_errors(scene):
    """An error of the believed pose moves the points and changes no label."""
    sure = take(scene, drift_sigma=(0.0, 0.0), tilt_sigma=(0.0, 0.0))
    lost = take(scene, drift_sigma=(0.5, 0.5), tilt_sigma=(0.02, 0.02))
    np.testing.assert_array_equal(sure.severity, lost.severity)
    np.testing.assert_array_equal(sure.classes, lost.classes)
    np.testing.assert_array_equal(sure.forbidden, lost.forbidden)
    assert np.abs(sure.points - lost.points).max() > 0.05


def test_objects_are_forbidden_and_level_ground_is_not(scene):
    """Trunks are non-traversable without a limit, level ground is not."""
    cloud = take(scene)
    trunks = cloud.classes == SemanticClass.TRUNK
    ground = cloud.classes == SemanticClass.GROUND
    assert np.isposinf(cloud.severity[trunks]).all()
    assert np.isfinite(cloud.severity[ground]).all()
    np.testing.assert_array_equal(cloud.nontraversable, cloud.severity > 0)
    assert cloud.forbidden[trunks].mean() > 0.9  # Some trunks lean out over free ground.
    assert cloud.forbidden[ground].mean() < 0.5


def test_varied_clouds_are_thinner_and_from_other_heights(scene):
    """A varied cloud has its share of points, and a wider blind cone from higher up."""
    plain, varied = (
        take(scene),
        take(scene, varied_share=1.0, point_shares=(0.3, 0.3), lidar_heights=(1.0, 1.0)),
    )
    assert 0.2 * len(plain) < len(varied) < 0.45 * len(plain)
    nearest = [np.hypot(*cloud.points[:, :2].T).min() for cloud in (plain, varied)]
    assert nearest[1] > nearest[0]  # The blind cone grows with the height.


def test_a_tilted_laser_sees_the_same_ground(make_scene):
    """Level ground stays level in the cloud, whatever the tilt of the laser."""
    scene = make_scene(size=40.0)
    start = Start(0.0, 0.0, 0.3)
    exact = {"drift_sigma": (0.0, 0.0), "tilt_sigma": (0.0, 0.0), "standstill_share": 1.0}
    config = with_parts(CloudsConfig, "vlp-16").model_copy(
        update={
            "varied_share": 1.0,
            "lidar_heights": (1.0, 1.0),
            "point_shares": (1.0, 1.0),
            **exact,
        }
    )
    nearest = {}
    for tilt in (0.0, 0.1):
        leaning = config.model_copy(update={"lidar_tilts": (tilt, tilt)})
        cloud = labelled_cloud(scene, leaning, np.random.default_rng(1), start)
        assert np.abs(cloud.points[:, 2]).max() < 0.15  # Level, whichever way the laser leans.
        bearing = np.arctan2(cloud.points[:, 1], cloud.points[:, 0])
        distance = np.hypot(cloud.points[:, 0], cloud.points[:, 1])
        nearest[tilt] = [distance[np.abs(bearing - b) < 0.2].min() for b in np.arange(-3, 3.1, 0.5)]
    assert np.ptp(nearest[0.0]) < 0.3  # A level cone meets level ground in a circle.
    assert np.ptp(nearest[0.1]) > 1.0  # A leaning one does not.


def test_hidden_directions_take_points_away(scene):
    """Hidden directions take a part of the points, never all."""
    whole = take(scene, varied_share=1.0, lidar_heights=(0.72, 0.72), point_shares=(1.0, 1.0))
    part = take(
        scene,
        varied_share=1.0,
        lidar_heights=(0.72, 0.72),
        point_shares=(1.0, 1.0),
        max_hidden_directions=64,
    )
    assert 0.2 * len(whole) < len(part) < len(whole)


def test_low_grass_and_litter_lift_points_along_their_beams(make_scene):
    """Covers lift points along their beams in half of the clouds; the ground stays traversable."""
    scene, start = make_scene(size=40.0), Start(0.0, 0.0, 0.3)
    exact = {"drift_sigma": (0.0, 0.0), "tilt_sigma": (0.0, 0.0), "noise": (0.0, 0.0)}
    config = with_parts(CloudsConfig, "vlp-16").model_copy(
        update={
            "varied_share": 1.0,
            "lidar_heights": (1.0, 1.0),
            "point_shares": (1.0, 1.0),
            "standstill_share": 1.0,
            **exact,
        }
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
    """Few of the points lie on water."""
    scene = cloud_scene(SMALL, "lake", 3)
    clouds = [
        labelled_cloud(scene, SMALL, np.random.default_rng(seed)).classes for seed in range(4)
    ]
    wet = np.concatenate(clouds) == SemanticClass.WATER
    assert 0 < wet.mean() < 0.05


def test_a_span_has_to_grow():
    """A span whose end is below its begin is refused."""
    with pytest.raises(ValueError, match="expected 0 <= least <= most <= 1"):
        CloudsConfig(noise=(0.03, 0.01))


@pytest.mark.parametrize("heights", [(0.0, 1.0), (1.0, 0.5), (1.0, 6.0)])
def test_heights_are_bounded(heights):
    """Heights of the laser lie above 0 and within 5 m, in growing order."""
    with pytest.raises(ValueError, match="expected 0 < least <= most <= 5 m"):
        CloudsConfig(lidar_heights=heights)


def test_the_generator_gives_the_cloud(scene):
    """The same generator gives the same bytes, another one another cloud."""
    first, again, other = (
        labelled_cloud(scene, SMALL, np.random.default_rng(seed)) for seed in (4, 4, 5)
    )
    np.testing.assert_array_equal(first.points, again.points)
    np.testing.assert_array_equal(first.severity, again.severity)
    assert first.points.shape != other.points.shape


def test_a_cloud_is_taken_where_something_is_near(scene):
    """The robot stands clear of forbidden ground, with some of it in reach, at any heading."""
    truth, yaws = scene.world.truth, []
    for seed in range(3):
        config = SMALL.model_copy(update={"standstill_share": 1.0, "drift_sigma": (0.0, 0.0)})
        _, pose = take_cloud(scene, config, np.random.default_rng(seed))
        clearance = float(truth.clearance_at(*pose.position[:2]))
        assert SMALL.min_hazard_distance - 0.1 <= clearance <= SMALL.max_hazard_distance + 0.1
        yaws.append(pose.yaw)
    assert np.ptp(yaws) > 0.1


def test_without_such_a_place_there_is_no_cloud(make_scene):
    """Level ground without anything near is refused with the two settings to widen."""
    config = SMALL.model_copy(update={"max_hazard_distance": 0.5, "min_hazard_distance": 0.3})
    with pytest.raises(
        ValueError,
        match=r"min_hazard_distance, max_hazard_distance: expected a place 0\.3 to 0\.5 m",
    ):
        labelled_cloud(make_scene(size=40.0), config, np.random.default_rng(0))


def test_points_are_where_their_beams_ended(make_scene):
    """Without errors a wall is seen in base_footprint where it stands: ahead and to the left."""
    walls = [
        box(SemanticClass.WALL, (3.2, 0.0, 1.0), (0.4, 2.0, 2.0)),
        box(SemanticClass.WALL, (0.0, 2.2, 1.0), (2.0, 0.4, 2.0)),
    ]
    scene = make_scene(objects=walls, size=40.0)
    exact = {"drift_sigma": (0.0, 0.0), "tilt_sigma": (0.0, 0.0), "noise": (0.0, 0.0)}
    config = SMALL.model_copy(update={"standstill_share": 1.0, **exact})
    cloud = labelled_cloud(scene, config, np.random.default_rng(0), Start(0.0, 0.0, 0.0))
    wall = cloud.points[cloud.classes == SemanticClass.WALL]
    ahead, left = wall[wall[:, 0] > 2.9], wall[wall[:, 1] > 1.9]
    assert ahead[:, 0].min() == pytest.approx(3.0, abs=0.02)
    assert left[:, 1].min() == pytest.approx(2.0, abs=0.02)
    assert len(ahead) > 100
    assert len(left) > 100
    turned = labelled_cloud(scene, config, np.random.default_rng(0), Start(0.0, 0.0, np.pi / 2))
    wall = turned.points[turned.classes == SemanticClass.WALL]
    assert wall[wall[:, 0] > 1.9][:, 0].min() == pytest.approx(2.0, abs=0.02)
    assert wall[wall[:, 1] < -2.9][:, 1].max() == pytest.approx(-3.0, abs=0.02)


def test_difficulty_and_patch_are_those_of_the_settings():
    """A world is a patch of its preset; the seed draws the difficulty within the span."""
    config = SMALL.model_copy(update={"difficulty": (0.3, 0.4)})
    first, other = (cloud_scene(config, "forest", seed).world for seed in (12, 13))
    assert 0.3 <= first.difficulty <= 0.4
    assert first.difficulty != other.difficulty
    assert first.ground.width == pytest.approx(40.0)
    assert first.ground.cell == 0.25


def test_clouds_are_plain_by_default():
    """Without settings no cloud is varied, hidden, tilted or covered."""
    config = CloudsConfig()
    assert (config.varied_share, config.max_hidden_directions) == (0.0, 0)
    assert config.lidar_tilts == config.grass == config.litter == (0.0, 0.0)
    assert CloudsConfig.model_validate(config.model_dump()) == config
    with pytest.raises(ValueError, match="max_hidden_directions"):
        CloudsConfig(max_hidden_directions=-1)


def test_exact_clouds_have_no_noise(make_scene):
    """Level ground is level to the last digits, and every beam returns."""
    scene, start = make_scene(size=40.0), Start(0.0, 0.0, 0.3)
    config = with_parts(CloudsConfig, "vlp-16").model_copy(update={"standstill_share": 1.0})
    noisy, exact = (
        labelled_cloud(
            scene, config.model_copy(update={"exact_share": share}), np.random.default_rng(1), start
        )
        for share in (0.0, 1.0)
    )
    assert np.abs(exact.points[:, 2]).max() < 1e-5
    assert np.abs(noisy.points[:, 2]).max() > 1e-3
    assert len(exact) >= len(noisy)


def test_cover_lies_on_the_slope_of_the_ground(make_scene):
    """On a slope towards the robot's left, grass is no higher than on level ground."""
    scene, start = make_scene(lambda x, y: 0.15 * y, size=40.0), Start(0.0, 0.0, 0.0)
    cover = {
        "varied_share": 1.0,
        "cover_share": 1.0,
        "grass": (0.1, 0.1),
        "point_shares": (1.0, 1.0),
    }
    config = with_parts(CloudsConfig, "vlp-16").model_copy(
        update={"standstill_share": 1.0, "exact_share": 1.0, "lidar_heights": (0.6, 0.6), **cover}
    )
    points = labelled_cloud(scene, config, np.random.default_rng(3), start).points
    near = np.hypot(points[:, 0], points[:, 1]) < 6
    over = points[near, 2] - 0.15 * points[near, 1]
    assert over.min() > -0.01
    assert 0.08 < over.max() < 0.115


def test_the_robots_limit_of_plants_decides_what_is_blocked():
    """The same stands are free to a robot that crosses plants of a metre."""
    config = SMALL.model_copy(update={"presets": ("meadow",)})
    tall = config.robot.model_copy(update={"max_traversable_vegetation": 1.0})
    shares = []
    for robot in (config.robot, tall):
        world = cloud_scene(config.model_copy(update={"robot": robot}), "meadow", 3).world
        shares.append((world.truth.reason == Reason.VEGETATION).mean())
    assert shares[0] > 2 * shares[1] > 0
