"""Plants of the vehicle as parameters of tests; those of an engine that is missing are skipped."""

import pytest

from andabata.machine.plants import has_bullet, has_mujoco

NO_BULLET = "pybullet is not installed (it is published for Python up to 3.11)"

needs_bullet = pytest.mark.skipif(not has_bullet(), reason=NO_BULLET)
needs_mujoco = pytest.mark.skipif(
    not has_mujoco(), reason="mujoco is not installed (extra `mujoco`)"
)

BULLET = pytest.param("bullet", marks=needs_bullet)
MUJOCO = pytest.param("mujoco", marks=needs_mujoco)

ALL_PLANTS = [BULLET, MUJOCO, "wheels", "kinematic"]


def module_needs_bullet():
    """Leave the whole module out, before it imports what needs pybullet."""
    if not has_bullet():
        pytest.skip(NO_BULLET, allow_module_level=True)
