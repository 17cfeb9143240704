"""Options that commands share: single ones, and groups that are parsed once.

A group becomes options by ``andabata.app.command.command``, and turns what the user typed into
what the libraries take: a configuration, models, mountings, a console.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer

from terrain.compilation import on_first_compilation
from worlds.splits import EVALUATIONS, refuse_judging

if TYPE_CHECKING:
    from pydantic import BaseModel

    from andabata.app.console import Console
    from andabata.assembly.simulated_robot import SimulatedRobotConfig
    from andabata.engine import Engine
    from andabata.machine.reality import Reality

Config = TypeVar("Config", bound="BaseModel")

# Panels of the help, in which options that belong together stand together.
_SETTINGS = "Settings"
_RUN = "Seed and processes"
_OUTPUT = "Output"


def _seed(seed: int) -> int:
    """Return a seed that judges no release."""
    refuse_judging(seed)
    return seed


def _evaluation_seed(seed: int) -> int:
    """Return a seed that has evaluation worlds."""
    if _seed(seed) >= EVALUATIONS:
        raise typer.BadParameter(f"{seed} is not in the range 0<=x<={EVALUATIONS - 1}.")
    return seed


Seed = Annotated[
    int,
    typer.Option(min=0, callback=_seed, help="Seed of everything random.", rich_help_panel=_RUN),
]
EvaluationSeed = Annotated[
    int,
    typer.Option(
        min=0,
        callback=_evaluation_seed,
        help=f"Seed of everything random, and of the worlds, up to {EVALUATIONS - 1}.",
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
