"""Plants of the vehicle as parameters of tests; that of an engine that is missing is skipped."""

from importlib.util import find_spec

import pytest

needs_mujoco = pytest.mark.skipif(
    find_spec("mujoco") is None, reason="mujoco is not installed (extra `mujoco`)"
)

MUJOCO = pytest.param("mujoco", marks=needs_mujoco)

ALL_PLANTS = ["bullet", MUJOCO, "wheels", "kinematic"]
