"""Options of the live view."""

from dataclasses import replace

import pytest

from andabata.app.options.view import DriveViewOptions, RobotViewOptions
from andabata.configuration.usage import UsageError


def test_a_drive_waits_only_for_a_page_that_there_is():
    """``--view-wait`` without ``--view`` is refused; with it, it is a choice of who watches."""
    assert DriveViewOptions().wanted() is None
    shown = DriveViewOptions(view=True).wanted()
    assert shown is not None
    assert not shown.waits
    waits = DriveViewOptions(view=True, view_wait=True).wanted()
    assert waits == replace(shown, waits=True)
    with pytest.raises(UsageError, match="--view-wait: expected --view beside it"):
        DriveViewOptions(view_wait=True).wanted()


def test_a_robot_is_commanded_only_where_it_is_allowed():
    """Watching is the default; ``--allow-commands`` without ``--view`` is refused."""
    assert RobotViewOptions().wanted() is None
    watched = RobotViewOptions(view=True).wanted()
    assert watched is not None
    assert not watched.allow_commands
    commanded = RobotViewOptions(view=True, allow_commands=True).wanted()
    assert commanded == replace(watched, allow_commands=True)
    with pytest.raises(UsageError, match="--allow-commands: expected --view beside it"):
        RobotViewOptions(allow_commands=True).wanted()
