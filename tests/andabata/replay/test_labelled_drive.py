"""Labels of a recorded drive by the navigator's own poses."""

import numpy as np

from andabata.datasets.drive_path import DriveLabelsConfig
from andabata.replay.labelled_drive import label_drive
from andabata.replay.options import ReplayOptions
from tests.support import computed_bags
from tests.support.computed_bags import EPOCH, Row, new, write
from traversability.grid import PolarGrid

CONFIG = DriveLabelsConfig()


def with_commands(rows, speed, still_from=None):
    """Return a recording with commands of a speed, whose wheels stand from a time on [s]."""
    stamps = sorted({row.stamp_ns for row in rows if row.topic == "/imu"})[::10]
    linear = new("geometry_msgs/msg/Vector3", x=speed, y=0.0, z=0.0)
    angular = new("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=0.0)
    kind = "geometry_msgs/msg/Twist"
    twist = new(kind, linear=linear, angular=angular)
    found = [*rows, *(Row("/cmd_vel", kind, stamp, twist) for stamp in stamps)]
    for row in found:
        late = still_from is not None and row.stamp_ns > EPOCH + still_from * 10**9
        if row.topic == "/encoder_data" and late:
            row.content.left = row.content.right = 0.0
    return sorted(found, key=lambda row: row.stamp_ns)


def labels(path):
    """Return the labelled cells of a recording."""
    return label_drive(path, ReplayOptions(), PolarGrid(), CONFIG)


def test_the_way_of_a_recording_labels_its_clouds(tmp_path):
    """A drive of ten seconds labels crossed cells of its clouds as free, and none as blocked."""
    found, result = labels(write(tmp_path / "a.bag", computed_bags.drive(10.0)))
    assert 5 <= found.clouds <= 10
    assert len(found.cells.blocked) > 50
    assert not found.cells.blocked.any()
    assert (np.diff(found.stamps) >= CONFIG.interval - 0.01).all()
    assert result["health"] == {"ok": result["periods"]}


def test_a_recorded_command_that_still_wheels_ignore_is_a_stop(tmp_path):
    """Commands of /cmd_vel over still wheels block the ground ahead; over turning ones nothing."""
    good = labels(write(tmp_path / "good.bag", with_commands(computed_bags.drive(10.0), 0.3)))[0]
    assert not good.cells.blocked.any()
    rows = with_commands(computed_bags.drive(10.0), 0.3, still_from=6.0)
    stuck = labels(write(tmp_path / "stuck.bag", rows))[0]
    assert stuck.troubles == {"stopped": 1, "slipped": 0, "tilted": 0}
    assert stuck.cells.blocked.any()
