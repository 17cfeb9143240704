"""Tracks of the robot, from recordings and run folders: where it was, when, and how it stood."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from andabata.machine.geo_reference import GeoReference
from andabata.machine.pose import Pose
from andabata.records import topics
from andabata.records.bags import Bag, BagError
from andabata.records.drive_setup import read_setup
from andabata.records.frames.names import is_base, local_name
from andabata.records.messages import NS, header_ns, pose_of
from andabata.records.topics import RosMessage

DRIVE_FILE, RUN_FILE = "drive.json", "run.json"
"""Results and settings in the run folder of a drive."""

_ODOMETRY = "nav_msgs/msg/Odometry"

_POSE_OF: dict[str, Callable[[RosMessage], tuple[str, RosMessage]]] = {
    _ODOMETRY: lambda m: (m.header.frame_id, m.pose.pose),
    "geometry_msgs/msg/PoseStamped": lambda m: (m.header.frame_id, m.pose),
    "geometry_msgs/msg/PoseWithCovarianceStamped": lambda m: (m.header.frame_id, m.pose.pose),
}
"""Frame and pose of a message, by its type."""

_PATH = "nav_msgs/msg/Path"
"""Type whose last message is a whole track."""

_TRANSFORMS = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
_PREFERRED = (topics.FILTERED_ODOMETRY, topics.GROUND_TRUTH)


class TrackError(ValueError):
    """A recording or a folder without the track that is asked for."""


@dataclass(frozen=True)
class Track:
    """Places of the robot in the order of their times.

    Attributes:
        name: Topic or file that it comes from.
        frame: Frame of the places, without slashes and namespace.
        stamps_ns: Time of each place since 1970 [ns], int64, shape (k,); None if not recorded.
        positions: Places [m], float64, shape (k, 3).
        quaternions: Rotations x, y, z, w, float64, shape (k, 4); None if not recorded.
    """

    name: str
    frame: str
    stamps_ns: NDArray[np.int64] | None
    positions: NDArray[np.float64]
    quaternions: NDArray[np.float64] | None

    @property
    def length(self) -> float:
        """Length of the way [m]."""
        return float(np.linalg.norm(np.diff(self.positions, axis=0), axis=1).sum())


def read_tracks(bag: Bag, names: tuple[str, ...] | None = None) -> list[Track]:
    """Return the tracks of a recording.

    Args:
        bag: Recording to read.
        names: Topics of Odometry, PoseStamped, PoseWithCovarianceStamped, Path, whose last message
            counts, or transforms to the robot's body; None for all of Odometry, the filter's first.

    Raises:
        BagError: If a topic is missing or has no poses.
    """
    rows: dict[str, list[tuple[int, str, Pose]]] = {name: [] for name in _chosen(bag, names)}
    for message in bag.messages(tuple(rows)):
        if message.kind == _PATH:
            rows[message.topic].clear()
        rows[message.topic] += _poses(message.kind, message.content)
    tracks = [_track(name, entries) for name, entries in rows.items() if entries]
    if not tracks:
        raise BagError(
            f"{bag.path}: expected poses of the robot's body in {', '.join(rows)}, got "
            "none; choose another topic by --topic"
        )
    return tracks


def _chosen(bag: Bag, names: tuple[str, ...] | None) -> tuple[str, ...]:
    """Return the topics whose poses are asked for.

    Raises:
        BagError: If one of them has no poses, or there are none.
    """
    kinds = {topic: kind for topic, (kind, n) in bag.topics.items() if n}
    if names is None:
        odometry = [topic for topic, kind in kinds.items() if kind == _ODOMETRY]
        names = tuple(sorted(odometry, key=lambda topic: (_rank(topic), topic)))
    bad = [name for name in names if kinds.get(name) not in (*_POSE_OF, _PATH, *_TRANSFORMS)]
    if bad or not names:
        known = ", ".join(f"{topic} ({kind.rsplit('/', 1)[-1]})" for topic, kind in kinds.items())
        wanted = "Odometry, PoseStamped, PoseWithCovarianceStamped, Path or /tf"
        raise BagError(
            f"{bag.path}: expected poses ({wanted}){' in ' + ', '.join(bad) if bad else ''}, got "
            f"{known or 'no messages'}; choose a topic that has some by --topic"
        )
    return names


def _rank(topic: str) -> int:
    """Return the place of a topic of odometry in the order of preference."""
    order = [each.ros1 for each in _PREFERRED]
    return order.index(topic) if topic in order else len(order)


def _poses(kind: str, content: RosMessage) -> list[tuple[int, str, Pose]]:
    """Return stamp [ns], frame and pose of the robot's body in a message."""
    if kind in _TRANSFORMS:
        return [
            (header_ns(each), str(each.header.frame_id), _pose_of_transform(each.transform))
            for each in content.transforms
            if is_base(str(each.child_frame_id))
        ]
    if kind == _PATH:
        frame = str(content.header.frame_id)
        return [(header_ns(each), frame, pose_of(each.pose)) for each in content.poses]
    if kind not in _POSE_OF:
        return []  # Another type under the same name.
    frame, pose = _POSE_OF[kind](content)
    return [(header_ns(content), str(frame), pose_of(pose))]


