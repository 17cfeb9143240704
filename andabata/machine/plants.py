"""Names of the plants, and which can be driven here: two of them need a package."""

import platform
import sys
from importlib.util import find_spec
from typing import Literal, get_args

from andabata.distribution import install_extra

Plant = Literal["bullet", "mujoco", "wheels", "kinematic"]
"""Names of the plants."""

_NEWEST = (3, 11)
"""Newest Python that pybullet is published for."""


class PlantError(ValueError):
    """A plant whose package is not installed."""


def has_bullet() -> bool:
    """Return True if pybullet is installed."""
    return find_spec("pybullet") is not None


def has_mujoco() -> bool:
    """Return True if the extra ``mujoco`` is installed."""
    return find_spec("mujoco") is not None


def available_plants() -> tuple[Plant, ...]:
    """Return the plants that can be driven here."""
    here = {"bullet": has_bullet(), "mujoco": has_mujoco()}
    return tuple(name for name in get_args(Plant) if here.get(name, True))


def default_plant() -> Plant:
    """Return the plant of a robot for which none is chosen: ``wheels`` where bullet is missing."""
    return "bullet" if has_bullet() else "wheels"


def check_plant(plant: Plant) -> None:
    """Check that a plant can be driven here.

    Raises:
        PlantError: If the package of its engine is not installed.
    """
    packages = {"bullet": ("pybullet", bullet_step), "mujoco": ("mujoco", _mujoco_step)}
    if plant in packages and plant not in available_plants():
        package, step = packages[plant]
        raise PlantError(
            f"plant: expected {' or '.join(available_plants())}, since {package} is not installed, "
            f"got {plant}; leave the plant out (it is {default_plant()} here), or {step()}"
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


def _mujoco_step() -> str:
    """Return what brings mujoco."""
    return f"`{install_extra('mujoco')}`"


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
