"""Options that every verb shares."""

from pathlib import Path
from typing import Annotated

import typer

Seed = Annotated[int, typer.Option(min=0, help="Seed of everything random.")]
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
SquaresFile = Annotated[
    Path | None,
    typer.Option(
        "--squares", metavar="FILE", help="The local map's classifier instead of the shipped one."
    ),
]
PolicyFile = Annotated[
    Path | None, typer.Option("--policy", metavar="FILE", help="Policy instead of the shipped one.")
]

Datum = Annotated[
    str | None,
    typer.Option(
        metavar="LAT,LON[,ALT]",
        help="Origin of the map, in degrees and metres; without, the first good fix.",
    ),
]
