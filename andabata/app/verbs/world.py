"""``andabata world``: the worlds to drive in."""

from pathlib import Path
from typing import Annotated

import typer

from andabata.app.options import Json, Quiet, Seed

app = typer.Typer(help="The worlds: list, show, render.", no_args_is_help=True)

Name = Annotated[str, typer.Argument(help="Preset, as `world list` shows it.")]
Difficulty = Annotated[
    float | None, typer.Option(min=0, max=1, help="From 0 to 1; the preset's own by default.")
]


@app.command("list")
def list_presets(as_json: Json = False) -> None:
    """List the presets."""
    from andabata.app.console import Console, table_of
    from worlds.catalogue import presets

    rows = [
        {"name": name, "kind": config.kind, "about": config.about}
        for name, config in presets().items()
    ]
    Console(as_json=as_json).result({"worlds": rows}, table_of(rows))


@app.command()
def show(name: Name, seed: Seed = 0, difficulty: Difficulty = None, as_json: Json = False) -> None:
    """Make a world and tell what is in it."""
    from collections import Counter

    import numpy as np

    from andabata.app.console import Console
    from worlds.catalogue import make_world
    from worlds.truth import Reason

    world = make_world(name, seed, difficulty)
    counts = Counter(thing.semantic.name.lower() for thing in world.objects)
    shares = {
        reason.name.lower(): float((world.truth.reason == reason).mean()) for reason in Reason
    }
    data = {
        "name": name,
        "seed": seed,
        "difficulty": world.difficulty,
        "width_m": world.ground.width,
        "depth_m": world.ground.depth,
        "relief_m": float(np.ptp(world.ground.heights)),
        "objects": dict(counts),
        "share_of_ground": shares,
        "tasks": len(world.tasks),
        "goals_per_task": len(world.tasks[0].goals),
    }
    text = [
        f"{name}, seed {seed}: {world.ground.width:.0f} x {world.ground.depth:.0f} m, "
        f"relief {data['relief_m']:.1f} m, difficulty {world.difficulty}",
        "objects: " + ", ".join(f"{count} {kind}" for kind, count in counts.most_common()),
        "ground: " + ", ".join(f"{share:.1%} {kind}" for kind, share in shares.items()),
        f"tasks: {len(world.tasks)} with {len(world.tasks[0].goals)} goals in a row",
    ]
    Console(as_json=as_json).result(data, "\n".join(text))


@app.command()
def render(
    name: Name,
    out: Annotated[Path, typer.Option(help="PNG file.")] = Path("world.png"),
    seed: Seed = 0,
    difficulty: Difficulty = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Draw a world from above and in 3D, with its tasks."""
    from andabata.app.console import Console
    from andabata.app.plots.drives import world_picture
    from andabata.records import atomic_io
    from worlds.catalogue import make_world

    world = make_world(name, seed, difficulty)
    atomic_io.write(out, world_picture(world))
    Console(quiet, as_json).result({"picture": str(out)}, f"picture: {out}")
