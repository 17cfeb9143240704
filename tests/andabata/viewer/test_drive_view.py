"""Text of the live view: health and cause, uncertainty beside the true error, unused readings."""

import numpy as np

from andabata.localization.estimator_status import EstimatorStatus
from andabata.localization.localizer import Health
from andabata.machine.pose import Pose
from andabata.report.drive_frames import DriveFrame
from andabata.viewer.drive_view import frame_text


def frame(is_true=True):
    """Return a frame of a robot that is 5 m and 2 degrees off and knows why."""
    origin = Pose.from_euler(np.zeros(3), 0.0, 0.0, 0.0)
    estimate = Pose.from_euler(np.array([3.0, 4.0, 0.0]), 0.0, 0.0, np.deg2rad(-2.0))
    status = EstimatorStatus(
        Health.DEGRADED,
        ("gnss: not accepted for 12.0 s, no valid reading arrives",),
        np.diag([0.25, 1.0, 9.0, 0.0, 0.0, np.deg2rad(3.0) ** 2]),
        {"compass": 100},
        {"compass": {"beyond the gate": 12}},
    )
    return DriveFrame(origin, stamp=7.3, estimate=estimate, status=status, is_true=is_true)


def test_health_cause_uncertainty_error_and_readings_have_a_line_each():
    """Two sigma stand over the true error, so that one sees whether it is inside."""
    assert frame_text(frame()).split("  \n") == [
        "**7.3 s**",
        "estimate **degraded**",
        "gnss: not accepted for 12.0 s, no valid reading arrives",
        "2 sigma: 2.00 m, 6.0 degrees",
        "estimate off by 5.00 m, 2.0 degrees",
        "not used: compass: 12 beyond the gate",
    ]


def test_without_a_truth_there_is_no_error_and_without_a_status_no_estimate():
    """A real robot and a path from a folder."""
    assert "off by" not in frame_text(frame(is_true=False))
    assert frame_text(DriveFrame(frame().pose, stamp=7.3)) == "**7.3 s**"
