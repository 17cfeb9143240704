"""Health of a localizer."""

import pytest

from andabata.localization.localizer import Health, health_after


@pytest.mark.parametrize("health", list(Health))
def test_a_failed_check_leaves_no_health_ok(health):
    """Ok becomes degraded; a lost robot stays lost."""
    assert health_after(health, has_failures=False) is health
    expected = Health.DEGRADED if health is Health.OK else health
    assert health_after(health, has_failures=True) is expected
