"""Names of the plants, and which of them can be driven here: bullet needs pybullet."""

import platform
import sys
from importlib.util import find_spec
from typing import Literal, get_args

Plant = Literal["bullet", "wheels", "kinematic"]
"""Names of the plants."""

_NEWEST = (3, 11)
"""Newest Python that pybullet is published for."""


class PlantError(ValueError):
    """A plant whose package is not installed."""


def has_bullet() -> bool:
    """Return True if pybullet is installed."""
    return find_spec("pybullet") is not None


def available_plants() -> tuple[Plant, ...]:
    """Return the plants that can be driven here."""
    return tuple(name for name in get_args(Plant) if name != "bullet" or has_bullet())


def default_plant() -> Plant:
    """Return the plant of a robot for which none is chosen: ``wheels`` where bullet is missing."""
    return available_plants()[0]


def check_plant(plant: Plant) -> None:
    """Check that a plant can be driven here.

    Raises:
        PlantError: If it is ``bullet`` and pybullet is not installed.
    """
    if plant == "bullet" and not has_bullet():
        raise PlantError(
            f"plant: expected {' or '.join(available_plants())}, since pybullet is not installed, "
            f"got bullet; leave the plant out (it is {default_plant()} here), or {bullet_step()}"
        )


def is_published(version: tuple[int, ...] = sys.version_info[:2]) -> bool:
    """Return True if pybullet is published for a Python, by its major and minor number."""
    return version <= _NEWEST


def bullet_step() -> str:
    """Return what brings bullet to this Python."""
    if is_published():
        return "`pip install pybullet`"
    newest = ".".join(str(number) for number in _NEWEST)
    return (
        f"install andabata with Python {newest}, the newest that pybullet is published for "
        f"(this is {platform.python_version()})"
    )


def default_remark(plant: Plant) -> str | None:
    """Return what there is to say about a robot's plant; None where bullet is installed.

    Args:
        plant: Plant of the robot.
    """
    if plant != default_plant() or has_bullet():
        return None
    return (
        f"plant {plant}, since pybullet is not installed; published figures are those of bullet: "
        f"{bullet_step()}"
    )
