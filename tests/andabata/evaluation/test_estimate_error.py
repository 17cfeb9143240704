"""Error of a robot's own estimate: last, root mean square and largest, and what it said."""

from types import SimpleNamespace

import numpy as np
import pytest

from andabata.evaluation.estimate_error import EstimateError
from andabata.localization.estimator_status import EstimatorStatus
from andabata.localization.localizer import Health
from andabata.machine.pose import Pose

TRUTH = Pose.from_euler(np.array([1.0, 2.0, 0.0]), 0.0, 0.0, 3.1)
READINGS = SimpleNamespace(truth=SimpleNamespace(pose=TRUTH))


def localizer(x, y, yaw, variances, health=Health.OK, causes=()):
    """Return a localizer whose estimate is off, with variances of x, y."""
    covariance = np.diag([*variances, 0.0, 0.0, 0.0, 0.01])
    pose = Pose.from_euler(TRUTH.position + np.array([x, y, 5.0]), 0.0, 0.0, TRUTH.yaw + yaw)
    unused = {"gnss": {"beyond the gate": 3}}
    return SimpleNamespace(
        pose=pose, status=EstimatorStatus(health, causes, covariance, {}, unused)
    )


def followed(*steps):
    """Return the result of steps, each a localizer."""
    error = EstimateError(steps[0])
    for step in steps:
        error._localizer = step
        error.add(READINGS)
    return error.as_dict()


def test_errors_are_horizontal_and_turn_the_short_way():
    """Height does not count; a heading beyond the back is 0.1 rad off, not nearly a turn."""
    found = followed(localizer(3.0, 4.0, -0.3, (1, 1)), localizer(0.0, 1.0, 0.1, (1, 1)))
    assert found["position_error_m"] == 1.0
    assert found["position_rms_m"] == pytest.approx(np.sqrt(13.0), abs=1e-3)
    assert found["position_max_m"] == 5.0
    assert found["heading_error_rad"] == pytest.approx(0.1)
    assert found["heading_rms_rad"] == pytest.approx(np.sqrt(0.05), abs=1e-4)


def test_the_share_inside_is_that_of_its_own_ellipse():
    """1.9 m are inside of two sigma along an axis of one metre, and not along one of half."""
    along, aside = localizer(1.9, 0.0, 0.0, (1, 0.25)), localizer(0.0, 1.9, 0.0, (1, 0.25))
    assert followed(along, along, along, aside)["inside_2_sigma"] == 0.75
    assert followed(localizer(0.0, 0.0, 0.0, (0, 0)))["inside_2_sigma"] == 1.0


def test_times_by_health_and_cause_have_no_numbers():
    """Two steps of a cause whose numbers differ are 0.2 s of one."""
    causes = [("gnss: not accepted for 7.0 s, x",), ("gnss: not accepted for 7.1 s, x",)]
    bad = [localizer(0, 0, 0, (1, 1), Health.DEGRADED, cause) for cause in causes]
    found = followed(localizer(0, 0, 0, (1, 1)), *bad)
    assert found["health_s"] == {"ok": 0.1, "degraded": 0.2}
    assert found["causes_s"] == {"gnss: not accepted": 0.2}
    assert found["unused"] == {"gnss": {"beyond the gate": 3}}


def test_without_a_truth_there_is_no_error():
    """A real robot."""
    error = EstimateError(localizer(0, 0, 0, (1, 1)))
    error.add(SimpleNamespace(truth=None))
    assert error.as_dict() is None
