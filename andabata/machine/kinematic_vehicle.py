"""The fast plant: four wheels that follow the ground, with slip and contact by the map."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.clock import TICK
from andabata.machine.kinematics import SkidSteer
from andabata.machine.pose import Pose
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import VehicleState, WheelSpeeds
from andabata.machine.wheel_contact import quaternion, stand
from terrain.kernel import kernel
from worlds.truth import Reason, TraversabilityMap
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
        self._numbers = plant_numbers(robot, self._config)
        self._contact = contact_map(self._truth, self._numbers.outline)
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
        truth, numbers = self._truth, self._numbers
        drive_ticks(
            self._motion,
            np.array(self._kinematics.twist(wheels)),
            numbers.slip * noise,
            numbers.limits,
            numbers.sliding,
            (self._heights, self._ground.cell, numbers.wheels),
            (self._contact, truth.x_min, truth.y_min, truth.cell, numbers.outline),
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


_ROOMY, _NEAR, _HARD, _LOW = range(4)


def contact_map(truth: TraversabilityMap, outline: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Return where a body can touch something, and where a cell is solid.

    Args:
        truth: The map.
        outline: As in ``PlantNumbers``.

    Returns:
        Of each cell: 0 if a body in its middle touches nothing, 1 if it might, 2 if the cell is
        solid, 3 if it is so low that only wheels strike it, uint8, shape (n, m).
    """
    room = float(np.hypot(outline[:, 0], outline[:, 1]).max()) + 2 * truth.cell
    near = np.where(truth.clearance > room, _ROOMY, _NEAR).astype(np.uint8)
    border = math.ceil(room / truth.cell)
    inside = np.zeros(near.shape, dtype=np.bool_)
    inside[border:-border, border:-border] = True
    near[~inside] = _NEAR
    near[truth.reason == Reason.SOLID] = _HARD
    near[truth.reason == Reason.LOW] = _LOW
    return near


class PlantNumbers(NamedTuple):
    """Numbers of the plant as compiled code takes them.

    Attributes:
        limits: Share of the slip that stays from tick to tick, share of a commanded change that is
            made in one, steepest climb and most tilt [rad].
        sliding: Creep, its slope and the pivot of ``RobotModel``.
        wheels: Where they touch the ground [m], shape (4, 2).
        outline: Points of the body [m], and whether each is a wheel's, 0 or 1, shape (k, 3).
        slip: Standard deviation of what a tick adds to the slip.
    """

    limits: NDArray[np.float64]
    sliding: NDArray[np.float64]
    wheels: NDArray[np.float64]
    outline: NDArray[np.float64]
    slip: float


def plant_numbers(robot: RobotModel, config: KinematicConfig) -> PlantNumbers:
    """Return the numbers of a robot's plant."""
    keep = math.exp(-TICK / config.slip_time)
    corners = np.array([[x, y] for x in (1, -1) for y in (1, -1)]) / 2
    return PlantNumbers(
        limits=np.array(
            [keep, 1 - math.exp(-TICK / config.lag), config.max_climb, config.max_tilt]
        ),
        sliding=np.array([robot.creep, robot.creep_slope, robot.pivot]),
        wheels=corners * [robot.wheelbase, robot.track],
        outline=_outline(robot, config.bumper),
        slip=config.slip_sigma * math.sqrt(1 - keep * keep),
    )


def _outline(robot: RobotModel, bumper: float) -> NDArray[np.float64]:
    """Return points of the body, at most 9 cm apart, and of its wheels; see ``PlantNumbers``."""
    half_x, half_y = robot.length / 2 - bumper, robot.width / 2 - bumper
    along, across = np.linspace(-half_x, half_x, 9), np.linspace(-half_y, half_y, 7)
    sides = [(x, y, 0.0) for x in along for y in (-half_y, half_y)]
    ends = [(x, y, 0.0) for y in across for x in (-half_x, half_x)]
    # A wheel strikes a low thing with its lower half.
    reach = robot.wheelbase / 2 + robot.wheel_radius * np.array([-0.7, 0.0, 0.7])
    wheels = [
        (side * x, y, 1.0)
        for x in reach
        for side in (-1, 1)
        for y in (-robot.track / 2, robot.track / 2)
    ]
    return np.array(sides + ends + wheels)


