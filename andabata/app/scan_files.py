"""Scans of cloud files and recordings: one result, picture and section of the report for each."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from andabata.app.tables import scan_text
from andabata.exports.topics import decode_bag_cloud
from andabata.records.containers.opening import is_recording
from andabata.records.frames.sensor_pose import GivenMounting
from andabata.report.blocks import Plot
from andabata.report.page import Page, Section
from andabata.report.plots.axes import png
from andabata.report.plots.perception import scan_figure
from andabata.runs import atomic_io
from andabata.scanning.diagnosis import diagnose
from andabata.scanning.explanations import CloudOrigin
from andabata.scanning.origin import Position, from_the_sensor
from andabata.scanning.scan import ScanConfig, scan_cloud, scan_result
from traversability.class_table import ClassTable
from traversability.decoding import DecodedCloud
from traversability.files import decode_cloud_file
from traversability.forest import Forest
from traversability.formats.coordinate_units import METRES


@dataclass(frozen=True)
class CloudSource:
    """Options of reading a cloud.

    Attributes:
        topic: PointCloud2 topic of a recording; None for its only one.
        number: Index of the cloud in the topic, negative from the end.
        columns: Number of columns of a bin file; None to infer it from the content.
        mountings: Mountings by sensor that the user gives.
        unit: Length of the unit of the coordinates [m]; None for what the cloud says, else metres.
        labels: Meaning of the classes of points; None for what the files say.
    """

    topic: str | None = None
    number: int = 0
    columns: int | None = None
    mountings: Mapping[str, GivenMounting] = field(default_factory=dict)
    unit: float | None = None
    labels: ClassTable | None = None

    def read(self, file: Path) -> DecodedCloud:
        """Return the cloud of a file, or one of a recording."""
        # By its suffix too: a damaged recording is refused as a recording, not as an unknown
        # kind of cloud.
        if file.suffix in (".bag", ".mcap") or is_recording(file):
            decoded = decode_bag_cloud(
                file, self.topic, self.number, dict(self.mountings), self.unit
            )
            return decoded if self.labels is None else self.labels.apply(decoded)
        decoded = decode_cloud_file(file, self.columns, self.unit, self.labels)
        # A mounting that is given says that the coordinates are those of the sensor.
        if "laser" not in self.mountings:
            return decoded
        return replace(decoded, cloud=replace(decoded.cloud, frame="sensor"))


def scan_files(
    files: Sequence[Path],
    source: CloudSource,
    config: ScanConfig,
    forest: Forest,
    on_note: Callable[[str], None],
    *,
    picture: Path | None = None,
    report: Path | None = None,
) -> list[dict[str, Any]]:
    """Scan clouds, write a picture of each and return their results, ready for JSON.

    Args:
        files: Clouds or recordings.
        source: Options of reading them.
        config: Mounting, levelling and number of sectors.
        forest: Cell classifier.
        on_note: Function that shows a note or an error of one cloud.
        picture: PNG file of a single cloud; None for one in this folder named after the cloud.
        report: HTML page with all pictures, or None.

    Returns:
        One result a file; of a file that cannot be read its name and the error.

    Raises:
        ValueError: If the only file cannot be read or scanned.
        OSError: If the only file cannot be opened.
    """
    sections: list[Section] = []
    results: list[dict[str, Any]] = []
    for file in files:
        try:
            data, drawn = scan_file(source.read(file), file.name, config, forest, source.labels)
        except (ValueError, OSError) as error:
            # Of several clouds the others are still scanned.
            if len(files) == 1:
                raise
            results.append({"file": str(file), "error": " ".join(str(error).split())})
            on_note(f"error: {results[-1]['error']}")
            continue
        path = picture or Path(f"{file.stem}_scan.png")
        atomic_io.write(path, png(drawn))
        results.append({"file": str(file), **data, "picture": str(path)})
        for note in data["notes"]:
            on_note(f"note: {file.name}: {note}")
        plot = Plot(drawn, f"scan-{file.stem}", "Points, cells and ranges")
        text = " ".join([scan_text(data), *data["notes"]])
        sections.append(Section(file.name, text, plot))
    if report is not None:
        page = Page("Clouds and their virtual scans", sections=sections)
        atomic_io.write(report, page.to_bytes())
    return results


def scan_file(
    decoded: DecodedCloud,
    name: str,
    config: ScanConfig,
    forest: Forest,
    labels: ClassTable | None = None,
) -> tuple[dict[str, Any], Figure]:
    """Return the scan of one cloud with its notes, ready for JSON, and its picture."""
    decoded, sensor_at = from_the_sensor(decoded, config.sensor_at)
    config = config.model_copy(update={"sensor_at": sensor_at})
    scanned = scan_cloud(decoded.cloud, config, forest)
    data = scan_result(scanned, labels) | {
        "no_returns": decoded.no_returns,
        "columns": decoded.columns,
        "labels": _labels(decoded),
        "data_lost": decoded.data_lost,
        "notes": [
            *decoded.remarks,
            *_unscored(decoded),
            *diagnose(scanned, config, _origin(decoded, sensor_at)),
        ],
    }
    return data, scan_figure(scanned, name)


def _origin(decoded: DecodedCloud, sensor_at: Position | None) -> CloudOrigin:
    """Return what happened to a cloud before it is scanned, by the position that the user gives."""
    metric = decoded.units._replace(is_assumed=False) == METRES
    viewpoint = decoded.viewpoint is not None and sensor_at is None
    return CloudOrigin(metric, decoded.rotation, *decoded.units.metres, viewpoint)


def exit_code(results: Sequence[Mapping[str, Any]]) -> int:
    """Return 1 if no cell of any cloud was classified, 3 if some data were left out, else 0."""
    failed = ["error" in each or not _is_classified(each) for each in results]
    if all(failed):
        return 1
    return 3 if any(failed) or any(each.get("data_lost") for each in results) else 0


def _is_classified(data: Mapping[str, Any]) -> bool:
    """Return True if any cell of a scan was classified."""
    return bool(data["cells"]["green"] + data["cells"]["red"])


def _labels(decoded: DecodedCloud) -> dict[str, Any] | None:
    """Return the meaning that was given to the cloud's label numbers, ready for JSON."""
    labelling = decoded.labelling
    if labelling is None:
        return None
    return {
        "traversable": list(labelling.traversable),
        "assumed": labelling.assumed,
        "found": list(labelling.found),
        "unlabelled": labelling.unlabelled,
    }


def _unscored(decoded: DecodedCloud) -> list[str]:
    """Return a note on labels whose meaning is unknown."""
    cloud = decoded.cloud
    if cloud.classes is None or cloud.nontraversable is not None:
        return []
    numbers = sorted({int(number) for number in cloud.classes})
    shown = ", ".join(map(str, numbers[:8])) + (" and more" if len(numbers) > 8 else "")
    return [f"labels {shown}: nothing says which are obstacles, so the scan is not scored"]
