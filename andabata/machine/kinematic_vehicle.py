"""The fast plant: four wheels that follow the ground, with slip and contact by the map."""

import math

import numpy as np
from numba import njit
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.kinematics import SkidSteer
from andabata.machine.pose import Pose
from andabata.machine.robot import RobotModel
from andabata.machine.senses import VehicleState, WheelSpeeds
from worlds.truth import Reason
from worlds.world import Start, World


class KinematicConfig(BaseModel):
    """Numbers of the terrain-following plant, as measured in the bullet plant.

    Attributes:
        lag: Time constant from commanded to actual twist [s].
        slip_sigma: Standard deviation of the relative error of speed and yaw rate.
        slip_time: Correlation time of that error [s].
        max_climb: Steepest slope that the body climbs [rad].
        max_tilt: Roll or pitch beyond which it rolls over [rad].
        bumper: How far the outline of the body is shrunk for contact with the map's raster [m].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    lag: float = Field(default=0.08, gt=0)
    slip_sigma: float = Field(default=0.06, ge=0, le=1)
    slip_time: float = Field(default=1.0, gt=0)
    max_climb: float = Field(default=np.deg2rad(35.0), gt=0)
    max_tilt: float = Field(default=np.deg2rad(40.0), gt=0)
    bumper: float = Field(default=0.04, ge=0)


class KinematicVehicle:
    """A body that keeps its four wheels on the ground and stops at solid things."""

    def __init__(
        self,
        world: World,
        robot: RobotModel,
        rng: np.random.Generator,
        config: KinematicConfig | None = None,
    ) -> None:
        """Stand in a world.

        Args:
            world: Ground and true map.
            robot: The body.
            rng: Wheel slip.
            config: Lag, slip and limits.
        """
        self._ground, self._truth = world.ground, world.truth
        self._kinematics = SkidSteer(robot)
        self._config = config or KinematicConfig()
        self._robot, self._rng = robot, rng
        wheels = np.array([[x, y] for x in (1, -1) for y in (1, -1)]) / 2
        self._wheels = wheels * [robot.wheelbase, robot.track]
        self._outline = _outline(robot, self._config.bumper)
        self._heights = np.ascontiguousarray(self._ground.heights)
        self.place(Start(0.0, 0.0, 0.0))

    def place(self, start: Start) -> None:
        """Put the body down at rest; its time becomes zero."""
        self._xy_yaw = np.array([start.x, start.y, start.yaw])
        self._twist = np.zeros(2)
        self._slip = np.zeros(2)
        self._stamp = 0.0
        self._collided = self._tipped = False
        self._commanded = WheelSpeeds(0.0, 0.0)
        self._settle()

    def advance(self, wheels: WheelSpeeds, duration: float) -> None:
        """Drive with commanded wheel speeds for a duration [s].

        Raises:
            ValueError: If a wheel speed is not a finite number.
        """
        if not (math.isfinite(wheels.left) and math.isfinite(wheels.right)):
            raise ValueError(f"wheels: expected finite speeds [rad/s], got {wheels}")
        config = self._config
        self._commanded = wheels
        self._stamp += duration
        speed, yaw_rate = self._kinematics.twist(wheels)
        keep = math.exp(-duration / config.slip_time)
        noise = config.slip_sigma * math.sqrt(1 - keep * keep) * self._rng.standard_normal(2)
        self._slip = keep * self._slip + noise
        blend = 1 - math.exp(-duration / config.lag)
        wanted = np.array([speed, yaw_rate]) * (1 + self._slip)
        self._twist = self._twist + blend * (wanted - self._twist)
        if self._tipped:
            self._twist = np.zeros(2)
            return
        pitch = self._tilt[1]
        if -pitch * np.sign(self._twist[0]) > config.max_climb:  # Nose up: wheels spin.
            self._twist[0] = 0.0
        moved = _moved(self._xy_yaw, self._twist, math.cos(pitch), duration)
        self._collided = bool(
            _touches(
                moved,
                self._outline,
                self._truth.reason,
                self._truth.x_min,
                self._truth.y_min,
                self._truth.cell,
                int(Reason.SOLID),
            )
        )
        if not self._collided:
            self._xy_yaw = moved
        self._settle()

    def _settle(self) -> None:
        """Stand on the ground under the four wheels."""
        height, roll, pitch = _stand(self._heights, self._ground.cell, self._xy_yaw, self._wheels)
        self._height, self._tilt = height, (roll, pitch)
        self._tipped |= max(abs(roll), abs(pitch)) > self._config.max_tilt

    @property
    def state(self) -> VehicleState:
        """The true state."""
        x, y, yaw = self._xy_yaw
        moving = not self._collided
        return VehicleState(
            stamp=self._stamp,
            pose=Pose(np.array([x, y, self._height]), _quaternion(*self._tilt, yaw)),
            linear=np.array([self._twist[0] * moving, 0.0, 0.0]),
            angular=np.array([0.0, 0.0, self._twist[1] * moving]),
            wheels=self._commanded,
            collided=self._collided,
            tipped=self._tipped,
        )

    def close(self) -> None:
        """There is nothing to free."""


def _outline(robot: RobotModel, bumper: float) -> np.ndarray:
    """Return points along the body's outline [m], shape (k, 2), at most 9 cm apart."""
    half_x, half_y = robot.length / 2 - bumper, robot.width / 2 - bumper
    along, across = np.linspace(-half_x, half_x, 9), np.linspace(-half_y, half_y, 7)
    sides = [(x, y) for x in along for y in (-half_y, half_y)]
    ends = [(x, y) for y in across for x in (-half_x, half_x)]
    return np.array(sides + ends)


