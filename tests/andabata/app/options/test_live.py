"""Options of ``ros navigator`` become a start and a goal."""

import pytest

from andabata.app.options.live import LiveDriveOptions
from andabata.configuration.usage import UsageError


def test_start_and_goal_are_numbers_or_awaited():
    """Without an option the graph has to give them."""
    options = LiveDriveOptions(start="1,2,90", goal="20,5")
    assert options.start_pose() == (1.0, 2.0, 90.0)
    assert options.first_goal() == (20.0, 5.0)
    assert LiveDriveOptions().start_pose() is LiveDriveOptions().first_goal() is None


def test_too_few_numbers_are_refused():
    """A pose takes three numbers, a goal two."""
    with pytest.raises(UsageError, match="--start"):
        LiveDriveOptions(start="1,2").start_pose()
    with pytest.raises(UsageError, match="--goal"):
        LiveDriveOptions(goal="1").first_goal()
