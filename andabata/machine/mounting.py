"""Mounting of a sensor on the robot."""

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field
from scipy.spatial.transform import Rotation


class Mounting(BaseModel):
    """Pose of a sensor on the robot: sensor coordinates to ``base_footprint``.

    Attributes:
        x: Position forward of the base [m].
        y: Position to the left of the base [m].
        z: Height above the base plane [m].
        roll: Rotation about x [rad].
        pitch: Rotation about y [rad].
        yaw: Rotation about z [rad].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    x: float = Field(default=0.0, ge=-10, le=10)
    y: float = Field(default=0.0, ge=-10, le=10)
    z: float = Field(default=0.72, ge=0, le=10)
    roll: float = Field(default=0.0, ge=-np.pi, le=np.pi)
    pitch: float = Field(default=0.0, ge=-np.pi, le=np.pi)
    yaw: float = Field(default=0.0, ge=-np.pi, le=np.pi)

    @property
    def rotation(self) -> Rotation:
        """Rotation from sensor to base (intrinsic z-y-x)."""
        return Rotation.from_euler("ZYX", [self.yaw, self.pitch, self.roll])

    def place(self, points: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return sensor points in ``base_footprint`` [m], shape (n, 3)."""
        R_base_sensor = self.rotation.as_matrix().astype(np.float32)
        shift = np.array([self.x, self.y, self.z], dtype=np.float32)
        return points @ R_base_sensor.T + shift
