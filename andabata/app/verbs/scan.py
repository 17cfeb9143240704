"""``andabata scan``: clouds to cells, virtual scans and pictures."""

from pathlib import Path
from typing import Annotated

import typer

from andabata.app.command import command
from andabata.app.options.shared import CloudUnit, ConsoleOptions, ForestOptions, LaserMounting


@command
def scan(
    *,
    files: Annotated[
        list[Path], typer.Argument(help="Clouds: npz, ply, pcd, bin, las, laz, vtk; or recordings.")
    ],
    sensor_height: Annotated[
        float, typer.Option(help="Height of the sensor above the base plane, in metres.")
    ] = 0.72,
    mounting: LaserMounting = None,
    own_body: Annotated[
        float, typer.Option(help="Leave out returns nearer than this to the sensor, in metres.")
    ] = 0.0,
    sensor_at: Annotated[
        str | None,
        typer.Option(
            help="X,Y,Z of the sensor in the cloud's own coordinates, where they are a map's."
        ),
    ] = None,
    columns: Annotated[
        int | None,
        typer.Option(help="Numbers of a point in bin files; by default read from the content."),
    ] = None,
    unit: CloudUnit = None,
    level: Annotated[
        bool, typer.Option("--level", help="Make the ground around the robot the base plane.")
    ] = False,
    topic: Annotated[str | None, typer.Option(help="PointCloud2 topic of a recording.")] = None,
    number: Annotated[
        int, typer.Option(help="Index of the cloud in the topic; negative from the end.")
    ] = 0,
    labels: Annotated[
        str | None,
        typer.Option(
            help="Meaning of the points' classes: semantickitti, rellis, goose or a TOML file."
        ),
    ] = None,
    sectors: Annotated[int, typer.Option(help="Number of sectors of the virtual scan.")] = 32,
    max_traversable_vegetation: Annotated[
        float, typer.Option(help="Height up to which the robot drives over plants, in metres.")
    ] = 0.15,
    picture: Annotated[
        Path | None, typer.Option(help="PNG file of a single cloud; in this folder by default.")
    ] = None,
    report: Annotated[
        Path | None, typer.Option(help="HTML page with the pictures of all clouds.")
    ] = None,
    forest: ForestOptions,
    output: ConsoleOptions,
) -> None:
    """Classify the cells around the robot in clouds.

    The sensor is taken to be level unless `--mounting` or `--level` says otherwise. A cloud with
    labels is scored against them. The exit code is 1 when no cell could be classified, 3 when some
    clouds or labels could not be read.

    Examples:
        andabata scan cloud.ply --sensor-height 0.95
        andabata scan cloud.npz --mounting 0.2,0,0,10,0 --picture pitched.png
        andabata scan cloud.npz cloud.ply --level --report scans.html
        andabata scan drive.bag --topic /3D_cloud --number -1
        andabata scan 000000.bin --labels rellis --sectors 64 --json
    """
    from andabata.app.options.mountings import laser_mounting, read_mountings
    from andabata.app.scan_files import CloudSource, exit_code, scan_files
    from andabata.app.tables import scan_lines
    from andabata.configuration.settings import resolve
    from andabata.configuration.usage import UsageError, numbers
    from andabata.scanning.scan import ScanConfig
    from traversability.class_table import load_class_table

    if picture is not None and len(files) > 1:
        raise UsageError(f"--picture: expected one cloud, got {len(files)}; use --report")
    given = read_mountings(mounting or (), ("laser",))
    base = ScanConfig(
        mounting=laser_mounting(given, sensor_height),
        sensor_at=None if sensor_at is None else numbers(sensor_at, 3, "--sensor-at"),
    )
    overrides = [f"own_body={own_body}", f"level={str(level).lower()}", f"n_sectors={sectors}"]
    overrides += [f"max_traversable_vegetation={max_traversable_vegetation}"]
    config, console = resolve(ScanConfig, None, overrides, base), output.console()
    table = None if labels is None else load_class_table(labels)
    source = CloudSource(topic, number, columns, given, unit, table)
    found = scan_files(
        files, source, config, forest.load(), console.status, picture=picture, report=report
    )
    lines = scan_lines(found) + ([f"report: {report}"] if report else [])
    console.result(found[0] if len(found) == 1 else {"scans": found}, "\n".join(lines))
    if code := exit_code(found):
        raise typer.Exit(code)
