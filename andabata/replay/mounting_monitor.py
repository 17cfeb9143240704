"""Comparison of stated sensor mountings with gravity and with the ground, during a drive."""

from typing import Any

from scipy.spatial.transform import Rotation

from andabata.machine.pose import Pose
from andabata.navigation.cloud_assembly import CloudAssembler
from andabata.records.frames.extrinsics import Extrinsics
from andabata.records.remarks import Remarks
from traversability.cloud import PointCloud


class MountingMonitor:
    """Check of sensor mountings against gravity and the ground of the first clouds."""

    def __init__(
        self, extrinsics: Extrinsics, assembler: CloudAssembler | None, lidar_height: float
    ) -> None:
        """Prepare the check before the first control period.

        Args:
            extrinsics: Mounting of each sensor.
            assembler: Assembler of the clouds; None without clouds.
            lidar_height: Height above ground of a laser without a stated mounting,
                ``robot.lidar_height`` [m].
        """
        self._extrinsics, self._assembler, self._lidar_height = extrinsics, assembler, lidar_height
        self._ground = extrinsics.ground_check(lidar_height)
        self._checked: PointCloud | None = None

    def check(self, odometry: Pose) -> None:
        """Check the readings of a control period that the navigator has processed.

        Args:
            odometry: Pose of the robot in the frame of its clouds.

        Raises:
            FrameError: If gravity or the ground contradicts a stated mounting.
        """
        self._extrinsics.verify()
        assembler = self._assembler
        if assembler is None or assembler.cloud is None or assembler.cloud is self._checked:
            return
        if self._checked is None:  # The laser's frame is known since its first message.
            self._ground = self._extrinsics.ground_check(self._lidar_height)
        self._checked = assembler.cloud
        if not self._ground.is_done:
            self._check_ground(assembler, odometry)

    def _check_ground(self, assembler: CloudAssembler, odometry: Pose) -> None:
        """Compare the ground of the current cloud with the laser's mounting.

        Raises:
            FrameError: If the two contradict each other.
        """
        heading = Rotation.from_euler("Z", -odometry.yaw)
        tilt = heading * Rotation.from_quat(odometry.quaternion)
        self._ground.add(assembler.around(odometry).copy(), tilt)
        self._ground.verify()

    @property
    def frames(self) -> dict[str, Any]:
        """Mounting of each sensor, ready for JSON."""
        return self._extrinsics.as_dict(self._lidar_height)

    def rotation(self, sensor: str) -> Rotation | None:
        """Return the rotation from a sensor's axes to the robot's; None for one that is unknown."""
        transform = self.frames.get(sensor, {}).get("transform")
        return None if transform is None else Rotation.from_euler("ZYX", transform[:2:-1])

    def add_remarks(self, remarks: Remarks) -> None:
        """Add what a user should know about the mountings."""
        for text in (*self._extrinsics.remarks, *self._ground.remarks):
            sensor, _, remark = text.partition(": ")
            remarks.note(sensor, remark)
        for text in self._extrinsics.failures:
            sensor, _, remark = text.partition(": ")
            remarks.fail(sensor, remark)
