"""Fast plant: a body whose wheels follow the terrain, with slip, and contact by the true map.

The same compiled step drives a single robot here and the robots of the planar environment.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.clock import TICK, TICK_HZ
from andabata.machine.kinematics import SkidSteer
from andabata.machine.planar.mover_contact import Contact, touches_mover, walker_contact
from andabata.machine.pose import Pose
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import VehicleState, WheelSpeeds
from andabata.machine.wheel_contact import fit_wheel_plane, quaternion
from terrain.kernel import kernel
from worlds.caps import low_caps
from worlds.drag import PERIOD, DragMap, drag_at, drag_map
from worlds.rooms.mover_motion import Movers
from worlds.traversability_map import Reason, TraversabilityMap
from worlds.walking import WalkerTrack
from worlds.world import Start, World

_X, _Y, _YAW, _SPEED, _YAW_RATE, _SPEED_SLIP, _YAW_RATE_SLIP, _LATERAL_SPEED = range(8)
"""Columns of the motion state: x, y [m], yaw [rad], speed [m/s], yaw rate [rad/s], relative errors
of these two, sideways speed [m/s]."""

_COLLIDED, _TIPPED = range(2)
"""Columns of the flags."""

_HEIGHT, _QUATERNION = 2, 3
"""Columns of a row of the track after x and y: height [m], first of the quaternion x, y, z, w."""

_LEFT, _RIGHT = 7, 8
"""Columns of a row of the track: actual wheel speeds [rad/s]."""

_IS_WHEEL = 2
"""Column of the outline after x and y: 1 for a point of a wheel, 0 for one of the body."""

_GRAVITY = 9.81
"""Standard gravity [m/s2]."""

_CLEAR, _NEAR, _SOLID, _LOW = range(4)
"""States of a cell of the contact map; see ``contact_map``."""

WheelGround = tuple[NDArray[np.float32], float, NDArray[np.float64]]
"""Heights of the ground's nodes [m], shape (nx, ny), distance of two nodes [m], and contact points
of the wheels [m], shape (4, 2). A plain tuple: numba takes a named one in twice the time."""

ContactMap = tuple[NDArray[np.uint8], float, float, float, NDArray[np.float64]]
"""Cells as ``contact_map`` returns them, least x, least y and width of a cell [m], and points of
the body as in ``PlantParameters``."""

PlantDrag = tuple[NDArray[np.uint8], float, float, float]
"""Values of a ``DragMap`` in their order."""


class KinematicConfig(BaseModel):
    """Parameters of the terrain-following plant, as measured in the bullet plant.

    Attributes:
        time_constant: Time constant from commanded to actual twist [s].
        slip_sigma: Standard deviation of the relative error of speed and yaw rate.
        slip_time: Correlation time of that error [s].
        max_climb: Steepest slope that the body climbs [rad]; the drag of plants takes of the grip
            that it stands for.
        max_tilt: Roll or pitch beyond which the body rolls over [rad].
        outline_margin: Distance by which the outline of the body is shrunk for contact with the
            cells of the true map [m].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    time_constant: float = Field(default=0.08, gt=0)
    slip_sigma: float = Field(default=0.06, ge=0, le=1)
    slip_time: float = Field(default=1.0, gt=0)
    max_climb: float = Field(default=np.deg2rad(35.0), gt=0)
    max_tilt: float = Field(default=np.deg2rad(40.0), gt=0)
    outline_margin: float = Field(default=0.04, ge=0)


