"""``andabata scan``: any clouds to cells, virtual scans and pictures."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from andabata.app.options import ForestFile, Json, LaserMounting, Quiet

if TYPE_CHECKING:
    from andabata.app.scanning import ScanConfig
    from andabata.records.sensor_pose import GivenMounting
    from traversability.decoding import DecodedCloud
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
    sensor_at: Annotated[
        str | None,
        typer.Option(
            help="X,Y,Z of the sensor in the cloud's own coordinates, where they are a map's."
        ),
    ] = None,
    columns: Annotated[
        int | None, typer.Option(help="Numbers of a point in bin files; told by content without.")
    ] = None,
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
    labels is scored against them. The exit code is 1 when no cell could be judged, 3 when some
    clouds or labels could not be read.
    """
    from andabata.app.console import Console
    from andabata.app.mountings import laser_mounting, read_mountings
    from andabata.app.report import Report
    from andabata.app.scanning import ScanConfig
    from andabata.app.settings import resolve
    from andabata.app.usage import UsageError, numbers
    from andabata.models import shipped_forest
    from andabata.records import atomic_io
    from traversability.forest import Forest

    if picture is not None and len(files) > 1:
        raise UsageError(f"--picture: expected one cloud, got {len(files)}; use --report")
    console = Console(quiet, as_json)
    options = {"own_body": own_body, "level": level, "n_sectors": sectors}
    overrides = [f"{name}={str(value).lower()}" for name, value in options.items()]
    at = None if sensor_at is None else numbers(sensor_at, 3, "--sensor-at")
    given = read_mountings(mounting or (), ("laser",))
    base = ScanConfig(mounting=laser_mounting(given, sensor_height), sensor_at=at)
    config = resolve(ScanConfig, None, overrides, base)
    loaded = Forest.load(forest) if forest else shipped_forest()
    page = Report("Clouds and what the robot makes of them")
    found: list[dict[str, Any]] = []
    for file in files:
        where = picture or Path(f"{file.stem}_scan.png")
        try:
            decoded = _read(file, topic, number, columns, given)
            data, drawn = _look(decoded, file.name, config, loaded)
        except (ValueError, OSError) as error:
            if len(files) == 1:
                raise
            found.append({"file": str(file), "error": " ".join(str(error).split())})
            console.status(f"error: {found[-1]['error']}")
            continue
        atomic_io.write(where, drawn)
        found.append({"file": str(file), **data, "picture": str(where)})
        for note in data["notes"]:
            console.status(f"note: {file.name}: {note}")
        page.section(file.name, " ".join([_in_words(data), *data["notes"]]))
        page.picture(drawn, "Points, cells and ranges")
    if report is not None:
        atomic_io.write(report, page.to_bytes())
    lines = [_line(each) for each in found]
    lines += [f"report: {report}"] if report else []
    console.result(found[0] if len(found) == 1 else {"scans": found}, "\n".join(lines))
    code = _exit_code(found)
    if code:
        raise typer.Exit(code)


def _read(
    file: Path,
    topic: str | None,
    number: int,
    columns: int | None,
    given: "dict[str, GivenMounting]",
) -> "DecodedCloud":
    """Return the cloud of a file, or one of a recording."""
    from dataclasses import replace

    from andabata.records.containers.opening import is_recording
    from andabata.records.export import decode_bag_cloud
    from traversability.files import decode_cloud_file

    if file.suffix in (".bag", ".mcap") or is_recording(file):
        return decode_bag_cloud(file, topic, number, given)
    decoded = decode_cloud_file(file, columns)
    if "laser" not in given:
        return decoded
    return replace(decoded, cloud=replace(decoded.cloud, frame="sensor"))


def _look(
    decoded: "DecodedCloud", name: str, config: "ScanConfig", forest: "Forest"
) -> tuple[dict[str, Any], bytes]:
    """Return what is seen in a cloud, ready for JSON, and its picture."""
    from andabata.app.plots.perception import scan_picture
    from andabata.app.scan_diagnosis import diagnose
    from andabata.app.scanning import scan_cloud, scan_result

    scanned = scan_cloud(decoded.cloud, config, forest)
    data = scan_result(scanned) | {
        "no_returns": decoded.no_returns,
        "columns": decoded.columns,
        "labels": _labels(decoded),
        "data_lost": decoded.data_lost,
        "notes": [*decoded.remarks, *_unscored(decoded), *diagnose(scanned, config)],
    }
    return data, scan_picture(scanned, name)


def _labels(decoded: "DecodedCloud") -> dict[str, Any] | None:
    """Return what the cloud's label numbers were taken for, ready for JSON."""
    told = decoded.labelling
    if told is None:
        return None
    return {
        "traversable": list(told.traversable),
        "assumed": told.assumed,
        "found": list(told.found),
        "unlabelled": told.unlabelled,
    }


def _unscored(decoded: "DecodedCloud") -> list[str]:
    """Return a note on labels that nothing gives a meaning."""
    cloud = decoded.cloud
    if cloud.classes is None or cloud.nontraversable is not None:
        return []
    numbers = sorted({int(number) for number in cloud.classes})
    shown = ", ".join(map(str, numbers[:8])) + (" and more" if len(numbers) > 8 else "")
    return [f"labels {shown}: nothing says which are obstacles, so the scan is not scored"]


def _exit_code(found: list[dict[str, Any]]) -> int:
    """Return 1 when no cell of any cloud could be judged, 3 when some data were left out."""
    failed = ["error" in each or not _judged(each) for each in found]
    if all(failed):
        return 1
    return 3 if any(failed) or any(each.get("data_lost") for each in found) else 0


def _judged(data: dict[str, Any]) -> bool:
    """Return whether any cell of a scan could be judged."""
    return bool(data["cells"]["green"] + data["cells"]["red"])


def _line(data: dict[str, Any]) -> str:
    """Return what people read of a cloud."""
    if "error" in data:
        return f"{data['file']}: not read"
    return f"{data['file']}: {_in_words(data)}\npicture: {data['picture']}"


def _in_words(data: dict[str, Any]) -> str:
    """Return a scan's figures as a sentence."""
    cells, nearest = data["cells"], data["nearest_obstacle_m"]
    said = "no obstacle seen" if nearest is None else f"nearest obstacle {nearest:.2f} m"
    if not _judged(data):
        said = "no cell could be judged"
    lost = f" ({data['no_returns']} no-returns left out)" if data["no_returns"] else ""
    return (
        f"{data['points']} points{lost}: {cells['green']} green, {cells['red']} red, "
        f"{cells['white']} white cells; {said}; {100 * data['unknown_share']:.0f} % of the ranges "
        "unknown."
    )