@njit(cache=True, nogil=True)
def _moved(xy_yaw, twist, cos_pitch, duration):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return x, y [m] and yaw [rad] after a short drive."""
    yaw = xy_yaw[2] + twist[1] * duration
    middle = xy_yaw[2] + twist[1] * duration / 2
    step = twist[0] * duration * cos_pitch
    moved = np.empty(3)
    moved[0] = xy_yaw[0] + step * np.cos(middle)
    moved[1] = xy_yaw[1] + step * np.sin(middle)
    moved[2] = np.pi - (np.pi - yaw) % (2 * np.pi)
    return moved


@njit(cache=True, nogil=True)
def _touches(xy_yaw, outline, reason, x_min, y_min, cell, solid):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return whether a point of the outline lies in a solid cell or beyond the map."""
    c, s = np.cos(xy_yaw[2]), np.sin(xy_yaw[2])
    n, m = reason.shape
    for k in range(len(outline)):
        x = xy_yaw[0] + c * outline[k, 0] - s * outline[k, 1]
        y = xy_yaw[1] + s * outline[k, 0] + c * outline[k, 1]
        i, j = int(np.floor((x - x_min) / cell)), int(np.floor((y - y_min) / cell))
        if i < 0 or j < 0 or i >= n or j >= m or reason[i, j] == solid:
            return True
    return False


@njit(cache=True, nogil=True)
def _stand(heights, cell, xy_yaw, wheels):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return height [m], roll and pitch [rad] of a body on four wheels (least-squares plane)."""
    c, s = np.cos(xy_yaw[2]), np.sin(xy_yaw[2])
    nx, ny = heights.shape
    mean, rise_x, rise_y, square_x, square_y = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(len(wheels)):
        x = xy_yaw[0] + c * wheels[k, 0] - s * wheels[k, 1]
        y = xy_yaw[1] + s * wheels[k, 0] + c * wheels[k, 1]
        u = min(max(x / cell + (nx - 1) / 2, 0.0), nx - 1.0)
        v = min(max(y / cell + (ny - 1) / 2, 0.0), ny - 1.0)
        i, j = min(int(u), nx - 2), min(int(v), ny - 2)
        u, v = u - i, v - j
        if u + v <= 1.0:
            z = heights[i, j] + u * (heights[i + 1, j] - heights[i, j])
            z += v * (heights[i, j + 1] - heights[i, j])
        else:
            z = heights[i + 1, j + 1] + (1 - u) * (heights[i, j + 1] - heights[i + 1, j + 1])
            z += (1 - v) * (heights[i + 1, j] - heights[i + 1, j + 1])
        mean += z / len(wheels)
        rise_x += z * wheels[k, 0]
        rise_y += z * wheels[k, 1]
        square_x += wheels[k, 0] ** 2
        square_y += wheels[k, 1] ** 2
    slope_x, slope_y = rise_x / square_x, rise_y / square_y
    pitch = -np.arctan(slope_x)
    return mean, np.arctan(slope_y * np.cos(pitch)), pitch


@njit(cache=True, nogil=True)
def _quaternion(roll, pitch, yaw):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return the quaternion x, y, z, w of roll, pitch, yaw [rad]."""
    cr, sr = np.cos(roll / 2), np.sin(roll / 2)
    cp, sp = np.cos(pitch / 2), np.sin(pitch / 2)
    cy, sy = np.cos(yaw / 2), np.sin(yaw / 2)
    return np.array(
        [
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        ]
    )
