"""Export of a recording to a file of rerun's viewer: scene, map, plan, plots, and a blueprint.

Entities follow the frames: ``map`` holds the goals and paths, ``map/odom`` cloud, map and plan, and
``map/odom/base_footprint`` what moves with the robot. The times are those of the messages' headers.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.distribution import install_extra
from andabata.exports.rerun_estimate import PLOTS, EstimateLog
from andabata.exports.rerun_shapes import (
    CELL_COLOURS,
    height_colours,
    map_archetype,
    polar_mesh,
    scan_points,
)
from andabata.exports.tracks import read_tracks
from andabata.records import topics
from andabata.records.bags import Bag, LeftOut, Message
from andabata.records.decoding.point_cloud2 import PointCloudError, cloud_of
from andabata.records.frames.names import is_base, local_name
from andabata.records.messages import NS, header_ns, pose_of, sweep_angles
from andabata.records.topics import RosMessage, Topic
from andabata.runs import atomic_io
from traversability.grid import PolarGrid
from traversability.virtual_scan import VirtualScan

SUFFIX = ".rrd"
"""Suffix of rerun's files."""

MAP, ODOM, BASE = "map", "map/odom", "map/odom/base_footprint"
"""Entities of the frames."""

_TIMELINE = "time"
_EYE = np.array([-9.0, -9.0, 8.0])
"""Place of the eye from the robot's first place in the map [m]."""

_COMMANDED, _TRUE = [0, 90, 200], [208, 0, 111]
"""Colours of what the robot believes or commands, and of what is true."""

_POSE_PERIOD, _CELL_PERIOD = 0.05, 0.5
"""Time between two poses, and between two clouds whose cells are classified again [s]."""

Scan = Callable[[NDArray[np.float32]], VirtualScan]
"""Classification of points in ``base_footprint``."""


class RerunError(ValueError):
    """A missing rerun SDK."""


@dataclass
class RerunExport:
    """Result of an export.

    Attributes:
        entities: Number of what was logged, by entity.
        left_out: Messages that could not be read.
        notes: Facts that a user should know although no message is missing.
    """

    entities: dict[str, int] = field(default_factory=dict)
    left_out: tuple[LeftOut, ...] = ()
    notes: tuple[str, ...] = ()


def export_rerun(
    source: Path,
    out: Path,
    scan: Scan,
    grid: PolarGrid,
    on_message: Callable[[], None] = lambda: None,
) -> RerunExport:
    """Write a recording of ours, or of a robot with our topics, as a file for rerun.

    Args:
        source: Recording.
        out: File to write.
        scan: Classification of a cloud in ``base_footprint``: recordings hold no polar cells, so
            they are judged again, twice a second.
        grid: Polar grid of the cells.
        on_message: Function called after each message.

    Raises:
        RerunError: If the SDK is not installed.
        BagError: If the recording has no poses.
        OSError: If the file cannot be written.
    """
    rerun = _sdk()
    with Bag(source, damaged=True) as bag:
        tracks = read_tracks(bag)
        stream = rerun.RecordingStream("andabata", recording_id=source.stem)
        # In memory, in one piece: the SDK's own files are silently short on a full disk.
        sink = stream.binary_stream()
        stream.set_log_time_enabled(False)
        stream.send_blueprint(_blueprint(tracks[0].positions[0]))
        logger = _Logger(rerun, stream, scan, grid)
        for track in tracks:
            logger.track(track.name, track.frame, track.positions)
        logger.styles()
        for message in bag.messages(logger.topics):
            logger.add(message)
            on_message()
        atomic_io.write(out, sink.read() or b"")
        notes = [f"{n} messages not drawn: {text}" for text, n in logger.notes.items()]
        return RerunExport(logger.counts, tuple(bag.left_out), (*bag.notes, *notes))


def _sdk() -> Any:  # noqa: ANN401 - an optional package.
    """Return the SDK.

    Raises:
        RerunError: If it is not installed.
    """
    try:
        import rerun
    except ImportError as error:
        raise RerunError(
            "rerun: expected the rerun SDK, got none; install the extra `rerun` "
            f"({install_extra('rerun')})"
        ) from error
    return rerun


