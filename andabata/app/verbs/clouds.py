"""``andabata clouds``: synthetic labelled clouds."""

from pathlib import Path
from typing import Annotated

import typer

from andabata.app.options import ConfigFile, Json, Quiet, Seed, Sensor, Set, Workers

app = typer.Typer(help="Synthetic labelled clouds.", no_args_is_help=True)


@app.command()
def generate(
    out: Annotated[Path, typer.Option(help="Folder to write.")],
    train: Annotated[int, typer.Option(min=0, help="Clouds for training.")] = 10,
    validation: Annotated[int, typer.Option(min=0, help="Clouds for validation.")] = 5,
    kitti: Annotated[
        bool, typer.Option("--kitti", help="Write SemanticKITTI's layout beside the npz files.")
    ] = False,
    sensor: Sensor = "utm-30lx",
    seed: Seed = 0,
    workers: Workers = 2,
    config: ConfigFile = None,
    settings: Set = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write labelled clouds of many worlds, with a manifest and a card."""
    from andabata.app.console import Console
    from andabata.app.settings import resolve, with_parts
    from andabata.app.usage import UsageError
    from andabata.datasets.generate import generate_dataset
    from andabata.datasets.labelled_cloud import CloudsConfig

    if train + validation == 0:
        raise UsageError("--train, --validation: expected at least one cloud, got none")
    console = Console(quiet, as_json)
    base = with_parts(CloudsConfig, sensor)
    resolved = resolve(CloudsConfig, config, settings or (), base)
    with console.progress("clouds", train + validation) as step:
        manifest = generate_dataset(
            out, resolved, {"train": train, "validation": validation}, seed, workers, step, kitti
        )
    points = sum(entry.points for entry in manifest.clouds) / len(manifest.clouds)
    data = {
        "out": str(out),
        "clouds": len(manifest.clouds),
        "mean_points": points,
        "config_sha256": manifest.config_sha256,
        "sha256": {entry.file: entry.sha256 for entry in manifest.clouds},
    }
    console.result(
        data, f"{len(manifest.clouds)} clouds of {points:.0f} points on average in {out}"
    )


@app.command()
def convert(
    file: Annotated[Path, typer.Argument(help="Cloud: npz, ply, pcd, bin, las, laz or vtk.")],
    out: Annotated[Path, typer.Argument(help="Cloud to write: npz, ply, pcd, bin, las or laz.")],
    columns: Annotated[
        int | None, typer.Option(help="Numbers of a point in a bin file; told by content without.")
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write a cloud in another format, with its labels, stamps and other numbers.

    The exit code is 3 when the new format has no room for some of them.
    """
    from andabata.app.console import Console
    from andabata.records import atomic_io
    from traversability.files import cloud_to_bytes, columns_lost_by, decode_cloud_file

    console = Console(quiet, as_json)
    kind = out.suffix[1:].lower()
    decoded = decode_cloud_file(file, columns)
    cloud = decoded.cloud
    atomic_io.write(out, cloud_to_bytes(cloud, kind, decoded.others, decoded.spacing))
    left_out = columns_lost_by(kind, decoded)
    notes = [*decoded.remarks]
    if left_out:
        notes.append(f"{kind} has no room for {', '.join(left_out)}: left out")
    for note in notes:
        console.status(f"note: {file.name}: {note}")
    data = {
        "out": str(out),
        "points": len(cloud),
        "no_returns": decoded.no_returns,
        "columns": decoded.columns,
        "left_out": list(left_out),
        "notes": notes,
    }
    none = f"; {decoded.no_returns} no-returns left out" if decoded.no_returns else ""
    console.result(data, f"{len(cloud)} points in {out}{none}")
    if left_out:
        raise typer.Exit(3)