class KinematicVehicle:
    """Body that keeps its four wheels on the ground and stops at solid objects."""

    def __init__(
        self,
        world: World,
        robot: RobotModel,
        rng: np.random.Generator,
        config: KinematicConfig | None = None,
    ) -> None:
        """Place a robot at the origin of a world.

        Args:
            world: Ground and true map.
            robot: Parameters of the body.
            rng: Source of wheel slip.
            config: Response, slip and limits.
        """
        self._kinematics = SkidSteer(robot)
        self._config = config or KinematicConfig()
        self._robot, self._rng = robot, rng
        self._parameters = plant_parameters(robot, self._config)
        ground, truth, outline = world.ground, world.truth, self._parameters.outline
        heights = np.ascontiguousarray(ground.heights)
        self._ground: WheelGround = (heights, ground.cell, self._parameters.wheels)
        cells = contact_map(truth, outline)
        # Of a low object wheels strike what rises more than a step, and climb its foot.
        cells[(cells == _LOW) & ~low_caps(world)] = _NEAR
        self._contact: ContactMap = (cells, truth.x_min, truth.y_min, truth.cell, outline)
        drag = drag_map(world)
        self._drag: PlantDrag = (drag.force, drag.x_min, drag.y_min, drag.cell)
        self._last = np.zeros(9)
        self.place(Start(0.0, 0.0, 0.0))

    def place(self, start: Start) -> None:
        """Put the body down at rest and set its time to zero."""
        self._motion = np.zeros(8)
        self._motion[:3] = start.x, start.y, start.yaw
        self._ticks = 0
        self._flags = np.zeros(2, dtype=np.bool_)
        self._touched = Contact.NONE
        self._drive(WheelSpeeds(0.0, 0.0), np.zeros((1, 2)))

    def drive(
        self, wheels: WheelSpeeds, ticks: int, walkers: WalkerTrack | None = None
    ) -> NDArray[np.float64]:
        """Drive with commanded wheel speeds for a number of ticks; see ``Vehicle.drive``.

        Raises:
            ValueError: If a wheel speed is not a finite number.
        """
        if not (math.isfinite(wheels.left) and math.isfinite(wheels.right)):
            raise ValueError(f"wheels: expected finite speeds [rad/s], got {wheels}")
        self._ticks += ticks
        self._flags[_COLLIDED] = False
        self._touched = Contact.NONE
        noise = self._rng.standard_normal((ticks, 2))
        if walkers is None:
            rows = self._drive(wheels, noise)
        else:
            rows = self._drive_among(wheels, noise, walkers.movers)
        return rows

    def _drive_among(
        self, wheels: WheelSpeeds, noise: NDArray[np.float64], movers: Movers
    ) -> NDArray[np.float64]:
        """Move tick by tick among walkers, which are where they are at the end of each tick."""
        half = self._robot.length / 2, self._robot.width / 2
        rows = np.empty((len(noise), 9))
        for k in range(len(noise)):
            before, last = self._motion[: _YAW + 1].copy(), self._last.copy()
            rows[k] = self._drive(wheels, noise[k : k + 1])[0]
            x, y, yaw = self._motion[: _YAW + 1].tolist()
            if not touches_mover(x, y, yaw, *half, k, movers):
                continue
            # As at what stands: a body that would touch somebody stays where it is.
            self._motion[: _YAW + 1] = before
            rows[k, :_LEFT] = last[:_LEFT]
            self._last = rows[k]
            if not self._flags[_COLLIDED]:
                speed = float(self._motion[_SPEED])
                self._touched = walker_contact((x, y, yaw), speed, self._robot, k, movers)
            self._flags[_COLLIDED] = True
        return rows

    def _drive(self, wheels: WheelSpeeds, noise: NDArray[np.float64]) -> NDArray[np.float64]:
        """Move tick by tick; ``noise`` is standard normal, shape (ticks, 2)."""
        self._commanded = wheels
        rows = np.empty((len(noise), 9))
        rows[:, _LEFT], rows[:, _RIGHT] = wheels.left, wheels.right
        parameters = self._parameters
        drive_ticks(
            self._motion,
            np.array(self._kinematics.twist(wheels)),
            parameters.slip * noise,
            parameters.limits,
            parameters.sliding,
            self._ground,
            self._contact,
            self._drag,
            rows,
            self._flags,
        )
        self._last = rows[-1]
        return rows

    @property
    def state(self) -> VehicleState:
        """True state of the body."""
        collided, tipped = self._flags.tolist()
        motion, moves = self._motion.tolist(), not collided
        return VehicleState(
            stamp=self._ticks / TICK_HZ,
            pose=Pose(self._last[:3], self._last[3:7]),
            linear=np.array([motion[_SPEED] * moves, motion[_LATERAL_SPEED] * moves, 0.0]),
            angular=np.array([0.0, 0.0, motion[_YAW_RATE] * moves]),
            wheels=self._commanded,
            collided=collided,
            tipped=tipped,
            contact=self._touched if self._touched or not collided else Contact.OBSTACLE,
        )

    def close(self) -> None:
        """Do nothing: the plant holds no resources."""