def _blueprint(start: NDArray[np.float64]) -> Any:  # noqa: ANN401 - an optional package's type.
    """Return the blueprint: the scene beside steering, errors, speed and health.

    Args:
        start: First place of the robot in the map [m], shape (3,).
    """
    import rerun.blueprint as layout

    plots = [
        layout.TimeSeriesView(origin=f"plots/{name}", name=title)
        for name, title in (
            ("steering", "Steering [rad/s]"),
            ("heading_error", "Heading error [rad]"),
            ("speed", "Speed [m/s]"),
            *PLOTS,
        )
    ]
    options: dict[str, Any] = {}
    if hasattr(layout, "EyeControls3D"):  # Older SDKs look at the whole scene.
        options["eye_controls"] = layout.EyeControls3D(
            position=start + _EYE, look_target=start, tracking_entity=BASE
        )
    scene = layout.Spatial3DView(origin=MAP, name="Scene", **options)
    health = layout.TextLogView(origin="health", name="Health")
    beside = layout.Vertical(*plots, health)
    parts = layout.Horizontal(scene, beside, column_shares=[2, 1])
    return layout.Blueprint(parts, collapse_panels=True)


class _Logger:
    """Logger of messages to a stream.

    Attributes:
        counts: Number of what was logged, by entity.
        notes: Number of messages that were not drawn, by reason.
    """

    def __init__(self, rerun: Any, stream: Any, scan: Scan, grid: PolarGrid) -> None:  # noqa: ANN401
        self._rerun, self._stream, self._scan, self._grid = rerun, stream, scan, grid
        self.counts: dict[str, int] = {}
        self._last: dict[str, float] = {}
        self._stamp_ns = 0
        self._handlers: dict[str, tuple[Topic, Callable[[RosMessage], None]]] = {}
        self.notes: dict[str, int] = {}
        self._estimate = EstimateLog(rerun, self._log)
        for topic, handler in (
            (topics.TF, self._transforms),
            (topics.CLOUD, self._cloud),
            (topics.RELATIVE_CLOUD, self._cells),
            (topics.VIRTUAL_SCAN, self._virtual_scan),
            (topics.LOCAL_MAP, self._map),
            (topics.PLAN, self._plan),
            (topics.SUBGOAL, self._subgoal),
            (topics.GOAL, self._goal),
            (topics.TWIST, self._twist),
            (topics.HEADING_ERROR, self._heading_error),
            (topics.GROUND_TRUTH, self._truth),
            (topics.FILTERED_ODOMETRY, self._estimate.add_odometry),
            (topics.DIAGNOSTICS, self._estimate.add_diagnostics),
        ):
            self._handlers |= dict.fromkeys((topic.ros1, topic.ros2), (topic, handler))

    @property
    def topics(self) -> tuple[str, ...]:
        """Names of the topics that are logged."""
        return tuple(self._handlers)

    def add(self, message: Message) -> None:
        """Log a message of one of ``topics``, unless it is of another type or cannot be drawn."""
        topic, handler = self._handlers[message.topic]
        if message.kind not in (topic.kind, topic.kind1):
            self._note(f"{message.topic}: expected {topic.kind}, got {message.kind}")
            return
        content = message.content
        self._stamp_ns = header_ns(content) if hasattr(content, "header") else message.stamp_ns
        try:
            handler(content)
        except PointCloudError as error:
            self._note(f"{message.topic}: {error}")

    def _note(self, text: str) -> None:
        """Count a message that is not drawn, by its reason."""
        self.notes[text] = self.notes.get(text, 0) + 1

    def track(self, name: str, frame: str, positions: NDArray[np.float64]) -> None:
        """Log a whole track."""
        entity = f"{ODOM if frame == 'odom' else MAP}/tracks/{name.strip('/').replace('/', '_')}"
        colour = _TRUE if name == topics.GROUND_TRUTH.ros1 else _COMMANDED
        lines = self._rerun.LineStrips3D([positions], colors=[colour], radii=0.03)
        self._log(entity, lines, static=True)

    def styles(self) -> None:
        """Log what never changes: an arrow for the robot, and the colours of the plots."""
        arrow = self._rerun.Arrows3D(
            origins=[[-0.33, 0.0, 0.15]], vectors=[[0.67, 0.0, 0.0]], colors=[_TRUE], radii=0.08
        )
        self._log(f"{BASE}/robot", arrow, static=True)
        for name in ("steering", "speed"):
            for kind, colour in (("commanded", _COMMANDED), ("true", _TRUE)):
                lines = self._rerun.SeriesLines(colors=[colour], names=[kind])
                self._log(f"plots/{name}/{kind}", lines, static=True)

    def _log(self, entity: str, what: Any, static: bool = False) -> None:  # noqa: ANN401
        """Log an archetype at the time of the message."""
        if not static:
            # Stamps of the epoch are exact in nanoseconds as datetime64 alone.
            self._stream.set_time(_TIMELINE, timestamp=np.datetime64(self._stamp_ns, "ns"))
        self._stream.log(entity, what, static=static)
        self.counts[entity] = self.counts.get(entity, 0) + 1

    def _is_due(self, entity: str, period: float) -> bool:
        """Return True, and remember it, if an entity was not logged for a period [s]."""
        now = self._stamp_ns / NS
        # Half a percent early counts: stamps are rounded.
        if now - self._last.get(entity, -math.inf) < 0.995 * period:
            return False
        self._last[entity] = now
        return True

    def _transforms(self, content: RosMessage) -> None:
        """Log the poses of the robot in ``odom`` and of ``odom`` in the map."""
        for each in content.transforms:
            self._stamp_ns = header_ns(each)
            frames = local_name(str(each.header.frame_id)), str(each.child_frame_id)
            if frames == ("map", "odom"):
                entity = ODOM
            elif frames[0] == "odom" and is_base(frames[1]):
                entity = BASE
            else:
                continue
            if self._is_due(entity, _POSE_PERIOD):
                t, r = each.transform.translation, each.transform.rotation
                turn = self._rerun.Quaternion(xyzw=[r.x, r.y, r.z, r.w])
                placed = self._rerun.Transform3D(translation=[t.x, t.y, t.z], quaternion=turn)
                self._log(entity, placed)

    def _cloud(self, content: RosMessage) -> None:
        """Log a cloud, coloured by height."""
        frame = str(content.header.frame_id)
        entity = f"{ODOM if local_name(frame) == 'odom' else BASE}/cloud"
        if local_name(frame) != "odom" and not is_base(frame):
            self._note(f"clouds in {frame!r}: expected odom or base_footprint")
            return
        cloud = cloud_of(content)
        points = self._rerun.Points3D(
            cloud.points, colors=height_colours(cloud.points[:, 2]), radii=0.02
        )
        self._log(entity, points)

    def _cells(self, content: RosMessage) -> None:
        """Log the polar cells of a cloud around the robot."""
        entity = f"{BASE}/polar_cells"
        if not self._is_due(entity, _CELL_PERIOD):
            return
        points = np.ascontiguousarray(cloud_of(content).points, dtype=np.float32)
        mesh = polar_mesh(self._scan(points), self._grid)
        self._log(
            entity,
            self._rerun.Mesh3D(
                vertex_positions=mesh.vertices,
                triangle_indices=mesh.triangles,
                vertex_colors=mesh.colours,
            ),
        )

    def _virtual_scan(self, content: RosMessage) -> None:
        """Log the ends of the virtual scan's ranges."""
        points = scan_points(np.asarray(content.ranges), sweep_angles(content))
        colour = CELL_COLOURS[1]
        self._log(f"{BASE}/virtual_scan", self._rerun.Points3D(points, colors=[colour], radii=0.08))

    def _map(self, content: RosMessage) -> None:
        """Log the local map."""
        self._log(f"{ODOM}/local_map", map_archetype(self._rerun, content))

    def _plan(self, content: RosMessage) -> None:
        """Log the plan."""
        places = [pose_of(each.pose).position for each in content.poses]
        strips = [places] if places else []
        lines = self._rerun.LineStrips3D(strips, colors=[[10, 132, 255]], radii=0.05)
        self._log(f"{ODOM}/plan", lines)

    def _subgoal(self, content: RosMessage) -> None:
        """Log the sub-goal."""
        self._place(f"{ODOM}/subgoal", content, [10, 132, 255])

    def _goal(self, content: RosMessage) -> None:
        """Log the goal."""
        self._place(f"{MAP}/goal", content, [255, 149, 0])

    def _place(self, entity: str, content: RosMessage, colour: list[int]) -> None:
        """Log the place of a pose."""
        place = pose_of(content.pose).position
        self._log(entity, self._rerun.Points3D([place], colors=[colour], radii=0.25))

    def _twist(self, content: RosMessage) -> None:
        """Log the commanded speeds."""
        self._scalar("plots/steering/commanded", content.angular.z)
        self._scalar("plots/speed/commanded", content.linear.x)

    def _truth(self, content: RosMessage) -> None:
        """Log the true speeds, and keep the true place for the estimate."""
        self._estimate.add_truth(content)
        self._scalar("plots/steering/true", content.twist.twist.angular.z)
        self._scalar("plots/speed/true", content.twist.twist.linear.x)

    def _heading_error(self, content: RosMessage) -> None:
        """Log the heading error."""
        self._scalar("plots/heading_error", content.data)

    def _scalar(self, entity: str, value: float) -> None:
        """Log a number."""
        self._log(entity, self._rerun.Scalars(float(value)))
