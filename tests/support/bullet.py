"""pybullet on this Python: tests of the bullet plant are left out without it."""

import pytest

from andabata.machine.plants import has_bullet

NO_BULLET = "pybullet is not installed (it is published for Python up to 3.11)"

needs_bullet = pytest.mark.skipif(not has_bullet(), reason=NO_BULLET)

BULLET = pytest.param("bullet", marks=needs_bullet)
"""The plant among the parameters of a test."""


def module_needs_bullet():
    """Leave the whole module out, before it imports what needs pybullet."""
    if not has_bullet():
        pytest.skip(NO_BULLET, allow_module_level=True)
