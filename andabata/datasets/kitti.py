"""Labelled clouds in the layout of SemanticKITTI, for the tools that read it."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from andabata.machine.pose import Pose
from andabata.runs import atomic_io
from andabata.runs.folder import make_folder
from terrain.classes import TRAITS, SemanticClass
from traversability.cloud import PointCloud
from traversability.files import cloud_to_bytes
from traversability.kitti_labels import kitti_labels

ROUGH_GROUND = 32
"""Label of ground that is too steep or stepped; the others are those of ``SemanticClass``."""

LOW_PLANTS = 33
"""Label of plants that are low enough to be crossed."""

_GROUND = (SemanticClass.GROUND, SemanticClass.PATH)

_PLANTS = [int(kind) for kind, traits in TRAITS.items() if traits.by_height]


def begin_sequence(folder: Path) -> None:
    """Make the folders of a sequence, and say what its labels mean."""
    for name in ("velodyne", "labels"):
        make_folder(folder / name)
    names = {int(kind): kind.name.lower() for kind in SemanticClass}
    names |= {ROUGH_GROUND: "rough_ground", LOW_PLANTS: "low_plants"}
    good = [int(kind) for kind, traits in TRAITS.items() if traits.traversable] + [LOW_PLANTS]
    lines = ["# Labels of the sequence; learning_map: 1 traversable, 2 not.", "labels:"]
    lines += [f"  {number}: {name}" for number, name in names.items()]
    lines += ["learning_map:"]
    lines += [f"  {number}: {1 if number in good else 2}" for number in names]
    atomic_io.write(folder / "andabata.yaml", ("\n".join(lines) + "\n").encode())
    atomic_io.write(folder / "traversable.txt", (" ".join(map(str, good)) + "\n").encode())


def scan_files(number: int, cloud: PointCloud, lidar_height: float) -> dict[str, bytes]:
    """Return the files of one labelled cloud by their paths in the folder of its sequence.

    Its points are in the frame of the levelled sensor.

    Raises:
        ValueError: If the cloud has no classes or no labels.
    """
    if cloud.classes is None or cloud.nontraversable is None:
        raise ValueError("classes: expected a labelled cloud, got one without labels")
    rough = np.isin(cloud.classes, _GROUND) & cloud.nontraversable
    low = np.isin(cloud.classes, _PLANTS) & ~cloud.nontraversable
    classes = np.where(rough, np.uint8(ROUGH_GROUND), cloud.classes)
    classes[low] = LOW_PLANTS
    points = cloud.points - np.array([0.0, 0.0, lidar_height], dtype=np.float32)
    scan = PointCloud(points, "sensor", classes=classes)
    return {
        f"velodyne/{number:06d}.bin": cloud_to_bytes(scan, "bin"),
        f"labels/{number:06d}.label": kitti_labels(scan),
    }


def end_sequence(folder: Path, poses: Sequence[Pose], lidar_height: float) -> None:
    """Write the sensor's poses in the map, twelve numbers a line, and an identity calibration."""
    lines = []
    for pose in poses:
        T_map_sensor = np.eye(4)
        c, s = np.cos(pose.yaw), np.sin(pose.yaw)
        T_map_sensor[:2, :2] = [[c, -s], [s, c]]
        T_map_sensor[:3, 3] = pose.position + np.array([0.0, 0.0, lidar_height])
        lines.append(" ".join(f"{number:.9g}" for number in T_map_sensor[:3].ravel()))
    atomic_io.write(folder / "poses.txt", ("\n".join(lines) + "\n").encode())
    calibration = "Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n"
    atomic_io.write(folder / "calib.txt", calibration.encode())
