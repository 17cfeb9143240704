"""``andabata scan``: any clouds to cells, virtual scans and pictures."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from andabata.app.options import ForestFile, Json, LaserMounting, Quiet

if TYPE_CHECKING:
    from andabata.app.scanning import ScanConfig
    from andabata.records.mounts import GivenMounting
    from traversability.cloud import PointCloud
    from traversability.forest import Forest


def scan(
    files: Annotated[
        list[Path], typer.Argument(help="Clouds: npz, ply, pcd, bin, las, laz, vtk; or recordings.")
    ],
    sensor_height: Annotated[
        float, typer.Option(help="Sensor above the robot's base plane, in metres.")
    ] = 0.72,
    mounting: LaserMounting = None,
    own_body: Annotated[
        float, typer.Option(help="Leave out returns nearer than this to the sensor, in metres.")
    ] = 0.0,
    level: Annotated[
        bool, typer.Option("--level", help="Make the ground around the robot the base plane.")
    ] = False,
    topic: Annotated[
        str | None, typer.Option(help="PointCloud2 topic, where a file is a recording.")
    ] = None,
    number: Annotated[
        int, typer.Option(help="Which cloud of the topic; negative from the end.")
    ] = 0,
    sectors: Annotated[int, typer.Option(help="Sectors of the virtual scan.")] = 32,
    forest: ForestFile = None,
    picture: Annotated[
        Path | None, typer.Option(help="PNG file of a single cloud; in this folder by default.")
    ] = None,
    report: Annotated[
        Path | None, typer.Option(help="HTML page with the pictures of all clouds.")
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Judge the cells around the robot in clouds.

    The sensor is taken to be level unless `--mounting` or `--level` says otherwise. A cloud with
    labels is scored against them.
    """
    from andabata.app.console import Voice
    from andabata.app.mountings import laser_mounting, read_mountings
    from andabata.app.report import Report
    from andabata.app.scanning import ScanConfig
    from andabata.app.settings import resolve
    from andabata.app.usage import UsageError
    from andabata.models import shipped_forest
    from andabata.records.storage import write_atomically
    from traversability.forest import Forest

    if picture is not None and len(files) > 1:
        raise UsageError(f"--picture: expected one cloud, got {len(files)}; use --report")
    voice = Voice(quiet, as_json)
    options = {"own_body": own_body, "level": level, "n_sectors": sectors}
    overrides = [f"{name}={str(value).lower()}" for name, value in options.items()]
    given = read_mountings(mounting or (), ("laser",))
    base = ScanConfig(mounting=laser_mounting(given, sensor_height))
    config = resolve(ScanConfig, None, overrides, base)
    loaded = Forest.load(forest) if forest else shipped_forest()
    page = Report("Clouds and what the robot makes of them")
    found = []
    for file in files:
        where = picture or Path(f"{file.stem}_scan.png")
        cloud, remarks = _read(file, topic, number, given)
        data, drawn = _look(cloud, file.name, config, loaded)
        data["notes"] += remarks
        write_atomically(where, drawn)
        found.append({"file": str(file), **data, "picture": str(where)})
        for note in data["notes"]:
            voice.say(f"note: {file.name}: {note}")
        page.section(file.name, " ".join([_in_words(data), *data["notes"]]))
        page.picture(drawn, "Points, cells and ranges")
    if report is not None:
        write_atomically(report, page.to_bytes())
    lines = [f"{each['file']}: {_in_words(each)}\npicture: {each['picture']}" for each in found]
    lines += [f"report: {report}"] if report else []
    voice.result(found[0] if len(found) == 1 else {"scans": found}, "\n".join(lines))


def _read(
    file: Path, topic: str | None, number: int, given: "dict[str, GivenMounting]"
) -> "tuple[PointCloud, list[str]]":
    """Return the cloud of a file, or one of a recording, and remarks on its frame."""
    from dataclasses import replace

    from andabata.records.export import read_mounted_cloud
    from traversability.files import read_cloud

    if file.is_dir() or file.suffix in (".bag", ".mcap"):
        return read_mounted_cloud(file, topic, number, given)
    cloud = read_cloud(file)
    return (replace(cloud, frame="sensor") if "laser" in given else cloud), []


def _look(
    cloud: "PointCloud", name: str, config: "ScanConfig", forest: "Forest"
) -> tuple[dict[str, Any], bytes]:
    """Return what is seen in a cloud, ready for JSON, and its picture."""
    from andabata.app.pictures import scan_picture
    from andabata.app.scanning import doubts, scan_cloud, scan_result

    scanned = scan_cloud(cloud, config, forest)
    data = scan_result(scanned) | {"notes": doubts(scanned, config)}
    return data, scan_picture(scanned, name)


def _in_words(data: dict[str, Any]) -> str:
    """Return a scan's figures as a sentence."""
    cells = data["cells"]
    nearest = min((r for r in data["ranges"] if r is not None), default=float("nan"))
    return (
        f"{data['points']} points: {cells['green']} green, {cells['red']} red, {cells['white']} "
        f"white cells; nearest obstacle {nearest:.2f} m."
    )
