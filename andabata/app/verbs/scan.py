"""``andabata scan``: any cloud to cells, virtual scan and a picture."""

from pathlib import Path
from typing import Annotated

import typer

from andabata.app.options import ForestFile, Json, Quiet

_MOUNTING = "x, y (metres) and roll, pitch, yaw (degrees) of the sensor, as X,Y,ROLL,PITCH,YAW."


def scan(
    file: Annotated[Path, typer.Argument(help="Cloud: npz, ply, pcd, bin, las, laz or vtk.")],
    sensor_height: Annotated[
        float, typer.Option(help="Sensor above the robot's base plane, in metres.")
    ] = 0.72,
    mounting: Annotated[str, typer.Option(help=_MOUNTING)] = "0,0,0,0,0",
    own_body: Annotated[
        float, typer.Option(help="Leave out returns nearer than this to the sensor, in metres.")
    ] = 0.0,
    level: Annotated[
        bool, typer.Option("--level", help="Make the ground around the robot the base plane.")
    ] = False,
    sectors: Annotated[int, typer.Option(help="Sectors of the virtual scan.")] = 32,
    forest: ForestFile = None,
    picture: Annotated[
        Path | None, typer.Option(help="PNG file; beside the present folder by default.")
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Judge the cells around the robot in one cloud.

    The sensor is taken to be level unless `--mounting` or `--level` says otherwise. A cloud with
    labels is scored against them.
    """
    from andabata.app.console import Voice
    from andabata.app.pictures import scan_picture
    from andabata.app.scanning import ScanConfig, doubts, scan_cloud, scan_result
    from andabata.app.settings import resolve
    from andabata.models import shipped_forest
    from andabata.records.storage import write_atomically
    from traversability.files import read_cloud
    from traversability.forest import Forest

    voice = Voice(quiet, as_json)
    options = {"own_body": own_body, "level": level, "n_sectors": sectors}
    overrides = [f"{name}={str(value).lower()}" for name, value in options.items()]
    base = ScanConfig(mounting=_mounting(mounting, sensor_height))
    config = resolve(ScanConfig, None, overrides, base)
    loaded = Forest.load(forest) if forest else shipped_forest()
    scanned = scan_cloud(read_cloud(file), config, loaded)
    warnings = doubts(scanned, config)
    for warning in warnings:
        voice.say(f"note: {warning}")
    where = picture or Path(f"{file.stem}_scan.png")
    write_atomically(where, scan_picture(scanned, file.name))
    data = {**scan_result(scanned), "picture": str(where), "notes": warnings}
    cells = data["cells"]
    nearest = min((r for r in data["ranges"] if r is not None), default=float("nan"))
    text = (
        f"{data['points']} points: {cells['green']} green, {cells['red']} red, {cells['white']} "
        f"white cells; nearest obstacle {nearest:.2f} m\npicture: {where}"
    )
    voice.result(data, text)


def _mounting(text: str, height: float):  # type: ignore[no-untyped-def]  # noqa: ANN202 - a heavy type.
    """Return the mounting of the two options."""
    import math

    from andabata.app.scanning import Mounting
    from andabata.app.settings import resolve
    from andabata.app.usage import UsageError

    try:
        x, y, roll, pitch, yaw = (float(word) for word in text.split(","))
    except ValueError as error:
        raise UsageError(
            f"--mounting: expected five numbers X,Y,ROLL,PITCH,YAW, got {text!r}"
        ) from error
    fields = {"x": x, "y": y, "z": height}
    angles = {"roll": roll, "pitch": pitch, "yaw": yaw}
    fields |= {name: math.radians(angle) for name, angle in angles.items()}
    return resolve(Mounting, overrides=[f"{name}={value!r}" for name, value in fields.items()])
