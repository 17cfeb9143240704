"""Trace of a drive: rows twice a second, true motion beside the error of the estimate."""

from types import SimpleNamespace

import numpy as np
import pytest

from andabata.evaluation.drive_trace import TRACE_COLUMNS, DriveTrace
from andabata.localization.estimator_status import EstimatorStatus
from andabata.localization.localizer import Health
from andabata.machine.pose import Pose


def readings(stamp, x=1.0):
    """Return readings with a true state."""
    pose = Pose.from_euler(np.array([x, 2.0, 0.0]), 0.0, 0.0, 0.5)
    truth = SimpleNamespace(
        pose=pose, angular=np.array([0.0, 0.0, 0.25]), linear=np.array([0.3, 0.0, 0.0])
    )
    return SimpleNamespace(stamp=stamp, truth=truth)


def status(health=Health.OK, **unused):
    """Return a status with a longest half axis of 2 m and a heading to 0.1 rad."""
    covariance = np.diag([1.0, 4.0, 0.0, 0.0, 0.0, 0.01])
    return EstimatorStatus(health, (), covariance, {}, unused)


def test_one_step_in_five_is_kept_with_the_error_of_the_pose():
    """The estimate is 3 m east and 4 m north of the truth."""
    estimate = Pose.from_euler(np.array([4.0, 6.0, 0.0]), 0.0, 0.0, 0.2)
    trace = DriveTrace(SimpleNamespace(pose=estimate, status=status(Health.DISORIENTED)))
    for step in range(11):
        trace.add(readings(0.1 * step))
    data = trace.as_dict()
    assert data["columns"] == list(TRACE_COLUMNS)
    assert [row[0] for row in data["rows"]] == pytest.approx([0.0, 0.5, 1.0])
    assert data["rows"][0][1:] == pytest.approx([1.0, 2.0, 0.5, 0.25, 0.3, 5.0, 2.0, -0.3, 0.1, 2])


def test_every_reason_has_a_column_from_the_begin():
    """A reason that comes later is zero before."""
    localizer = SimpleNamespace(pose=readings(0.0).truth.pose, status=status())
    trace = DriveTrace(localizer)
    for step, unused in enumerate(
        ({}, {"gnss": {"late": 2}}, {"gnss": {"late": 3}, "imu": {"x": 1}})
    ):
        localizer.status = status(**unused)
        for k in range(5):
            trace.add(readings(0.5 * step + 0.1 * k))
    data = trace.as_dict()
    assert data["columns"][len(TRACE_COLUMNS) :] == ["unused gnss: late", "unused imu: x"]
    assert [row[len(TRACE_COLUMNS) :] for row in data["rows"]] == [[0, 0], [2, 0], [3, 1]]


def test_readings_without_truth_have_no_row():
    """A real robot knows no truth."""
    trace = DriveTrace(SimpleNamespace(pose=None))
    trace.add(SimpleNamespace(stamp=0.0, truth=None))
    assert trace.rows == []
