"""Options of recorded or real sensors: topics, mountings, units, stamps, datum."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from andabata.app.options.shared import SettingsOptions

if TYPE_CHECKING:
    from andabata.assembly.simulated_robot import SimulatedRobotConfig
    from andabata.records.frames.sensor_pose import GivenMounting

_SENSORS = "Recorded or real robot"
"""Panel of the help."""

LaserMounting = Annotated[
    list[str] | None,
    typer.Option(
        metavar="[laser=]X,Y,[Z,]ROLL,PITCH,YAW",
        help="Pose of the laser on the robot, in metres and degrees, for a laser in a frame of its "
        "own; else /tf_static or the frame's name gives it. `laser=` overrides any frame.",
    ),
]
CloudUnit = Annotated[
    float | None,
    typer.Option(
        "--unit",
        min=1e-6,
        max=1e6,
        help="Length of the unit of the cloud's coordinates, in metres, such as 0.001; by default "
        "what the file says, else 1.",
    ),
]
CloudTopic = Annotated[
    str | None,
    typer.Option(
        "--cloud",
        help="Topic of a 3D laser (PointCloud2) instead of the turning laser's two.",
        rich_help_panel=_SENSORS,
    ),
]
Mountings = Annotated[
    list[str] | None,
    typer.Option(
        "--mounting",
        metavar="[SENSOR=]X,Y,[Z,]ROLL,PITCH,YAW",
        help="Pose of a sensor (laser, imu, compass, gnss) on the robot, in metres and degrees; "
        "may be repeated. Without SENSOR: a laser in a frame of its own, as in `scan`. Else "
        "/tf_static gives it, then the frame's name (base_link and base_footprint are on the "
        "ground).",
        rich_help_panel=_SENSORS,
    ),
]
SensorHeight = Annotated[
    float | None,
    typer.Option(
        min=0.0,
        max=10.0,
        help="Height of the laser above the ground, in metres: robot.lidar_height.",
        rich_help_panel=_SENSORS,
    ),
]
Datum = Annotated[
    str | None,
    typer.Option(
        metavar="LAT,LON[,ALT]",
        help="Origin of the map, in degrees and metres; by default the first good fix.",
        rich_help_panel=_SENSORS,
    ),
]
RenamedTopics = Annotated[
    list[str] | None,
    typer.Option(
        "--map",
        metavar="OURS=THEIRS",
        help="Name of a topic in this recording, as /fix=/navsat/fix; may be repeated. "
        "/encoder_data may be a JointState, an Odometry or a TwistStamped.",
        rich_help_panel=_SENSORS,
    ),
]
Sources = Annotated[
    list[str] | None,
    typer.Option(
        "--source",
        metavar="TOPIC=NAME",
        help="Only source to read where several publish on one topic, by the frame of its "
        "messages or by its node, as /imu=imu_link; may be repeated.",
        rich_help_panel=_SENSORS,
    ),
]
Units = Annotated[
    list[str] | None,
    typer.Option(
        "--unit",
        metavar="QUANTITY=UNIT",
        help="Unit of acceleration (m/s2, g, mg), angular_velocity (rad/s, deg/s), "
        "magnetic_field (T, mT, uT, nT, G, mG) or wheels (rad/s, m/s, rpm, deg/s), or a factor "
        "to SI, where the values leave it open; a minus sign turns readings round; may be "
        "repeated.",
        rich_help_panel=_SENSORS,
    ),
]
TimeOffsets = Annotated[
    list[str] | None,
    typer.Option(
        "--time-offset",
        metavar="TOPIC=SECONDS",
        help="Time that is added to the stamps of /imu, /encoder_data, /mag_orientation or /fix, "
        "in seconds, as /imu=-0.09 for stamps that are late; may be repeated.",
        rich_help_panel=_SENSORS,
    ),
]


@dataclass(frozen=True)
class SensorOptions(SettingsOptions):
    """Sensors of a recorded or real robot, and its settings.

    Options: ``--cloud``, ``--source``, ``--mounting``, ``--sensor-height``, ``--datum``,
    ``--config``, ``--set``.
    """

    cloud: CloudTopic = None
    source: Sources = None
    mounting: Mountings = None
    sensor_height: SensorHeight = None
    datum: Datum = None

    def sources(self) -> dict[str, str]:
        """Return the only source that is read of a topic, by our names of topics.

        Raises:
            UsageError: If a text is not of the form ``a=b``.
        """
        from andabata.configuration.usage import pairs

        return pairs(self.source or (), "--source")

    def mountings(self) -> "dict[str, GivenMounting]":
        """Return the mountings by sensor.

        Raises:
            UsageError: If a text is not a mounting, or a sensor is given twice.
        """
        from andabata.app.options.mountings import read_mountings

        return read_mountings(self.mounting or ())

    def configure(self, base: "SimulatedRobotConfig") -> "SimulatedRobotConfig":
        """Return a robot's configuration with all that the user gives over a base.

        Raises:
            UsageError: If the datum is not one.
            SettingsError: If a field is unknown or out of bounds.
        """
        from andabata.app.options.datum import datum_overrides
        from andabata.app.options.mountings import with_height
        from andabata.assembly.simulated_robot import SimulatedRobotConfig
        from andabata.configuration.settings import resolve

        overrides = with_height(self.settings, self.sensor_height)
        overrides += datum_overrides(self.datum)
        return resolve(SimulatedRobotConfig, self.config, overrides, base)


@dataclass(frozen=True)
class TopicOptions:
    """Names, units and stamps of a foreign recording: ``--map``, ``--unit``, ``--time-offset``."""

    renamed: RenamedTopics = None
    unit: Units = None
    time_offset: TimeOffsets = None

    def names(self) -> dict[str, str]:
        """Return the recording's names of topics by ours.

        Raises:
            UsageError: If a text is not of the form ``a=b``.
        """
        from andabata.configuration.usage import pairs

        return pairs(self.renamed or (), "--map")

    def units(self) -> dict[str, str]:
        """Return the units by quantity.

        Raises:
            UsageError: If there is no such quantity or unit.
        """
        from andabata.configuration.usage import units

        return units(self.unit or ())

    def time_offsets(self) -> dict[str, float]:
        """Return the times that are added to the stamps of topics, by our names [s].

        Raises:
            UsageError: If there is no such topic, or a time is not a number of seconds below 1.
        """
        from andabata.configuration.usage import time_offsets

        return time_offsets(self.time_offset or ())
