"""Catalogue of lasers: beam patterns by name, as data files."""

import tomllib
from functools import cache
from importlib.resources import files
from typing import Any


class UnknownSensorError(ValueError):
    """Name that is not in the catalogue of lasers."""


@cache
def sensor_names() -> tuple[str, ...]:
    """Return the names of the known lasers, sorted."""
    folder = files("andabata.machine").joinpath("lidars")
    names = (entry.name for entry in folder.iterdir())
    return tuple(sorted(name.removesuffix(".toml") for name in names if name.endswith(".toml")))


def sensor_settings(name: str) -> dict[str, Any]:
    """Return the settings ``sensing.lidar`` and ``assembly`` of a laser, for any configuration.

    Args:
        name: Name as in ``sensor_names``.

    Raises:
        UnknownSensorError: If the catalogue has no laser of that name.
    """
    if name not in sensor_names():
        known = ", ".join(sensor_names())
        raise UnknownSensorError(f"--sensor: expected one of {known}, got {name!r}")
    text = files("andabata.machine").joinpath("lidars", f"{name}.toml").read_text()
    data = tomllib.loads(text)
    return {"sensing": {"lidar": data["lidar"]}, "assembly": data["assembly"]}
