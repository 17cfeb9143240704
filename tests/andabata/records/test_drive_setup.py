"""Setup of a recorded drive: as recorded, or estimated from the first readings."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.machine.pose import Pose
from andabata.records import topics
from andabata.records.bags import Bag, BagError
from andabata.records.drive_setup import DriveSetup, read_first_fixes, read_setup
from andabata.records.messages import NS, MessageBuilder
from andabata.records.recorder import SETUP
from tests.support import computed_bags

COMPOSE = MessageBuilder(1)
POSE = Pose.from_euler(np.array([1.0, 2.0, 0.3]), 0.5, 0.0, 0.0)


def initial(frame="map"):
    """Return a start pose in a frame, a second after the epoch."""
    content = COMPOSE.stamped_pose(1.0, POSE)
    content = replace(content, header=replace(content.header, frame_id=frame))
    return computed_bags.Row(
        "/initialpose", topics.INITIAL_POSE.kind, COMPOSE.stamp_ns(1.0), content
    )


def begin(text):
    """Return diagnostics with settings."""
    content = COMPOSE.diagnostics(1.0, 0, "begin", {SETUP: text})
    return computed_bags.Row(
        "/diagnostics", topics.DIAGNOSTICS.kind, COMPOSE.stamp_ns(1.0), content
    )


def setup_of(path, rows):
    """Return the setup of a bag with some rows."""
    with Bag(computed_bags.write(path / "x.bag", rows)) as bag:
        return read_setup(bag, {}, {})


@pytest.mark.parametrize("frame", ["map", "/map", "husky1/map"])
def test_a_recorded_start_is_kept(tmp_path, frame):
    """Pose, epoch and settings are those of the recording."""
    rows = [initial(frame), begin('{"controller": "straight", "geofence": [-1, -2, 3, 4]}')]
    found = setup_of(tmp_path, rows)
    np.testing.assert_allclose(found.start.position, POSE.position)
    np.testing.assert_allclose(found.start.quaternion, POSE.quaternion)
    assert found.epoch_ns == COMPOSE.stamp_ns(1.0)
    assert (found.is_rough, found.datum) == (False, None)
    assert found.geofence == (-1.0, -2.0, 3.0, 4.0)


def test_without_a_start_in_the_map_it_is_estimated(tmp_path):
    """A pose in odom is no start: compass, gravity and the first fixes give it."""
    found = setup_of(tmp_path, [initial("odom"), *computed_bags.drive(5.0)])
    assert found.is_rough
    assert found.settings == {}
    assert found.datum is not None
    assert found.start.yaw == pytest.approx(0.0, abs=0.5)
    assert found.geofence is None


def test_a_start_without_settings_gets_a_datum(tmp_path):
    """The recorded pose is kept beside a datum from the fixes."""
    found = setup_of(tmp_path, [initial(), *computed_bags.drive(5.0)])
    np.testing.assert_allclose(found.start.position, POSE.position)
    assert not found.is_rough
    assert found.datum is not None


def test_without_a_start_and_without_fixes_there_is_no_setup(tmp_path):
    """The error names the topics that would give one."""
    rows = [row for row in computed_bags.drive(3.0) if row.topic != "/fix"]
    with pytest.raises(BagError, match=r"expected /initialpose or /odometry.*, got neither; --map"):
        setup_of(tmp_path, rows)


def test_the_first_fixes_are_those_of_half_a_minute(tmp_path):
    """The half minute is counted from the first good fix, its end included."""
    fix = next(row for row in computed_bags.drive(1.0) if row.topic == "/fix")
    bad = replace(fix.content, latitude=np.nan)
    seconds = (1, 5, 34, 35, 36)
    rows = [
        replace(fix, stamp_ns=fix.stamp_ns + k * NS, content=bad if k == 1 else fix.content)
        for k in seconds
    ]
    rows = [
        computed_bags.restamped(replace(row, stamp_ns=row.stamp_ns), row.stamp_ns) for row in rows
    ]
    with Bag(computed_bags.write(tmp_path / "x.bag", rows)) as bag:
        fixes, stamp_ns = read_first_fixes(bag, {})
    assert stamp_ns == rows[1].stamp_ns
    np.testing.assert_allclose(fixes[:, 0] - fixes[0, 0], [0, 4, 33, 34], atol=1e-6)
    with Bag(computed_bags.write(tmp_path / "y.bag", [initial()])) as bag:
        fixes, stamp_ns = read_first_fixes(bag, {})
    assert (fixes.shape, stamp_ns) == ((0, 5), 0)


@pytest.mark.parametrize("geofence", ["here", [0.0, 1.0], [None, 0.0, 1.0, 1.0], 3])
def test_a_geofence_that_is_no_rectangle_is_refused(geofence):
    """Four numbers are expected."""
    with pytest.raises(BagError, match="geofence: expected x_min, y_min, x_max, y_max"):
        _ = DriveSetup(POSE, 0, {"geofence": geofence}).geofence
