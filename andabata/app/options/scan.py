"""Groups of options of ``andabata scan``."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from andabata.app.options.sensors import CloudUnit, LaserMounting

if TYPE_CHECKING:
    from andabata.app.scan_files import CloudSource
    from andabata.records.frames.sensor_pose import GivenMounting
    from andabata.scanning.scan import ScanConfig

SensorHeight = Annotated[
    float, typer.Option(help="Height of the sensor above the base plane, in metres.")
]
OwnBody = Annotated[
    float, typer.Option(help="Leave out returns nearer than this to the sensor, in metres.")
]
SensorAt = Annotated[
    str | None,
    typer.Option(
        help="X,Y,Z of the sensor in the cloud's own coordinates, where they are a map's."
    ),
]
Level = Annotated[
    bool, typer.Option("--level", help="Make the ground around the robot the base plane.")
]
Columns = Annotated[
    int | None,
    typer.Option(help="Numbers of a point in bin files; by default read from the content."),
]
CloudOfTopic = Annotated[str | None, typer.Option(help="PointCloud2 topic of a recording.")]
CloudNumber = Annotated[
    int, typer.Option(help="Index of the cloud in the topic; negative from the end.")
]
Labels = Annotated[
    str | None,
    typer.Option(
        help="Meaning of the points' classes: semantickitti, rellis, goose or a TOML file."
    ),
]
Sectors = Annotated[int, typer.Option(help="Number of sectors of the virtual scan.")]
Vegetation = Annotated[
    float, typer.Option(help="Height up to which the robot drives over plants, in metres.")
]


@dataclass(frozen=True)
class ScanOptions:
    """Pose of the sensor, and what is made of its points.

    Options: ``--sensor-height``, ``--mounting``, ``--own-body``, ``--sensor-at``, ``--level``,
    ``--sectors``, ``--max-traversable-vegetation``.
    """

    sensor_height: SensorHeight = 0.72
    mounting: LaserMounting = None
    own_body: OwnBody = 0.0
    sensor_at: SensorAt = None
    level: Level = False
    sectors: Sectors = 32
    max_traversable_vegetation: Vegetation = 0.15

    def mountings(self) -> "dict[str, GivenMounting]":
        """Return the mounting of the laser by its name, or of a laser in a frame of its own.

        Raises:
            UsageError: If a text is not a mounting, or is of another sensor.
        """
        from andabata.app.options.mountings import read_mountings

        return read_mountings(self.mounting or (), ("laser",))

    def resolve(self) -> "ScanConfig":
        """Return the settings of a scan.

        Raises:
            UsageError: If a text is not a mounting or a position.
            SettingsError: If a number is out of bounds.
        """
        from andabata.app.options.mountings import laser_mounting
        from andabata.configuration.settings import resolve
        from andabata.configuration.usage import numbers
        from andabata.scanning.scan import ScanConfig

        place = self.sensor_at
        base = ScanConfig(
            mounting=laser_mounting(self.mountings(), self.sensor_height),
            sensor_at=None if place is None else numbers(place, 3, "--sensor-at"),
        )
        # As settings, so that one out of bounds is refused in the same words as one of a file.
        overrides = [
            f"own_body={self.own_body}",
            f"level={str(self.level).lower()}",
            f"n_sectors={self.sectors}",
            f"max_traversable_vegetation={self.max_traversable_vegetation}",
        ]
        return resolve(ScanConfig, None, overrides, base)


@dataclass(frozen=True)
class CloudOptions:
    """Where and how clouds are read.

    Options: ``--columns``, ``--unit``, ``--topic``, ``--number``, ``--labels``.
    """

    columns: Columns = None
    unit: CloudUnit = None
    topic: CloudOfTopic = None
    number: CloudNumber = 0
    labels: Labels = None

    def source(self, mountings: "Mapping[str, GivenMounting]") -> "CloudSource":
        """Return the options of reading a cloud.

        Args:
            mountings: Mountings by sensor that the user gives.

        Raises:
            ClassTableError: If there is no such table of classes.
        """
        from andabata.app.scan_files import CloudSource
        from traversability.class_table import load_class_table

        table = None if self.labels is None else load_class_table(self.labels)
        return CloudSource(self.topic, self.number, self.columns, mountings, self.unit, table)
