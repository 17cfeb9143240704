"""Support points: they lie where the beams ended, and are as many as the features."""

import numpy as np
import pytest

from andabata.evaluation.support_points import drive_with_support_points
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.tasks.rooms.spn_config import SpnConfig
from rl.goal_laws import ProportionalPolicy
from tests.support.room_policies import point_policy
from worlds.rooms.catalogue import make_room

ROOM = make_room("spn-env2")


def task(label):
    lidar = PlanarLidarConfig.parse(label)
    return SpnConfig(rooms=(ROOM.name,), lidar=lidar, points=None)


@pytest.fixture(scope="module", params=["360|1|20", "180|2|20|0.05|0.02|30"])
def driven(request):
    """Return drives with a laser in the middle, and with one that is moved and turned."""
    return drive_with_support_points(point_policy(), task(request.param), ROOM.tasks[:2], every=5)


def test_there_is_a_moment_every_few_steps_from_the_start_on(driven):
    """Moments are those before steps 0, 5, 10 and so on, with the poses of the path."""
    for drive, moments in driven:
        assert [moment.step for moment in moments] == list(range(0, drive.detail.steps, 5))
        for moment in moments:
            np.testing.assert_array_equal(moment.pose, drive.path[moment.step])


def test_each_feature_has_its_point_on_an_obstacle(driven):
    """The counts add up to K, and what beams met is the edge of something."""
    moments = [moment for _, some in driven for moment in some]
    assert len(moments) > 4
    for moment in moments:
        assert moment.counts.sum() == 5
        assert moment.is_return.all()
        np.testing.assert_allclose(ROOM.clearance(moment.places), 0, atol=2e-3)


def test_beams_that_met_nothing_end_in_the_open():
    """With a short range the points of the first moment are at the laser's range, all of them."""
    ((drive, moments),) = drive_with_support_points(
        point_policy(), task("360|1|0.4|0.1"), ROOM.tasks[:1]
    )
    first = moments[0]
    assert not first.is_return.any()
    laser = drive.path[0, :2] + [0.1, 0]
    np.testing.assert_allclose(np.hypot(*(first.places - laser).T), 0.4, atol=1e-5)


def test_only_policies_on_points_have_some():
    """Another architecture is refused by name."""
    config = task("360|1|5")
    other = ProportionalPolicy({}, config.observations, config.actions)
    with pytest.raises(ValueError, match="expected one on points, got proportional"):
        drive_with_support_points(other, config, ROOM.tasks[:1])