@kernel
def drive_ticks(motion, wanted, noise, limits, sliding, ground, contact, rows, flags):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Move for as many ticks as ``rows`` has.

    ``motion`` holds x, y, yaw, speed, yaw rate, the relative errors of the two and the sideways
    speed; ``flags`` tells whether the body touched something solid and whether it rolled over.
    """
    keep, blend, max_climb, max_tilt = limits
    creep, creep_slope, pivot = sliding
    heights, cell, wheels = ground
    near, x_min, y_min, raster, outline = contact
    cosine, sine = np.cos(motion[2]), np.sin(motion[2])
    height, roll, pitch = stand(heights, cell, motion[0], motion[1], cosine, sine, wheels)
    for k in range(len(rows)):
        for c in range(2):
            motion[5 + c] = keep * motion[5 + c] + noise[k, c]
            motion[3 + c] += blend * (wanted[c] * (1 + motion[5 + c]) - motion[3 + c])
        if flags[1]:
            motion[3] = motion[4] = 0.0
        if -pitch * np.sign(motion[3]) > max_climb:  # Nose up: the wheels spin.
            motion[3] = 0.0
        middle = motion[2] + motion[4] * TICK / 2
        step, aside = motion[3] * TICK, 0.0
        if roll != 0.0 or pitch != 0.0:
            motion[7] = -abs(motion[4]) * creep * np.tanh(np.sin(roll) / creep_slope)
            motion[7] -= motion[4] * pivot * np.sin(pitch)
            step, aside = step * np.cos(pitch), motion[7] * TICK * np.cos(roll)
        else:
            motion[7] = 0.0
        c, s = np.cos(middle), np.sin(middle)
        x = motion[0] + step * c - aside * s
        y = motion[1] + step * s + aside * c
        yaw = motion[2] + motion[4] * TICK
        if not -np.pi < yaw <= np.pi:
            yaw = np.pi - (np.pi - yaw) % (2 * np.pi)
        c, s = np.cos(yaw), np.sin(yaw)
        if _touches(x, y, c, s, near, x_min, y_min, raster, outline):
            flags[0] = True
        else:
            motion[0], motion[1], motion[2], cosine, sine = x, y, yaw, c, s
        height, roll, pitch = stand(heights, cell, motion[0], motion[1], cosine, sine, wheels)
        flags[1] |= max(abs(roll), abs(pitch)) > max_tilt
        rows[k, 0], rows[k, 1], rows[k, 2] = motion[0], motion[1], height
        rows[k, 3], rows[k, 4], rows[k, 5], rows[k, 6] = quaternion(roll, pitch, motion[2])


@kernel
def _touches(x0, y0, c, s, near, x_min, y_min, cell, outline):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return whether a point of the outline lies in a solid cell or beyond the map."""
    n, m = near.shape
    i, j = int(np.floor((x0 - x_min) / cell)), int(np.floor((y0 - y_min) / cell))
    if 0 <= i < n and 0 <= j < m and near[i, j] == _ROOMY:
        return False
    for k in range(len(outline)):
        x = x0 + c * outline[k, 0] - s * outline[k, 1]
        y = y0 + s * outline[k, 0] + c * outline[k, 1]
        i, j = int(np.floor((x - x_min) / cell)), int(np.floor((y - y_min) / cell))
        if i < 0 or j < 0 or i >= n or j >= m or near[i, j] == _HARD:
            return True
        if near[i, j] == _LOW and outline[k, 2] > 0.0:
            return True
    return False
