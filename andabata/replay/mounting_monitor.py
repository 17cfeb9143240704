"""Watches a replay or a live robot for what its senses say of their own mountings."""

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from andabata.machine.pose import Pose
from andabata.navigation.cloud_assembly import CloudAssembler
from andabata.records.mounts import Mounts
from andabata.records.remarks import Remarks


class MountingMonitor:
    """Checks gravity, and the ground of the first clouds, as they come."""

    def __init__(self, mounts: Mounts, assembler: CloudAssembler | None, height: float) -> None:
        """Begin before the first period.

        Args:
            mounts: Where the senses sit.
            assembler: Puts the clouds together; None without any.
            height: Height of a laser whose place nothing tells, ``robot.lidar_height`` [m].
        """
        self._mounts, self._assembler, self._height = mounts, assembler, height
        self._ground = mounts.ground_check(height)
        self._last: object = None

    def watch(self, odometry: Pose) -> None:
        """Look at what came in a control period, after the navigator has taken it in.

        Args:
            odometry: Pose of the robot in the frame of its clouds.

        Raises:
            FrameError: If gravity or the ground contradicts where a sense is said to sit.
        """
        self._mounts.verify()
        assembler = self._assembler
        if assembler is None or assembler.cloud is None or assembler.cloud is self._last:
            return
        if self._last is None:  # The first message has told the laser's frame.
            self._ground = self._mounts.ground_check(self._height)
        self._last = assembler.cloud
        if self._ground.is_done:
            return
        level = Rotation.from_euler("Z", -odometry.yaw)
        tilt = level * Rotation.from_quat(odometry.quaternion)
        self._ground.look(np.array(assembler.around(odometry)), tilt)
        self._ground.verify()

    @property
    def frames(self) -> dict[str, Any]:
        """Where senses sit, ready for JSON."""
        return self._mounts.as_dict(self._height)

    def remark(self, remarks: Remarks) -> None:
        """Note what a person should know of where senses sit."""
        for text in (*self._mounts.remarks, *self._ground.remarks):
            sense, _, said = text.partition(": ")
            remarks.note(sense, said)
