"""The fast plant: four wheels that follow the ground, with slip and contact by the map."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.footing import quaternion, stand
from andabata.machine.kinematics import SkidSteer
from andabata.machine.pose import Pose
from andabata.machine.robot import RobotModel
from andabata.machine.senses import VehicleState, WheelSpeeds
from andabata.machine.vehicle import TICK
from worlds.truth import Reason
from worlds.world import Start, World

_SOLID = int(Reason.SOLID)


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
        self._motion = np.zeros(8)
        self._motion[:3] = start.x, start.y, start.yaw
        self._stamp = 0.0
        self._flags = np.zeros(2, dtype=np.bool_)
        self._drive(WheelSpeeds(0.0, 0.0), np.zeros((1, 2)))

    def drive(self, wheels: WheelSpeeds, ticks: int) -> NDArray[np.float64]:
        """Drive with commanded wheel speeds for a number of ticks; see ``Vehicle.drive``.

        Raises:
            ValueError: If a wheel speed is not a finite number.
        """
        if not (math.isfinite(wheels.left) and math.isfinite(wheels.right)):
            raise ValueError(f"wheels: expected finite speeds [rad/s], got {wheels}")
        self._stamp += ticks * TICK
        self._flags[0] = False
        return self._drive(wheels, self._rng.standard_normal((ticks, 2)))

    def _drive(self, wheels: WheelSpeeds, noise: NDArray[np.float64]) -> NDArray[np.float64]:
        """Move tick by tick; ``noise`` is standard normal, shape (ticks, 2)."""
        self._commanded = wheels
        rows = np.empty((len(noise), 9))
        rows[:, 7], rows[:, 8] = wheels.left, wheels.right
        config, truth = self._config, self._truth
        keep = math.exp(-TICK / config.slip_time)
        _drive(
            self._motion,
            np.array(self._kinematics.twist(wheels)),
            config.slip_sigma * math.sqrt(1 - keep * keep) * noise,
            np.array([keep, 1 - math.exp(-TICK / config.lag), config.max_climb, config.max_tilt]),
            np.array([self._robot.creep, self._robot.creep_slope, self._robot.pivot]),
            (self._heights, self._ground.cell, self._wheels),
            (truth.reason, truth.x_min, truth.y_min, truth.cell, self._outline),
            rows,
            self._flags,
        )
        self._last = rows[-1]
        return rows

    @property
    def state(self) -> VehicleState:
        """The true state."""
        collided, tipped = bool(self._flags[0]), bool(self._flags[1])
        return VehicleState(
            stamp=self._stamp,
            pose=Pose(self._last[:3], self._last[3:7]),
            linear=np.array([self._motion[3], self._motion[7], 0.0]) * (not collided),
            angular=np.array([0.0, 0.0, self._motion[4] * (not collided)]),
            wheels=self._commanded,
            collided=collided,
            tipped=tipped,
        )

    def close(self) -> None:
        """There is nothing to free."""


def _outline(robot: RobotModel, bumper: float) -> NDArray[np.float64]:
    """Return points along the body's outline [m], shape (k, 2), at most 9 cm apart."""
    half_x, half_y = robot.length / 2 - bumper, robot.width / 2 - bumper
    along, across = np.linspace(-half_x, half_x, 9), np.linspace(-half_y, half_y, 7)
    sides = [(x, y) for x in along for y in (-half_y, half_y)]
    ends = [(x, y) for y in across for x in (-half_x, half_x)]
    return np.array(sides + ends)


@njit(cache=True, nogil=True)
def _drive(motion, wanted, noise, limits, sliding, ground, contact, rows, flags):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Move for as many ticks as ``rows`` has.

    ``motion`` holds x, y, yaw, speed, yaw rate, the relative errors of the two and the sideways
    speed; ``flags`` tells whether the body touched something solid and whether it rolled over.
    """
    keep, blend, max_climb, max_tilt = limits
    creep, creep_slope, pivot = sliding
    heights, cell, wheels = ground
    moved = np.empty(3)
    height, roll, pitch = stand(heights, cell, motion, wheels)
    for k in range(len(rows)):
        for c in range(2):
            motion[5 + c] = keep * motion[5 + c] + noise[k, c]
            motion[3 + c] += blend * (wanted[c] * (1 + motion[5 + c]) - motion[3 + c])
        if flags[1]:
            motion[3] = motion[4] = 0.0
        if -pitch * np.sign(motion[3]) > max_climb:  # Nose up: the wheels spin.
            motion[3] = 0.0
        middle = motion[2] + motion[4] * TICK / 2
        motion[7] = -abs(motion[4]) * creep * np.tanh(np.sin(roll) / creep_slope)
        motion[7] -= motion[4] * pivot * np.sin(pitch)
        step, aside = motion[3] * TICK * np.cos(pitch), motion[7] * TICK * np.cos(roll)
        moved[0] = motion[0] + step * np.cos(middle) - aside * np.sin(middle)
        moved[1] = motion[1] + step * np.sin(middle) + aside * np.cos(middle)
        moved[2] = np.pi - (np.pi - motion[2] - motion[4] * TICK) % (2 * np.pi)
        if _touches(moved, contact):
            flags[0] = True
        else:
            motion[:3] = moved
        height, roll, pitch = stand(heights, cell, motion, wheels)
        flags[1] |= max(abs(roll), abs(pitch)) > max_tilt
        rows[k, 0], rows[k, 1], rows[k, 2] = motion[0], motion[1], height
        rows[k, 3:7] = quaternion(roll, pitch, motion[2])


@njit(cache=True, nogil=True)
def _touches(xy_yaw, contact):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return whether a point of the outline lies in a solid cell or beyond the map."""
    reason, x_min, y_min, cell, outline = contact
    c, s = np.cos(xy_yaw[2]), np.sin(xy_yaw[2])
    n, m = reason.shape
    for k in range(len(outline)):
        x = xy_yaw[0] + c * outline[k, 0] - s * outline[k, 1]
        y = xy_yaw[1] + s * outline[k, 0] + c * outline[k, 1]
        i, j = int(np.floor((x - x_min) / cell)), int(np.floor((y - y_min) / cell))
        if i < 0 or j < 0 or i >= n or j >= m or reason[i, j] == _SOLID:
            return True
    return False
