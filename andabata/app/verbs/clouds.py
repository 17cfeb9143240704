"""``andabata clouds``: synthetic labelled clouds, and their formats."""

from pathlib import Path
from typing import Annotated

import typer

from andabata.app.command import command
from andabata.app.options.sensors import CloudUnit
from andabata.app.options.shared import ConsoleOptions, EngineOptions, Seed, Sensor, SettingsOptions

app = typer.Typer(help="Synthetic labelled clouds: generate, convert.", no_args_is_help=True)


@app.command()
@command
def generate(
    *,
    out: Annotated[Path, typer.Option(help="Folder to write.")],
    train: Annotated[int, typer.Option(min=0, help="Number of clouds for training.")] = 10,
    validation: Annotated[int, typer.Option(min=0, help="Number of clouds for validation.")] = 5,
    kitti: Annotated[
        bool, typer.Option("--kitti", help="Write SemanticKITTI's layout beside the npz files.")
    ] = False,
    sensor: Sensor = "utm-30lx",
    settings: SettingsOptions,
    seed: Seed = 0,
    engine: EngineOptions,
    output: ConsoleOptions,
) -> None:
    """Write labelled clouds of many worlds, with a manifest and a card.

    A run that was killed goes on if it is called again.

    Examples:
        andabata clouds generate --out data/clouds
        andabata clouds generate --out data/clouds --train 700 --validation 210
        andabata clouds generate --out kitti --kitti --sensor os1-64 --workers 4
    """
    from andabata.configuration.settings import with_parts
    from andabata.configuration.usage import UsageError
    from andabata.datasets.generate import generate_dataset
    from andabata.datasets.labelled_cloud import CloudsConfig
    from andabata.runs.lock import locked_folder
    from traversability.dataset import Split

    if train + validation == 0:
        raise UsageError("--train, --validation: expected at least one cloud, got none")
    config = settings.resolve(CloudsConfig, with_parts(CloudsConfig, sensor))
    console = output.console()
    counts: dict[Split, int] = {"train": train, "validation": validation}
    with (
        locked_folder(out),
        engine.make(console) as made,
        console.progress("clouds", train + validation) as step,
    ):
        manifest = generate_dataset(out, config, counts, seed, step, kitti, made)
    number = len(manifest.clouds)
    points = sum(entry.points for entry in manifest.clouds) / number
    data = {
        "out": str(out),
        "clouds": number,
        "mean_points": points,
        "config_sha256": manifest.config_sha256,
        "sha256": {entry.file: entry.sha256 for entry in manifest.clouds},
    }
    console.result(data, f"{number} clouds of {points:.0f} points on average in {out}")


@app.command()
@command
def convert(
    *,
    file: Annotated[Path, typer.Argument(help="Cloud: npz, ply, pcd, bin, las, laz or vtk.")],
    out: Annotated[Path, typer.Argument(help="Cloud to write: npz, ply, pcd, bin, las or laz.")],
    columns: Annotated[
        int | None,
        typer.Option(help="Numbers of a point in a bin file; by default read from the content."),
    ] = None,
    unit: CloudUnit = None,
    output: ConsoleOptions,
) -> None:
    """Write a cloud in another format, in metres, with its labels, stamps and other numbers.

    The exit code is 3 when the new format has no place for some of them.

    Examples:
        andabata clouds convert cloud.npz cloud.ply
        andabata clouds convert cloud.ply cloud.pcd --json
    """
    from andabata.runs import atomic_io
    from traversability.files import cloud_to_bytes, columns_lost_by, decode_cloud_file

    console, kind = output.console(), out.suffix[1:].lower()
    decoded = decode_cloud_file(file, columns, unit)
    data = cloud_to_bytes(decoded.cloud, kind, decoded.others, decoded.spacing, decoded.viewpoint)
    atomic_io.write(out, data)
    left_out, notes = columns_lost_by(kind, decoded), [*decoded.remarks]
    if left_out:
        notes.append(f"{kind} has no place for {', '.join(left_out)}: left out")
    for note in notes:
        console.status(f"note: {file.name}: {note}")
    result = {
        "out": str(out),
        "points": len(decoded.cloud),
        "no_returns": decoded.no_returns,
        "columns": decoded.columns,
        "left_out": list(left_out),
        "notes": notes,
    }
    lost = f"; {decoded.no_returns} no-returns left out" if decoded.no_returns else ""
    console.result(result, f"{len(decoded.cloud)} points in {out}{lost}")
    if left_out:
        raise typer.Exit(3)
