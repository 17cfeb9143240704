"""Units and axes of a cloud that would put the ground where the sensor's mounting says.

Each explanation is tried on the points before it is advised, so that the step leads there.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from andabata.records.frames.transform import yaw_pitch_roll
from andabata.scanning.scan import ScanConfig, Scanned
from traversability.levelling import ground_plane, tilt_of

MAX_HEIGHT = 0.2
"""Distance of the ground from the base plane that agrees with a mounting [m]."""

MAX_TILT = np.deg2rad(12.0)
"""Tilt of the ground above which the cloud is probably not level [rad]."""

_UNITS = {0.001: "millimetres", 0.01: "centimetres", 0.0254: "inches", 1000.0: "kilometres"}
"""Names of units by their length [m]: no sensor is mounted as high as they would look in metres."""

_FOOT = 0.3048
"""Length of a foot [m]: as metres, a sensor's height in feet is that of a truck's sensor."""

_Angles = tuple[float, float, float]

_TURNS: Sequence[tuple[str, Sequence[tuple[str, _Angles]]]] = (
    ("is the sensor mounted upside down?", (("", (180.0, 0.0, 0.0)),)),
    (
        "does its y axis point down?",
        (
            (" where z is forward, as a camera's", (-90.0, 0.0, -90.0)),
            (" where x is", (-90.0, 0.0, 0.0)),
        ),
    ),
    (
        "does its y axis point up?",
        (
            (" where z is backward, as a screen's", (90.0, 0.0, -90.0)),
            (" where x is forward", (90.0, 0.0, 0.0)),
        ),
    ),
)
"""Orientations of a sensor that its cloud shows: roll, pitch and yaw [deg], where several fit by
the ground with what distinguishes them."""


class CloudOrigin(NamedTuple):
    """What happened to a cloud before it was scanned.

    Attributes:
        is_metric: True if the coordinates were taken as metres, and not by the user's word.
        rotation: Rotation that was undone because the frame's name implies it.
        across: Length of the unit of the file's x and y [m].
        up: Length of the unit of the file's z [m].
        has_viewpoint: True if the file's ``VIEWPOINT`` was taken as the sensor.
    """

    is_metric: bool = True
    rotation: Rotation | None = None
    across: float = 1.0
    up: float = 1.0
    has_viewpoint: bool = False


def explain(scanned: Scanned, config: ScanConfig, origin: CloudOrigin) -> str | None:
    """Return the unit or the axes in which the ground is right, with the option; None without.

    Args:
        scanned: Scan whose ground is not where the mounting says.
        config: Settings of the scan.
        origin: History of the cloud before the scan.
    """
    if scanned.sensor is None or config.level:
        return None
    points = _unplaced(scanned, config)
    mounting = config.mounting
    for unit, name in _UNITS.items() if origin.is_metric else ():
        if is_level_ground(mounting.place(points * np.float32(unit))):
            return f"the coordinates look like {name}, not metres: give --unit {unit:g}"
    if mounting.rotation.magnitude() > 0:
        return None
    for question, turns in _TURNS:
        first = _turn(turns[0][1])
        if is_level_ground(first.apply(points).astype(np.float32) + _position(config)):
            options = [f"{_mounting(_turn(each), config, origin)}{where}" for where, each in turns]
            return f"{question} (--mounting {', --mounting '.join(options)})"
    return None


def _turn(angles: _Angles) -> Rotation:
    """Return the rotation of roll, pitch and yaw [deg]."""
    return Rotation.from_euler("xyz", angles, degrees=True)


def could_be_feet(scanned: Scanned, config: ScanConfig, origin: CloudOrigin) -> bool:
    """Return True if the ground is where the mounting says when the coordinates are feet."""
    if scanned.sensor is None or not origin.is_metric:
        return False
    return is_level_ground(config.mounting.place(_unplaced(scanned, config) * np.float32(_FOOT)))


def is_level_ground(points: NDArray[np.float32]) -> bool:
    """Return True if there is ground around the robot, level and in the base plane."""
    plane = ground_plane(points)
    if plane is None:
        return False
    return tilt_of(plane[0]) <= MAX_TILT and abs(plane[1]) <= MAX_HEIGHT


def _position(config: ScanConfig) -> NDArray[np.float32]:
    """Return the position of the sensor on the robot [m], shape (3,)."""
    return np.array([config.mounting.x, config.mounting.y, config.mounting.z], dtype=np.float32)


def _unplaced(scanned: Scanned, config: ScanConfig) -> NDArray[np.float32]:
    """Return the points of a scan in the sensor's frame, shape (n, 3)."""
    rotation = config.mounting.rotation.as_matrix().astype(np.float32)
    return (scanned.cloud.points - _position(config)) @ rotation


def _mounting(turn: Rotation, config: ScanConfig, origin: CloudOrigin) -> str:
    """Return the value of ``--mounting`` that turns the cloud's own axes."""
    whole = turn if origin.rotation is None else turn * origin.rotation
    yaw, pitch, roll = yaw_pitch_roll(whole)
    angles = (np.rad2deg(angle) for angle in (roll, pitch, yaw))
    numbers = (config.mounting.x, config.mounting.y, *angles)
    return ",".join(f"{round(float(number), 2) + 0.0:g}" for number in numbers)
