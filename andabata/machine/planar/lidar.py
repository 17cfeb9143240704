"""Planar lasers as data: field of view, resolution, range and pose on the robot.

The label ``fov|resolution|range|x`` is that of Zhang et al. (arXiv 2010.10209, section IV-C); its
y axis is the heading, which is x here.
"""

import math
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

_FULL = 360.0


class PlanarLidarConfig(BaseModel):
    """A laser that scans a horizontal plane.

    Attributes:
        fov_deg: Field of view, centred on the laser's heading [deg].
        resolution_deg: Angle between two beams [deg].
        max_range: Range beyond which a beam returns nothing [m].
        x: Position of the laser before the robot's centre [m].
        y: Position of the laser left of the robot's centre [m].
        yaw_deg: Heading of the laser from that of the robot, counter-clockwise [deg].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    fov_deg: float = Field(default=_FULL, gt=0, le=_FULL)
    resolution_deg: float = Field(default=1 / 3, gt=0, le=_FULL)
    max_range: float = Field(default=5.0, gt=0, le=100)
    x: float = Field(default=0.0, ge=-1, le=1)
    y: float = Field(default=0.0, ge=-1, le=1)
    yaw_deg: float = Field(default=0.0, ge=-_FULL, le=_FULL)

    @property
    def count(self) -> int:
        """Number of beams: both edges of a field of view, but a full turn closes on itself."""
        steps = math.floor(self.fov_deg / self.resolution_deg + 1e-6)
        return max(steps, 1) if self.fov_deg == _FULL else steps + 1

    @property
    def bearings(self) -> NDArray[np.float64]:
        """Bearing of each beam from the laser's heading, counter-clockwise [rad], shape (b,)."""
        step = math.radians(self.resolution_deg)
        first = -math.pi if self.fov_deg == _FULL else -step * (self.count - 1) / 2
        return np.asarray(first + step * np.arange(self.count), dtype=np.float64)

    @property
    def label(self) -> str:
        """The laser as ``fov|resolution|range|x``, and ``|y|yaw`` where it is not in the middle."""
        values = [self.fov_deg, self.resolution_deg, self.max_range, self.x, self.y, self.yaw_deg]
        while len(values) > 4 and values[-1] == 0:
            values.pop()
        return "|".join(f"{value:.4g}" for value in values)

    @classmethod
    def parse(cls, label: str) -> Self:
        """Return the laser of a label, or of a name in ``PLANAR_LIDARS``.

        Raises:
            ValueError: If the label is no such thing, or a number is out of its bounds.
        """
        if label in PLANAR_LIDARS:
            return cls.model_validate(PLANAR_LIDARS[label].model_dump())
        names = ("fov_deg", "resolution_deg", "max_range", "x", "y", "yaw_deg")
        try:
            values = [float(part) for part in label.split("|")]
        except ValueError:
            values = []
        if not 3 <= len(values) <= len(names):
            raise ValueError(
                f"lidar: expected FOV|RESOLUTION|RANGE[|X[|Y[|YAW]]] in degrees and metres, or one "
                f"of {', '.join(PLANAR_LIDARS)}, got {label!r}"
            )
        return cls.model_validate(dict(zip(names, values, strict=False)))


def _laser(fov: float, resolution: float, max_range: float, x: float = 0.0) -> PlanarLidarConfig:
    """Return a laser in the middle of the robot, or before it."""
    return PlanarLidarConfig(fov_deg=fov, resolution_deg=resolution, max_range=max_range, x=x)


TRAINING_LIDAR = PlanarLidarConfig()
"""The laser that the paper trains with: 1080 beams all around, 5 m."""

PLANAR_LIDARS = {
    "full-fine": _laser(360, 0.5, 10),
    "hokuyo-270": _laser(270, 0.25, 30),
    "wide-270": _laser(270, 0.5, 10),
    "front-220": _laser(220, 1, 5),
    "front-180": _laser(180, 1, 10),
    "ten-beams": _laser(180, 20, 10),
    "ten-beams-forward": _laser(180, 20, 10, 0.05),
}
"""The seven lasers of the comparison by name, none of them trained with.

``hokuyo-270``, ``ten-beams`` and ``ten-beams-forward`` are in the paper; the labels of the other
four are in a figure only (assumption: fields of view and resolutions that are common).
"""