def _pose_of_transform(transform: RosMessage) -> Pose:
    """Return a transform as the pose of its child."""
    t, r = transform.translation, transform.rotation
    return Pose(np.array([t.x, t.y, t.z]), np.array([r.x, r.y, r.z, r.w]))


def _track(name: str, entries: list[tuple[int, str, Pose]]) -> Track:
    """Return the entries of a topic as a track, by time.

    Those of other frames than the first's are left out, and the later ones of one time. A plan, all
    of whose poses have one stamp, keeps its order and has no times.
    """
    frame = entries[0][1]
    entries = [each for each in entries if each[1] == frame]
    stamps = [stamp for stamp, _, _ in entries]
    is_plan = len(entries) > 1 and len(set(stamps)) == 1
    if not is_plan:
        order = {stamp: k for k, stamp in reversed(list(enumerate(stamps)))}
        entries = [entries[order[stamp]] for stamp in sorted(order)]
    return Track(
        name,
        local_name(frame),
        None if is_plan else np.array([stamp for stamp, _, _ in entries], dtype=np.int64),
        np.array([pose.position for _, _, pose in entries]),
        np.array([pose.quaternion for _, _, pose in entries]),
    )


def bag_geo_reference(bag: Bag) -> GeoReference | None:
    """Return the geo reference of a recording's map; None if the recording does not tell it.

    A simulated drive tells it in its settings, a live one in its diagnostics.
    """
    try:
        setup = read_setup(bag, {}, {})
    except BagError:
        return None
    # A datum from a heading alone has no place: its source names no fix.
    if setup.datum is not None and setup.datum.source == "the recording":
        return setup.datum.reference
    return _simulated_geo_reference(setup.settings.get("simulated_robot"))


def _simulated_geo_reference(robot: object) -> GeoReference | None:
    """Return the geo reference in the settings of a simulated robot, None without any."""
    place = robot
    for key in ("sensing", "geo_reference"):
        place = place.get(key) if isinstance(place, dict) else None
    return GeoReference(**place) if isinstance(place, dict) else None


def is_drive_folder(path: Path) -> bool:
    """Return True for the run folder of a drive."""
    return path.is_dir() and (path / DRIVE_FILE).is_file()


@dataclass(frozen=True)
class DriveFolder:
    """Run folder of a drive.

    Attributes:
        track: True path in the map, without stamps and rotations.
        goals: Goals in the map [m], float64, shape (k, 2).
        reference: Geo reference of the map; None if the folder has no settings.
    """

    track: Track
    goals: NDArray[np.float64]
    reference: GeoReference | None


def read_drive_folder(folder: Path) -> DriveFolder:
    """Return what the run folder of a drive holds.

    Raises:
        TrackError: If its files are no drive's.
        OSError: If they cannot be read.
    """
    file = folder / DRIVE_FILE
    try:
        data = json.loads(file.read_text())
        positions = np.array(data["path"], dtype=np.float64).reshape(-1, 3)
        goals = np.array(data["goals"], dtype=np.float64).reshape(-1, 2)
        run = json.loads(text) if (text := _text_of(folder / RUN_FILE)) else {}
        reference = _simulated_geo_reference(run.get("config"))
    except (KeyError, TypeError, ValueError) as error:
        raise TrackError(
            f"{file}: expected a drive with path and goals, got {' '.join(str(error).split())}; "
            "drive again, or give a recording"
        ) from error
    if not len(positions):
        raise TrackError(f"{file}: expected places of the robot, got none; drive again")
    return DriveFolder(Track(DRIVE_FILE, "map", None, positions, None), goals, reference)


def _text_of(path: Path) -> str:
    """Return the text of a file, empty without one."""
    return path.read_text() if path.is_file() else ""


def tum_text(track: Track) -> str:
    """Return a track in the format of the TUM benchmarks, which evo and others read.

    A line is the time [s], the position x, y, z [m] and the rotation x, y, z, w.

    Raises:
        TrackError: If the track has no stamps or rotations.
    """
    if track.stamps_ns is None or track.quaternions is None:
        raise TrackError(
            f"{track.name}: expected times and rotations for TUM, got places alone; record the "
            "drive with --record and export the recording"
        )
    lines = ["# timestamp tx ty tz qx qy qz qw"]
    for stamp, place, turn in zip(
        track.stamps_ns.tolist(), track.positions, track.quaternions, strict=True
    ):
        numbers = " ".join(f"{value:.9g}" for value in (*place, *turn))
        lines.append(f"{stamp // NS}.{stamp % NS:09d} {numbers}")
    return "\n".join(lines) + "\n"
