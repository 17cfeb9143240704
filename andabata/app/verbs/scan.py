"""``andabata scan``: clouds to cells, virtual scans and pictures."""

from pathlib import Path
from typing import Annotated

import typer

from andabata.app.command import command
from andabata.app.options.models import ForestOptions
from andabata.app.options.scan import CloudOptions, ScanOptions
from andabata.app.options.shared import ConsoleOptions


@command
def scan(
    *,
    files: Annotated[
        list[Path], typer.Argument(help="Clouds: npz, ply, pcd, bin, las, laz, vtk; or recordings.")
    ],
    scanning: ScanOptions,
    cloud: CloudOptions,
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
    from andabata.app.scan_files import exit_code, scan_files
    from andabata.app.tables import scan_lines
    from andabata.configuration.usage import UsageError

    if picture is not None and len(files) > 1:
        raise UsageError(f"--picture: expected one cloud, got {len(files)}; use --report")
    config, console = scanning.resolve(), output.console()
    source = cloud.source(scanning.mountings())
    results = scan_files(
        files, source, config, forest.load(), console.status, picture=picture, report=report
    )
    lines = scan_lines(results) + ([f"report: {report}"] if report else [])
    console.result(results[0] if len(results) == 1 else {"scans": results}, "\n".join(lines))
    if code := exit_code(results):
        raise typer.Exit(code)
