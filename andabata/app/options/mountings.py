"""Mountings of sensors from ``--mounting``, for scan, replay and ros."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from andabata.configuration.settings import resolve
from andabata.configuration.usage import UsageError, numbers
from andabata.machine.mounting import Mounting
from andabata.records.frames.names import SENSORS
from andabata.records.frames.sensor_pose import UNNAMED, GivenMounting
from andabata.records.frames.transform import yaw_pitch_roll

_TURN = 360.0
"""Full turn [deg]."""


def read_mountings(
    texts: Sequence[str], sensors: Sequence[str] = SENSORS
) -> dict[str, GivenMounting]:
    """Return the mountings of options of the form ``[SENSOR=]X,Y,[Z,]ROLL,PITCH,YAW``.

    Args:
        texts: Texts of the options, in metres and degrees.
        sensors: Names of the sensors that can be mounted here.

    Returns:
        Mountings by sensor, or by ``UNNAMED`` where none is named.

    Raises:
        UsageError: If a text is not a mounting, or a sensor is given twice.
        SettingsError: If a number is out of bounds.
    """
    mountings: dict[str, GivenMounting] = {}
    for text in texts:
        name, sign, value = text.rpartition("=")
        sensor = name.strip()
        if sign and sensor not in sensors:
            raise UsageError(
                f"--mounting: expected one of {', '.join(sensors)} before the sign, got {sensor!r}"
            )
        if sensor in mountings:
            raise UsageError(f"--mounting: expected {sensor or 'the laser'} once, got it twice")
        mountings[sensor] = _given(value)
    return mountings


def laser_mounting(given: Mapping[str, GivenMounting], height: float) -> Mounting:
    """Return the mounting of a laser: the given one, else level at a height [m].

    Raises:
        SettingsError: If the height is out of bounds.
    """
    mounting = given.get("laser", given.get(UNNAMED))
    if mounting is None:
        return resolve(Mounting, overrides=[f"z={height!r}"])
    yaw, pitch, roll = yaw_pitch_roll(mounting.rotation)
    z = height if mounting.z is None else mounting.z
    fields = {"x": mounting.x, "y": mounting.y, "z": z}
    fields |= {"roll": roll, "pitch": pitch, "yaw": yaw}
    return resolve(Mounting, overrides=[f"{name}={value!r}" for name, value in fields.items()])


def with_height(settings: Sequence[str] | None, height: float | None) -> list[str]:
    """Return ``--set`` options, behind that of ``--sensor-height`` [m] if it is given."""
    return [*([] if height is None else [f"robot.lidar_height={height!r}"]), *(settings or ())]


def mountings_in_words(frames: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the mountings of ``Extrinsics.as_dict`` as text, a line for each sensor."""
    lines = []
    for sensor, mount in frames.items():
        place = "moves"
        if mount["transform"] is not None:
            *xyz, roll, pitch, yaw = mount["transform"]
            angles = (math.degrees(angle) for angle in (roll, pitch, yaw))
            place = ",".join(f"{number + 0.0:.3g}" for number in (*xyz, *angles))
        lines.append(f"{sensor}: frame {mount['frame'] or '(none)'} at {place} ({mount['source']})")
    return "\n".join(lines)


def _given(text: str) -> GivenMounting:
    """Return the mounting of five or six numbers.

    Raises:
        UsageError: If they are not numbers, or an angle is beyond a full turn.
        SettingsError: If one is out of bounds.
    """
    count = text.count(",") + 1
    if count not in (5, 6):
        raise UsageError(
            "--mounting: expected five numbers X,Y,ROLL,PITCH,YAW, or six with Z after Y, got "
            f"{text!r}"
        )
    values = numbers(text, count, "--mounting")
    x, y, roll, pitch, yaw = (*values[:2], *values[-3:])
    z = values[2] if count == 6 else None
    fields = {"x": x, "y": y, "z": z or 0.0}
    angles = {"roll": roll, "pitch": pitch, "yaw": yaw}
    for name, angle in angles.items():
        if abs(angle) > _TURN:
            raise UsageError(f"--mounting: expected {name} within 360 degrees, got {angle:g}")
        angles[name] = math.remainder(angle, _TURN)
    fields |= {name: math.radians(angle) for name, angle in angles.items()}
    checked = resolve(Mounting, overrides=[f"{name}={value!r}" for name, value in fields.items()])
    return GivenMounting(x, y, z, checked.rotation)
