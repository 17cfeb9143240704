"""Check of a laser's mounting against the ground in its clouds."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from andabata.records.frames.names import FrameError
from traversability.levelling import ground_plane, tilt_of

_CLOUDS = 5
"""Number of clouds that are needed to refuse a mounting."""

_ABOVE_LASER = 0.1
"""Height of the ground over the laser from which it is refused [m]."""

_MAX_HEIGHT_ERROR = 0.2
"""Largest height of the ground over its expected height without a remark [m]."""

_MAX_TILT = np.deg2rad(12.0)
"""Largest tilt of the ground against the plane of the wheels without a remark [rad]."""


class GroundCheck:
    """Compares the ground in the first clouds with the ground that the laser's mounting implies."""

    def __init__(
        self, laser_height: float, source: str = "robot.lidar_height", is_given: bool = True
    ) -> None:
        """Create a check without a cloud.

        Args:
            laser_height: Height of the laser above the ground [m].
            source: Name of the setting that implies where the ground is.
            is_given: True if the laser's height is given, not assumed.
        """
        self._height, self._source, self._is_given = laser_height, source, is_given
        self._heights: list[float] = []
        self._tilts: list[float] = []

    @property
    def is_done(self) -> bool:
        """True if enough clouds were added."""
        return len(self._heights) >= _CLOUDS

    def add(self, points: NDArray[np.float32], tilt: Rotation | None = None) -> None:
        """Add the ground of a cloud; one without a ground plane is skipped.

        Args:
            points: Points in the levelled base frame, or that fixed to the body [m], shape (n, 3).
            tilt: Rotation from the body to the frame; None for none.
        """
        plane = ground_plane(points)
        if plane is None:
            return
        normal, height = plane
        body_normal = normal if tilt is None else tilt.inv().apply(normal)
        self._heights.append(height)
        self._tilts.append(tilt_of(body_normal))

    def verify(self) -> None:
        """Check that the ground lies below the laser.

        Raises:
            FrameError: If it lies above in most clouds; the message names the option to give.
        """
        if self.is_done and _median(self._heights) > self._height + _ABOVE_LASER:
            raise FrameError(_upside_down(_median(self._heights), self._height))

    @property
    def remarks(self) -> list[str]:
        """Remarks on the laser's height and tilt, a line each."""
        lines = self._height_remarks
        if self._tilts and _median(self._tilts) > _MAX_TILT:
            lines.append(
                f"laser: the ground leans {np.rad2deg(_median(self._tilts)):.0f} degrees against "
                "the robot; is the laser mounted level? (--mounting laser=X,Y,Z,ROLL,PITCH,YAW)"
            )
        return lines

    @property
    def _height_remarks(self) -> list[str]:
        """Remarks on the laser's height, a line each."""
        height = _median(self._heights) if self._heights else 0.0
        if height > self._height + _ABOVE_LASER:
            return [_upside_down(height, self._height)]
        if abs(height) <= _MAX_HEIGHT_ERROR:
            return []
        side = "below" if height < 0 else "above"
        text = f"laser: the ground lies {abs(height):.1f} m {side} where {self._source} puts it"
        if self._is_given:
            real = self._height - height
            text += f": the laser is {real:.2f} m above it, not {self._height:.2f} m"
        return [text]


def _median(values: list[float]) -> float:
    """Return the median of some values."""
    return float(np.median(values))


def _upside_down(height: float, laser_height: float) -> str:
    """Return the text for a laser under the ground, both heights in the base frame [m]."""
    return (
        f"laser: the ground is above the laser ({height - laser_height:.1f} m): it hangs upside "
        "down, or its frame is another; give its mounting, as --mounting laser=0,0,"
        f"{laser_height:.2f},180,0,0"
    )
