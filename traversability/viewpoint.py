"""Pose that a cloud was measured from, as PCD files hold it beside the points."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from traversability.cloud import PointCloud

_NEARER = 1.5
"""Factor by which points have to be nearer to one origin than to another to belong to it
(assumption): a laser's returns are densest around it."""

_BLIND = 0.1
"""Distance from a sensor within which it measures nothing [m] (assumption)."""


@dataclass(frozen=True)
class Viewpoint:
    """Pose of a sensor in the coordinates of its cloud.

    Attributes:
        position: Position of the sensor [m], shape (3,).
        rotation: Rotation from the sensor's axes to those of the coordinates.
    """

    position: NDArray[np.float64]
    rotation: Rotation

    @property
    def is_origin(self) -> bool:
        """True if the coordinates are the sensor's own."""
        return not self.position.any() and self.rotation.magnitude() < 1e-9

    @property
    def numbers(self) -> tuple[float, ...]:
        """Position [m] and quaternion w, x, y, z, as PCD has them."""
        x, y, z, w = self.rotation.as_quat().tolist()
        return (*self.position.tolist(), w, x, y, z)

    def seen_from(self, cloud: PointCloud) -> PointCloud:
        """Return a cloud in the sensor's frame: the sensor is its origin, x forward, z up."""
        moved = cloud.coordinates() - self.position
        points = self.rotation.inv().apply(moved).astype(np.float32)
        return replace(cloud, points=points, origin=np.zeros(3))

    def contradicts(self, cloud: PointCloud) -> bool:
        """Return True if the points are seen from their origin and not from this position.

        PCL says that the pose is in the coordinates of the points, but some programs (pcl_ros)
        write points in the sensor's own frame beside the pose of the sensor in another.
        """
        there = _distances(cloud, self.position)
        here = _distances(cloud, np.zeros(3))
        # A sensor sees nothing in its own place; the origin of a map may be among its points.
        return bool(here.min() > _BLIND and _mean(there) > _NEARER * _mean(here))


def _distances(cloud: PointCloud, position: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distances of the points from a position [m], shape (n,)."""
    return np.asarray(np.linalg.norm(cloud.coordinates() - position, axis=1))


def _mean(distances: NDArray[np.float64]) -> float:
    """Return the geometric mean of distances [m], to which near points matter most."""
    return float(np.exp(np.log(np.maximum(distances, _BLIND)).mean()))
