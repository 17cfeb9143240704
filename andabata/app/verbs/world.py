"""``andabata world``: the worlds to drive in."""

from pathlib import Path
from typing import Annotated

import typer

from andabata.app.command import command
from andabata.app.options.elevation_import import ElevationOptions
from andabata.app.options.shared import ConsoleOptions, Seed
from andabata.app.options.world_import import ImportOptions

app = typer.Typer(help="The worlds: list, show, render, import.", no_args_is_help=True)

Name = Annotated[
    str, typer.Argument(help="Preset, one of those that `world list` shows, or a world's file.")
]
Difficulty = Annotated[
    float | None, typer.Option(min=0, max=1, help="From 0 to 1; the preset's own by default.")
]


@app.command("list")
@command
def list_presets(output: ConsoleOptions) -> None:
    """List the presets.

    Examples:
        andabata world list
        andabata world list --json
    """
    from andabata.app.console import table_of
    from worlds.catalogue import presets

    rows = [
        {"name": name, "kind": config.kind, "about": config.about}
        for name, config in presets().items()
    ]
    output.console().result({"worlds": rows}, table_of(rows))


@app.command()
@command
def show(
    *, name: Name, difficulty: Difficulty = None, seed: Seed = 0, output: ConsoleOptions
) -> None:
    """Make a world and describe its contents.

    Examples:
        andabata world show hill
        andabata world show maze --seed 2 --json
        andabata world show natural --difficulty 0.3
    """
    from andabata.app.world_summary import world_summary, world_text
    from worlds.catalogue import make_world

    data = world_summary(make_world(name, seed, difficulty))
    output.console().result(data, world_text(data))


@app.command()
@command
def render(
    *,
    name: Name,
    out: Annotated[Path, typer.Option(help="PNG file.")] = Path("world.png"),
    difficulty: Difficulty = None,
    seed: Seed = 0,
    output: ConsoleOptions,
) -> None:
    """Draw a world from above and in 3D, with its tasks.

    Examples:
        andabata world render hill
        andabata world render natural --seed 7 --out natural_7.png
    """
    from andabata.report.plots.axes import png
    from andabata.report.plots.drives import world_figure
    from andabata.runs import atomic_io
    from worlds.catalogue import make_world

    world = make_world(name, seed, difficulty)
    atomic_io.write(out, png(world_figure(world)))
    output.console().result({"picture": str(out)}, f"picture: {out}")


@app.command("import")
@command
def import_(
    *,
    file: Annotated[
        Path,
        typer.Argument(
            help="World of Gazebo: .sdf or .world, plain or .gz; or elevation model: GeoTIFF, .tif "
            "(extra `gis`)."
        ),
    ],
    options: ImportOptions,
    elevation: ElevationOptions,
    output: ConsoleOptions,
) -> None:
    """Turn a world of Gazebo (SDF 1.4 to 1.9) into a room or a world, or real terrain into a world.

    Of a world of Gazebo, what is seen but does not collide is not taken. What cannot be taken is
    listed as a warning. A square of an elevation model becomes the ground under the plants of a
    preset and under objects of your own; every cell of it has to have a height.

    Examples:
        andabata world import depot.world --json
        andabata world import depot.sdf --models models --slab 0.1,0.4
        andabata world import course.sdf --form world --out course.safetensors
        andabata world import dem.tif --at 46.0538,9.0001 --preset natural-rough
        andabata world import dem.tif --size 60 --objects trees.geojson
    """
    from andabata.app.elevation_import import (
        elevation_text,
        import_elevation,
        is_elevation_model,
    )
    from andabata.app.world_import import import_text, import_world

    if is_elevation_model(file):
        data = import_elevation(elevation.request(file, options))
        output.console().result(data, elevation_text(data))
        return
    elevation.refuse(file)
    data = import_world(options.request(file))
    output.console().result(data, import_text(data))
