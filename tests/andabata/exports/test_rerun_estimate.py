"""What a robot believed, as rerun is given it: places, numbers, words."""

from types import SimpleNamespace

import numpy as np
import pytest

from andabata.exports.rerun_estimate import ESTIMATE, EstimateLog, estimate_strips
from andabata.records.messages import MessageBuilder
from tests.support.situations import pose_at

BUILDER = MessageBuilder(2)
COVARIANCE = np.diag([0.25, 4.0, 1.0, 0.0, 0.0, 0.01])


@pytest.fixture
def logged():
    """Return what is logged, and the logger; archetypes are their arguments."""
    entries = []
    sdk = SimpleNamespace(
        LineStrips3D=lambda strips, **about: strips,
        Scalars=lambda value: value,
        TextLog=lambda text, level: (text, level),
    )
    return entries, EstimateLog(sdk, lambda entity, what: entries.append((entity, what)))


def test_two_sigma_and_the_true_error_have_one_time(logged):
    """A truth of another time is no truth of this estimate."""
    entries, log = logged
    log.add_truth(BUILDER.odometry(0.9, pose_at(0.0, 0.0)))
    log.add_odometry(BUILDER.odometry(1.0, pose_at(3.0, 4.0), COVARIANCE))
    assert [entity for entity, _ in entries] == [ESTIMATE, "plots/position_error/two_sigma"]
    assert entries[1][1] == pytest.approx(4.0)
    log.add_truth(BUILDER.odometry(1.0, pose_at(0.0, 0.0)))
    log.add_odometry(BUILDER.odometry(1.0, pose_at(3.0, 4.0), COVARIANCE))
    assert entries[-1] == ("plots/position_error/true", pytest.approx(5.0))


def test_a_recording_without_covariance_has_no_ellipse(logged):
    """Zeros stand for an unknown one."""
    entries, log = logged
    log.add_odometry(BUILDER.odometry(1.0, pose_at(3.0, 4.0)))
    assert entries == []


def test_health_is_text_and_unused_readings_are_numbers(logged):
    """Sensor and reason make the name of the plot."""
    entries, log = logged
    values = {"health": "degraded", "not used: compass, beyond the gate": "12"}
    log.add_diagnostics(BUILDER.diagnostics(1.0, 1, "degraded; compass", values))
    assert entries == [
        ("health", ("degraded; compass", "WARN")),
        ("plots/unused/compass/beyond_the_gate", 12.0),
    ]


def test_ellipse_and_sector_lie_around_the_estimate():
    """Both are closed, a little over the foot, two sigma wide."""
    rim, sector = estimate_strips(np.array([10.0, 20.0, 1.0]), np.pi / 2, COVARIANCE)
    for strip in (rim, sector):
        np.testing.assert_array_equal(strip[0], strip[-1])
        np.testing.assert_allclose(strip[:, 2], 1.1)
    assert np.abs(rim[:, :2] - [10.0, 20.0]).max(axis=0) == pytest.approx([1.0, 4.0], abs=1e-6)
    aside, ahead, _ = sector[1] - [10.0, 20.0, 0.0]
    assert np.arctan2(aside, ahead) == pytest.approx(0.2)
