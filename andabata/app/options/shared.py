"""Options that commands share: single ones, and groups that are parsed once.

A group becomes options by ``andabata.app.command.command``, and turns what the user typed into
what the libraries take: a configuration, models, mountings, a console.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer

from terrain.compilation import on_first_compilation
from worlds.splits import EVALUATIONS

if TYPE_CHECKING:
    from pydantic import BaseModel

    from andabata.app.console import Console
    from andabata.assembly.simulated_robot import SimulatedRobotConfig
    from andabata.engine import Engine
    from andabata.machine.reality import Reality
    from andabata.models import Models
    from andabata.records.frames.sensor_pose import GivenMounting
    from rl.policy import Policy as PolicyModel
    from traversability.forest import Forest

Config = TypeVar("Config", bound="BaseModel")

# Panels of the help, in which options that belong together stand together.
_SETTINGS = "Settings"
_SENSORS = "Recorded or real robot"
_MODELS = "Models"
_RUN = "Seed and processes"
_OUTPUT = "Output"

Seed = Annotated[int, typer.Option(min=0, help="Seed of everything random.", rich_help_panel=_RUN)]
EvaluationSeed = Annotated[
    int,
    typer.Option(
        min=0,
        max=EVALUATIONS - 1,
        help="Seed of everything random, and of the worlds.",
        rich_help_panel=_RUN,
    ),
]
Workers = Annotated[
    int,
    typer.Option(
        min=1,
        max=4096,
        help="Number of tasks at a time; the result does not depend on it.",
        rich_help_panel=_RUN,
    ),
]
EngineName = Annotated[
    str,
    typer.Option(
        "--engine",
        help="serial (this process), processes (of this machine) or ray (a cluster, extra `ray`).",
        rich_help_panel=_RUN,
    ),
]
Address = Annotated[
    str | None,
    typer.Option(
        metavar="HOST:PORT",
        help="Head of the Ray cluster that this machine is a node of, or auto for the one that "
        "runs here; without it Ray is started for this command.",
        rich_help_panel=_RUN,
    ),
]
Json = Annotated[
    bool,
    typer.Option("--json", help="Print one JSON object and nothing else.", rich_help_panel=_OUTPUT),
]
Quiet = Annotated[
    bool, typer.Option("--quiet", help="Print nothing but the result.", rich_help_panel=_OUTPUT)
]
ConfigFile = Annotated[
    Path | None,
    typer.Option(
        "--config", metavar="FILE", help="TOML file with settings.", rich_help_panel=_SETTINGS
    ),
]
Set = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="A.B=C",
        help="Override one setting; may be repeated.",
        rich_help_panel=_SETTINGS,
    ),
]
Sensor = Annotated[
    str,
    typer.Option(
        help="Laser: utm-30lx (the paper's, turning), os1-64, os0-128, vlp-16, livox-rosette.",
        rich_help_panel=_SETTINGS,
    ),
]
Robot = Annotated[
    str,
    typer.Option(help="Body: andabata (the paper's), husky or jackal.", rich_help_panel=_SETTINGS),
]
RealityLevel = Annotated[
    str,
    typer.Option(
        "--reality",
        metavar="LEVEL",
        help="ideal: the robot is what its navigator believes; field, harsh: senses, wheels and "
        "motors that differ from it as real ones do, drawn for each drive.",
        rich_help_panel=_SETTINGS,
    ),
]
ForestFile = Annotated[
    Path | None,
    typer.Option(
        "--forest",
        metavar="FILE",
        help="Cell classifier instead of the shipped one.",
        rich_help_panel=_MODELS,
    ),
]
GroundClassifierFile = Annotated[
    Path | None,
    typer.Option(
        "--ground-classifier",
        metavar="FILE",
        help="Ground classifier of the local map instead of the shipped one.",
        rich_help_panel=_MODELS,
    ),
]
PolicyFile = Annotated[
    Path | None,
    typer.Option(
        "--policy",
        metavar="FILE",
        help="Policy instead of the shipped one.",
        rich_help_panel=_MODELS,
    ),
]
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
class ConsoleOptions:
    """Form of the output: ``--json``, ``--quiet``."""

    as_json: Json = False
    quiet: Quiet = False

    def console(self) -> "Console":
        """Return the console that prints in this form; it says when kernels are compiled."""
        from andabata.app.console import COMPILES, Console

        console = Console(self.quiet, self.as_json)
        on_first_compilation(lambda: console.status(COMPILES))
        return console


@dataclass(frozen=True)
class EngineOptions:
    """Who does the work: ``--workers``, ``--engine``, ``--address``."""

    workers: Workers = 2
    engine: EngineName = "processes"
    address: Address = None

    def make(self, console: "Console") -> "Engine":
        """Return the engine, which ``with`` starts.

        Args:
            console: Console that shows what happens to workers.

        Raises:
            UsageError: If there is no such engine, or an address is given to another one than Ray.
        """
        from andabata.configuration.usage import UsageError, one_word
        from andabata.engine import SerialEngine
        from andabata.engine_processes import ProcessEngine
        from andabata.engine_ray import RayEngine

        kind = one_word(self.engine, ("serial", "processes", "ray"), "--engine")
        if kind == "ray":
            return RayEngine(self.workers, self.address, console.status)
        if self.address is not None:
            raise UsageError(f"--address: expected --engine ray beside it, got {kind}")
        return SerialEngine() if kind == "serial" else ProcessEngine(self.workers, console.status)


@dataclass(frozen=True)
class SettingsOptions:
    """Settings of a command: ``--config``, ``--set``."""

    config: ConfigFile = None
    settings: Set = None

    def resolve(self, kind: type[Config], base: Config | None = None) -> Config:
        """Return a configuration: the base, the file over it, and the overrides over both.

        Raises:
            SettingsError: If a field is unknown or out of bounds, or the file is not TOML.
        """
        from andabata.configuration.settings import resolve

        return resolve(kind, self.config, self.settings or (), base)


def reality_level(name: str) -> "Reality":
    """Return the level of reality of ``--reality``.

    Raises:
        UsageError: If there is no such level.
    """
    from andabata.configuration.usage import one_word
    from andabata.machine.reality import LEVELS

    return LEVELS[one_word(name, tuple(LEVELS), "--reality")]


@dataclass(frozen=True)
class RobotOptions:
    """Simulated robot: ``--sensor``, ``--robot``, ``--reality``."""

    sensor: Sensor = "utm-30lx"
    robot: Robot = "andabata"
    reality: RealityLevel = "ideal"

    def base(self) -> "SimulatedRobotConfig":
        """Return the default robot with this laser, body and reality.

        Raises:
            UnknownSensorError: If there is no such laser.
            UsageError: If there is no such level of reality.
            ValueError: If there is no such body.
        """
        from andabata.assembly.simulated_robot import SimulatedRobotConfig
        from andabata.configuration.settings import with_parts

        robot = with_parts(SimulatedRobotConfig, self.sensor, self.robot)
        return robot.model_copy(update={"reality": reality_level(self.reality)})


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


@dataclass(frozen=True)
class ForestOptions:
    """Cell classifier: ``--forest``."""

    forest: ForestFile = None

    def load(self) -> "Forest":
        """Return the classifier, the shipped one by default."""
        from andabata.models import shipped_forest
        from traversability.forest import Forest

        return Forest.load(self.forest) if self.forest else shipped_forest()


@dataclass(frozen=True)
class PolicyOptions:
    """Policy: ``--policy``."""

    policy: PolicyFile = None

    def load(self) -> "PolicyModel":
        """Return the policy, the shipped one by default."""
        from andabata.models import shipped_policy
        from rl.policy import load_policy

        return load_policy(self.policy) if self.policy else shipped_policy()


@dataclass(frozen=True)
class ClassifierOptions:
    """Classifiers: ``--forest``, ``--ground-classifier``."""

    forest: ForestFile = None
    ground_classifier: GroundClassifierFile = None

    def load(self) -> "Models":
        """Return the classifiers beside the shipped policy; the shipped ones by default."""
        from andabata.models import Models

        return Models.load(self.forest, self.ground_classifier)


@dataclass(frozen=True)
class ModelOptions:
    """All models: ``--forest``, ``--ground-classifier``, ``--policy``."""

    forest: ForestFile = None
    ground_classifier: GroundClassifierFile = None
    policy: PolicyFile = None

    def load(self) -> "Models":
        """Return the models, the shipped ones by default."""
        from andabata.models import Models

        return Models.load(self.forest, self.ground_classifier, self.policy)