def contact_map(truth: TraversabilityMap, outline: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Return for each cell of the true map what a body can touch there.

    Most cells are far from anything solid: one look-up there replaces the check of the outline.

    Args:
        truth: True map.
        outline: Points of the body as in ``PlantParameters``.

    Returns:
        0 where a body centred on the cell touches nothing, 1 where it might, 2 where the cell is
        solid, 3 where it is so low that only wheels strike it; uint8, shape (n, m).
    """
    radius = float(np.hypot(outline[:, _X], outline[:, _Y]).max()) + 2 * truth.cell
    # Near the border the body may leave the map, which counts as contact.
    border = math.ceil(radius / truth.cell)
    states = np.empty(truth.reason.shape, dtype=np.uint8)
    _fill_contact_map(truth.clearance, truth.reason, np.float32(radius), border, states)
    return states


@kernel
def _fill_contact_map(
    clearance: NDArray[np.float32],
    reason: NDArray[np.uint8],
    radius: np.float32,
    border: int,
    states: NDArray[np.uint8],
) -> None:
    """Write the states of ``contact_map``.

    Args:
        clearance: Distance of each cell to the nearest forbidden one [m], shape (n, m).
        reason: ``Reason`` of each cell, shape (n, m).
        radius: Clearance up to which a body might touch something [m].
        border: Width of the strip along the border that counts as near [cells].
        states: Output, shape (n, m).
    """
    n, m = states.shape
    solid, low = np.uint8(Reason.SOLID), np.uint8(Reason.LOW)
    for i in range(n):
        is_inside = border <= i < n - border
        for j in range(m):
            is_clear = is_inside and border <= j < m - border and clearance[i, j] > radius
            states[i, j] = _CLEAR if is_clear else _NEAR
            if reason[i, j] == solid:
                states[i, j] = _SOLID
            if reason[i, j] == low:
                states[i, j] = _LOW


class PlantParameters(NamedTuple):
    """Parameters of the plant as compiled code takes them.

    Attributes:
        limits: Share of the slip that remains after a tick (first-order Gauss-Markov), share of a
            commanded change of twist that is made in a tick (first-order lag), steepest climb and
            largest tilt [rad], width of the body per weight [m/N] and half of its length [m]; shape
            (6,).
        sliding: ``creep``, ``creep_slope`` and ``pivot`` of ``RobotModel``, shape (3,).
        wheels: Contact points of the wheels [m], shape (4, 2).
        outline: Points of the body x, y [m] and 1 for a wheel's, 0 else; shape (k, 3).
        slip: Standard deviation of the slip that a tick adds.
    """

    limits: NDArray[np.float64]
    sliding: NDArray[np.float64]
    wheels: NDArray[np.float64]
    outline: NDArray[np.float64]
    slip: float


def plant_parameters(robot: RobotModel, config: KinematicConfig) -> PlantParameters:
    """Return the parameters of a robot's plant.

    Args:
        robot: Parameters of the body.
        config: Response, slip and limits.
    """
    decay = math.exp(-TICK / config.slip_time)
    corners = np.array([[x, y] for x in (1, -1) for y in (1, -1)]) / 2
    return PlantParameters(
        limits=np.array(
            [
                decay,
                1 - math.exp(-TICK / config.time_constant),
                config.max_climb,
                config.max_tilt,
                robot.width / (robot.mass * _GRAVITY),
                robot.length / 2,
            ]
        ),
        sliding=np.array([robot.creep, robot.creep_slope, robot.pivot]),
        wheels=corners * [robot.wheelbase, robot.track],
        outline=_outline(robot, config.outline_margin),
        # Keeps the variance of the Gauss-Markov process at slip_sigma^2.
        slip=config.slip_sigma * math.sqrt(1 - decay * decay),
    )


def _outline(robot: RobotModel, margin: float) -> NDArray[np.float64]:
    """Return points of body and wheels as in ``PlantParameters``, at most 9 cm apart."""
    half_x, half_y = robot.length / 2 - margin, robot.width / 2 - margin
    along, across = np.linspace(-half_x, half_x, 9), np.linspace(-half_y, half_y, 7)
    sides = [(x, y, 0.0) for x in along for y in (-half_y, half_y)]
    ends = [(x, y, 0.0) for y in across for x in (-half_x, half_x)]
    # A wheel strikes a low object with its lower half.
    reach = robot.wheelbase / 2 + robot.wheel_radius * np.array([-0.7, 0.0, 0.7])
    wheels = [
        (side * x, y, 1.0)
        for x in reach
        for side in (-1, 1)
        for y in (-robot.track / 2, robot.track / 2)
    ]
    return np.array(sides + ends + wheels)


@kernel
def drive_ticks(
    motion: NDArray[np.float64],
    command: NDArray[np.float64],
    noise: NDArray[np.float64],
    limits: NDArray[np.float64],
    sliding: NDArray[np.float64],
    ground: WheelGround,
    contact: ContactMap,
    drag: PlantDrag,
    rows: NDArray[np.float64],
    flags: NDArray[np.bool_],
) -> None:
    """Move the body for as many ticks as ``rows`` has.

    Args:
        motion: State of the motion, changed in place: x, y [m], yaw [rad], speed [m/s], yaw rate
            [rad/s], relative errors of these two, sideways speed [m/s]; shape (8,).
        command: Commanded speed [m/s] and yaw rate [rad/s], shape (2,).
        noise: Slip of speed and of yaw rate that each tick adds, shape (ticks, 2).
        limits: ``PlantParameters.limits``.
        sliding: ``PlantParameters.sliding``.
        ground: Ground under the wheels.
        contact: Solid cells and outline.
        drag: Drag of plants.
        rows: Track that is filled: x, y, z [m], quaternion x, y, z, w of each tick, shape
            (ticks, 7 or more).
        flags: Collision and roll-over, set in place and never cleared here, shape (2,).
    """
    slip_decay, response, max_climb, max_tilt, width_per_weight, half_length = limits
    creep, creep_slope, pivot = sliding
    heights, cell, wheels = ground
    states, x_min, y_min, map_cell, outline = contact
    plants = DragMap(drag[0], drag[1], drag[2], drag[3])
    drags, force = plants.force.size > 0, 0.0
    cosine, sine = np.cos(motion[_YAW]), np.sin(motion[_YAW])
    height, roll, pitch = fit_wheel_plane(
        heights, cell, motion[_X], motion[_Y], cosine, sine, wheels
    )
    for k in range(len(rows)):
        # Slip is a first-order Gauss-Markov process, the twist follows its command with a lag.
        for c in range(2):
            motion[_SPEED_SLIP + c] = slip_decay * motion[_SPEED_SLIP + c] + noise[k, c]
            motion[_SPEED + c] += response * (
                command[c] * (1 + motion[_SPEED_SLIP + c]) - motion[_SPEED + c]
            )
        if flags[_TIPPED]:
            motion[_SPEED] = motion[_YAW_RATE] = 0.0
        if -pitch * np.sign(motion[_SPEED]) > max_climb:  # Nose up too steeply: the wheels spin.
            motion[_SPEED] = 0.0
        if drags and k % PERIOD == 0:
            force = drag_at(plants, motion[_X], motion[_Y], cosine, sine, half_length)
        if force > 0.0:
            # Plants take of the grip what the slope leaves of it. Motors hold the speed until then.
            grip = np.tan(max_climb) * np.cos(pitch) + np.sin(pitch) * np.sign(motion[_SPEED])
            if force * width_per_weight > grip:
                motion[_SPEED] = 0.0
        # Midpoint rule: the step is made along the heading in the middle of the tick.
        mid_yaw = motion[_YAW] + motion[_YAW_RATE] * TICK / 2
        step, aside = motion[_SPEED] * TICK, 0.0
        if roll != 0.0 or pitch != 0.0:
            # A turning body creeps down a cross slope and turns about a point uphill of its middle.
            motion[_LATERAL_SPEED] = (
                -abs(motion[_YAW_RATE]) * creep * np.tanh(np.sin(roll) / creep_slope)
            )
            motion[_LATERAL_SPEED] -= motion[_YAW_RATE] * pivot * np.sin(pitch)
            step, aside = step * np.cos(pitch), motion[_LATERAL_SPEED] * TICK * np.cos(roll)
        else:
            motion[_LATERAL_SPEED] = 0.0
        c, s = np.cos(mid_yaw), np.sin(mid_yaw)
        x = motion[_X] + step * c - aside * s
        y = motion[_Y] + step * s + aside * c
        yaw = motion[_YAW] + motion[_YAW_RATE] * TICK
        if not -np.pi < yaw <= np.pi:
            yaw = np.pi - (np.pi - yaw) % (2 * np.pi)
        c, s = np.cos(yaw), np.sin(yaw)
        # A body that would touch something solid stays where it is.
        if _touches(x, y, c, s, states, x_min, y_min, map_cell, outline):
            flags[_COLLIDED] = True
        else:
            motion[_X], motion[_Y], motion[_YAW], cosine, sine = x, y, yaw, c, s
        height, roll, pitch = fit_wheel_plane(
            heights, cell, motion[_X], motion[_Y], cosine, sine, wheels
        )
        flags[_TIPPED] |= max(abs(roll), abs(pitch)) > max_tilt
        rows[k, _X], rows[k, _Y], rows[k, _HEIGHT] = motion[_X], motion[_Y], height
        qx, qy, qz, qw = quaternion(roll, pitch, motion[_YAW])
        rows[k, _QUATERNION], rows[k, _QUATERNION + 1] = qx, qy
        rows[k, _QUATERNION + 2], rows[k, _QUATERNION + 3] = qz, qw


@kernel
def _touches(
    x0: float,
    y0: float,
    c: float,
    s: float,
    states: NDArray[np.uint8],
    x_min: float,
    y_min: float,
    cell: float,
    outline: NDArray[np.float64],
) -> bool:
    """Return true if a point of the outline lies in a solid cell or outside of the map.

    Args:
        x0: Place of the body in the map [m].
        y0: Place of the body in the map [m].
        c: Cosine of the heading.
        s: Sine of the heading.
        states: Cells as ``contact_map`` returns them.
        x_min: Least x of the map [m].
        y_min: Least y of the map [m].
        cell: Width of a cell [m].
        outline: Points of the body, shape (k, 3).
    """
    n, m = states.shape
    # Most places are clear all around the body: one look-up instead of the whole outline.
    i, j = int(np.floor((x0 - x_min) / cell)), int(np.floor((y0 - y_min) / cell))
    if 0 <= i < n and 0 <= j < m and states[i, j] == _CLEAR:
        return False
    for k in range(len(outline)):
        x = x0 + c * outline[k, _X] - s * outline[k, _Y]
        y = y0 + s * outline[k, _X] + c * outline[k, _Y]
        i, j = int(np.floor((x - x_min) / cell)), int(np.floor((y - y_min) / cell))
        if i < 0 or j < 0 or i >= n or j >= m or states[i, j] == _SOLID:
            return True
        # The body passes over low objects, wheels do not.
        if states[i, j] == _LOW and outline[k, _IS_WHEEL] > 0.0:
            return True
    return False
