"""Options that every verb shares."""

from pathlib import Path
from typing import Annotated

import typer

from worlds.splits import EVALUATIONS

Seed = Annotated[int, typer.Option(min=0, help="Seed of everything random.")]
EvaluationSeed = Annotated[
    int,
    typer.Option(min=0, max=EVALUATIONS - 1, help="Seed of everything random, and of the worlds."),
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Quiet = Annotated[bool, typer.Option("--quiet", help="Say nothing but the result.")]
ConfigFile = Annotated[
    Path | None, typer.Option("--config", metavar="FILE", help="TOML file with settings.")
]
Set = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="A.B=C", help="Override one setting; may be repeated."),
]
Workers = Annotated[
    int, typer.Option(min=1, max=256, help="Processes; the result does not depend on them.")
]
Sensor = Annotated[
    str,
    typer.Option(
        help="Laser: utm-30lx (the paper's, turning), os1-64, os0-128, vlp-16, livox-rosette."
    ),
]
Robot = Annotated[str, typer.Option(help="Body: andabata (the paper's), husky or jackal.")]
ForestFile = Annotated[
    Path | None,
    typer.Option("--forest", metavar="FILE", help="Cell classifier instead of the shipped one."),
]
GroundClassifierFile = Annotated[
    Path | None,
    typer.Option(
        "--ground-classifier",
        metavar="FILE",
        help="The local map's classifier instead of the shipped one.",
    ),
]
PolicyFile = Annotated[
    Path | None, typer.Option("--policy", metavar="FILE", help="Policy instead of the shipped one.")
]
LaserMounting = Annotated[
    list[str] | None,
    typer.Option(
        metavar="[laser=]X,Y,[Z,]ROLL,PITCH,YAW",
        help="Where the laser sits, in metres and degrees: of one in a frame of its own, which "
        "/tf_static or the frame's name tells otherwise; `laser=` overrides any frame.",
    ),
]
Mountings = Annotated[
    list[str] | None,
    typer.Option(
        "--mounting",
        metavar="[SENSE=]X,Y,[Z,]ROLL,PITCH,YAW",
        help="Where a sense (laser, imu, compass, gnss) sits, in metres and degrees; may be "
        "repeated. Without SENSE: a laser in a frame of its own, as in `scan`. Else /tf_static "
        "tells, then the frame's name (base_link and base_footprint are on the ground).",
    ),
]
SensorHeight = Annotated[
    float | None,
    typer.Option(min=0.0, max=10.0, help="Laser above the ground, in metres: robot.lidar_height."),
]

Datum = Annotated[
    str | None,
    typer.Option(
        metavar="LAT,LON[,ALT]",
        help="Origin of the map, in degrees and metres; without, the first good fix.",
    ),
]
