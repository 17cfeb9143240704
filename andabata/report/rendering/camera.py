"""Pinhole camera in the map: rays of its pixels, and pixels of points."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Camera(NamedTuple):
    """A pinhole camera in the map.

    Attributes:
        place: Position [m], shape (3,).
        axes: Rows: unit vectors to the right, down and forward, shape (3, 3).
        width: Width of the picture [pixels].
        height: Height of the picture [pixels].
        focal: Focal length over the width of the picture.
    """

    place: NDArray[np.float64]
    axes: NDArray[np.float64]
    width: int
    height: int
    focal: float = 0.9

    @classmethod
    def looking_at(
        cls,
        place: NDArray[np.float64],
        target: NDArray[np.float64],
        size: tuple[int, int],
        focal: float = 0.9,
    ) -> "Camera":
        """Return an upright camera that has a point in the middle of its picture.

        Args:
            place: Position of the camera [m], shape (3,).
            target: Position of the point, not straight above or below [m], shape (3,).
            size: Width and height of the picture [pixels].
            focal: Focal length over the width of the picture.
        """
        forward = (target - place) / np.linalg.norm(target - place)
        right = np.cross(forward, [0.0, 0.0, 1.0])
        right /= np.linalg.norm(right)
        return cls(place, np.stack([right, np.cross(forward, right), forward]), *size, focal)

    def sampled(self, samples: int) -> "Camera":
        """Return the camera with a number of samples along either edge of a pixel."""
        return self._replace(width=samples * self.width, height=samples * self.height)

    def directions(self) -> NDArray[np.float64]:
        """Return the unit vector of each pixel's ray, row by row, shape (height * width, 3)."""
        scale = self.focal * self.width
        u = (np.arange(self.width) + 0.5 - self.width / 2) / scale
        v = (np.arange(self.height) + 0.5 - self.height / 2) / scale
        right, down, forward = self.axes
        found = u[None, :, None] * right + v[:, None, None] * down + forward
        found /= np.sqrt(1.0 + u[None, :, None] ** 2 + v[:, None, None] ** 2)
        return np.asarray(found.reshape(-1, 3))

    def project(self, points: NDArray[np.floating]) -> NDArray[np.float64]:
        """Return column, row [pixels] and depth along the view [m] of points, shape (n, 3).

        All three are NaN for points behind the camera.

        Args:
            points: Points in the map [m], shape (n, 3).
        """
        x, y, z = self.axes @ (points.astype(np.float64) - self.place).T
        depth = np.where(z > 0.1, z, np.nan)
        scale = self.focal * self.width / depth
        return np.stack([self.width / 2 + scale * x, self.height / 2 + scale * y, depth], axis=1)

    def pixels(
        self, lengths: NDArray[np.float64] | float, depths: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return how many pixels lengths [m] across the view take up at depths [m]."""
        return np.asarray(self.focal * self.width * lengths / depths)
