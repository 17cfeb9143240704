"""``andabata world``: the worlds to drive in."""

from pathlib import Path
from typing import Annotated

import typer

from andabata.app.command import command
from andabata.app.options import ConsoleOptions, Seed

app = typer.Typer(help="The worlds: list, show, render.", no_args_is_help=True)

Name = Annotated[str, typer.Argument(help="Preset, one of those that `world list` shows.")]
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
    from andabata.app.plots.drives import world_picture
    from andabata.records import atomic_io
    from worlds.catalogue import make_world

    world = make_world(name, seed, difficulty)
    atomic_io.write(out, world_picture(world))
    output.console().result({"picture": str(out)}, f"picture: {out}")
