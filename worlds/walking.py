"""Walkers over the time of a drive: where each is at every tick, and which rays they stop.

Walkers are the movers of a world, upright cylinders whose foot is on the ground under their axis.
They move tick by tick, so that a beam of any instant meets them where they were at that instant: a
turning laser smears them as it smears all that moves. Those with a behaviour decide at the begin of
each control period where they go, see ``worlds.agent_motion``; the others go straight, whatever the
robot does.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.classes import SemanticClass
from terrain.kernel import inlined_kernel, kernel
from worlds.agent_motion import RobotMotion, decide, stride
from worlds.agent_surroundings import Nearby, overlapping, sight
from worlds.agents import HURRY, Agents, check_movers
from worlds.rays.ground import cell_height
from worlds.rooms.mover_motion import Movers, Schedules, Solids, come_and_go, put_down
from worlds.walkers import solids_room
from worlds.world import World

HeightGrid = tuple[NDArray[np.float32], float]
"""Heights of the ground's nodes [m], shape (nx, ny), and the distance of two nodes [m]."""

BELOW = (0.0, 0.0, -1000.0)
"""Place of a walker's body in an engine when it is not there, or far from the robot [m]."""

_WALKER = int(SemanticClass.WALKER)

_KEPT = 2048
"""Number of ticks that are remembered at most; when it is full the older half is dropped."""

_HORIZON = 100
"""Number of ticks between two looks around for what walkers may meet."""

_FAR_AWAY = (1e6, 1e6)
"""Place of a robot that is in nobody's way [m]."""

_FASTEST = 5.0
"""Bound of the speeds of walkers and of the laser [m/s]."""


class WalkerTrack(NamedTuple):
    """Walkers at some ticks in a row, m of them at each of t ticks.

    Attributes:
        movers: Places, velocities and radii; a tick is a row. The radius of one that is not there
            is 0.
        feet: Height of the ground under each walker's axis [m], shape (t, m).
        heights: Heights of the walkers [m], shape (m,).
        first: Number of the first tick.
        tick_hz: Number of ticks per second [Hz].
    """

    movers: Movers
    feet: NDArray[np.float64]
    heights: NDArray[np.float64]
    first: int
    tick_hz: float

    def last(self, ticks: int) -> "WalkerTrack":
        """Return the last ticks."""
        begin = len(self.feet) - ticks
        movers = Movers(*(array[begin:] for array in self.movers))
        return self._replace(movers=movers, feet=self.feet[begin:], first=self.first + begin)

    def copy(self) -> "WalkerTrack":
        """Return a copy, which later ticks leave as it is."""
        movers = Movers(*(array.copy() for array in self.movers))
        return self._replace(movers=movers, feet=self.feet.copy())

    @property
    def latest(self) -> float:
        """Time of the last tick [s]."""
        return (self.first + len(self.feet) - 1) / self.tick_hz

    @property
    def now(self) -> NDArray[np.float64]:
        """Rows of the last tick: x, y, z of the foot, radius, height [m], float64, shape (m, 5).

        The radius of one that is not there is 0.
        """
        movers = self.movers
        return np.column_stack([movers.places[-1], self.feet[-1], movers.radii[-1], self.heights])


class Walkers:
    """The moving obstacles of a world, from the moment that a robot is put down.

    Each drive sees the same walkers from its begin on. Where they go follows from the world, and
    for people who give way from the robot's true places.

    Attributes:
        track: Walkers at the ticks that are remembered, at least the last 1,000.
    """

    def __init__(self, world: World, tick_hz: float) -> None:
        """Put the walkers down.

        Args:
            world: World with its moving obstacles.
            tick_hz: Number of ticks per second [Hz].

        Raises:
            ValueError: If there are too many, or one is too fast for its size.
        """
        check_movers(world.movers)
        self._world, self._dt = world, 1.0 / tick_hz
        self._room = solids_room(world.ground, world.objects)
        self._tick_hz = tick_hz
        self._ground = np.ascontiguousarray(world.ground.heights), world.ground.cell
        plans = [mover.plan for mover in world.movers]
        self._radii = np.array([plan.radius for plan in plans])
        self._speeds = HURRY * np.array([plan.speed for plan in plans])
        self._heights = np.array([plan.height for plan in plans])
        self._sight = sight(self._speeds)
        self.reset(_FAR_AWAY)

    def reset(self, robot: tuple[float, float], gap: float = 0.0) -> None:
        """Begin a drive.

        Args:
            robot: Place of the robot [m].
            gap: Radius around it in which nobody appears [m].
        """
        count = len(self._world.movers)
        self._state, self._schedules = Movers.none(1, count), Schedules.none(1, count)
        put_down(0, self._world.movers, self._state, self._schedules, self._dt)
        self._agents, self._robot = Agents.of(self._world.movers), robot
        rows = Movers.none(_KEPT, count)
        self._rows, self._feet = rows, np.zeros((_KEPT, count))
        self._first, self._count, self._unseen = 0, 1, 0
        self._appear(robot, gap, 0.0)
        _keep(self._state, self._ground, rows, self._feet, 0)
        self._renew()

    def step(self, ticks: int, robot: tuple[float, float], gap: float) -> WalkerTrack:
        """Move on, and return the walkers at the ticks that passed.

        Args:
            ticks: Number of ticks.
            robot: Place of the robot at the begin [m].
            gap: Radius around it in which nobody appears [m].
        """
        if self._count + ticks > _KEPT:
            self._drop()
        if self._unseen < ticks:
            self._look_around(max(ticks, _HORIZON))
        self._unseen -= ticks
        now = (self._first + self._count - 1) * self._dt
        self._appear(robot, gap, now)
        solids = Solids(self._room.boxes, *self._near)
        motion = self._motion(robot, gap, ticks)
        nearby = decide(
            self._state, self._agents, solids, self._room.half, motion, now, ticks * self._dt
        )
        moving = self._state, self._agents, solids, nearby
        _walk(*moving, self._dt, self._ground, self._rows, self._feet, self._count, ticks)
        self._count += ticks
        self._renew()
        return self.track.last(ticks)

    def _motion(self, robot: tuple[float, float], gap: float, ticks: int) -> RobotMotion:
        """Return the robot's motion: its velocity is that since the last period."""
        span = ticks * self._dt
        vx, vy = ((new - old) / span for new, old in zip(robot, self._robot, strict=True))
        self._robot = robot
        return RobotMotion(*robot, vx, vy, gap)

    def _look_around(self, ticks: int) -> None:
        """Find the circles and edges that walkers may meet soon: a world has thousands.

        Args:
            ticks: Number of ticks for which it is enough.
        """
        reaches = self._radii + self._speeds * ticks * self._dt + self._sight
        circles, edges = self._room.circles, self._room.edges
        chosen = overlapping(self._state.places[0], reaches, circles)
        middles = (edges[:, :2] + edges[:, 2:]) / 2
        halves = np.hypot(*(edges[:, 2:] - edges[:, :2]).T) / 2
        around = overlapping(self._state.places[0], reaches, np.column_stack([middles, halves]))
        self._near, self._unseen = (circles[chosen], edges[around]), ticks

    def _appear(self, robot: tuple[float, float], gap: float, stamp: float) -> None:
        """Let walkers come and go at the begin of a control period."""
        place, one = np.array([robot], dtype=np.float64), np.ones(1, dtype=np.bool_)
        come_and_go(place, one, np.array([stamp]), self._state, self._schedules, gap)

    def _renew(self) -> None:
        """Renew the track."""
        self.track = WalkerTrack(
            Movers(*(rows[: self._count] for rows in self._rows)),
            self._feet[: self._count],
            self._heights,
            self._first,
            self._tick_hz,
        )

    def _drop(self) -> None:
        """Forget the older half of the ticks."""
        half = self._count // 2
        for rows in (*self._rows, self._feet):
            rows[: self._count - half] = rows[half : self._count].copy()
        self._first, self._count = self._first + half, self._count - half


@kernel
def _walk(
    state: Movers,
    agents: Agents,
    solids: Solids,
    nearby: Nearby,
    dt: float,
    ground: HeightGrid,
    rows: Movers,
    feet: NDArray[np.float64],
    begin: int,
    ticks: int,
) -> None:
    """Move walkers for some ticks, and write their rows.

    Args:
        state: Walkers, changed in place.
        agents: Traits and intentions of those with a behaviour.
        solids: Solids that may be met.
        nearby: Those near each agent.
        dt: Period of a tick [s].
        ground: Heights of the ground's nodes, and their distance [m].
        rows: Walkers at the ticks, filled.
        feet: Heights of their feet [m], filled, shape (t, m).
        begin: First row.
        ticks: Number of rows.
    """
    for row in range(begin, begin + ticks):
        stride(state, agents, solids, nearby, dt)
        _keep(state, ground, rows, feet, row)


@kernel
def _keep(
    state: Movers, ground: HeightGrid, rows: Movers, feet: NDArray[np.float64], row: int
) -> None:
    """Write the present state into a row, and the height of the ground under each walker."""
    heights, cell = ground
    n, m = heights.shape
    for w in range(state.radii.shape[1]):
        for c in range(2):
            rows.places[row, w, c] = state.places[0, w, c]
            rows.velocities[row, w, c] = state.velocities[0, w, c]
        rows.radii[row, w] = state.radii[0, w]
        u = min(max(state.places[0, w, 0] / cell + (n - 1) / 2, 0.0), n - 1.0)
        v = min(max(state.places[0, w, 1] / cell + (m - 1) / 2, 0.0), m - 1.0)
        i, j = min(int(u), n - 2), min(int(v), m - 2)
        h00, h10 = np.float64(heights[i, j]), np.float64(heights[i + 1, j])
        h01, h11 = np.float64(heights[i, j + 1]), np.float64(heights[i + 1, j + 1])
        feet[row, w] = cell_height(h00, h10, h01, h11, u - i, v - j)


@kernel
def cover_rays(
    rays: NDArray[np.float32],
    times: NDArray[np.float64],
    track: WalkerTrack,
    max_range: float,
    ranges: NDArray[np.float32],
    classes: NDArray[np.uint8],
) -> None:
    """Shorten the rays that walkers stop, each walker where it is at the ray's time.

    Args:
        rays: Origin in the map [m] and unit direction of each ray, float32, shape (n, 6).
        times: Time of each ray [s], shape (n,); before the first and after the last tick, those.
        track: Walkers.
        max_range: Largest range [m]; hits beyond it count as none.
        ranges: Range of each ray in the world without walkers, shortened in place [m], float32,
            shape (n,).
        classes: Semantic classes, changed in place, uint8, shape (n,).
    """
    places, radii, feet = track.movers.places, track.movers.radii, track.feet
    ticks, count = feet.shape
    if len(rays) == 0:
        return
    # Whom no ray can meet is left out at once: nobody moves far between the first and the last.
    spread = 2.0 * _FASTEST * abs(times[-1] - times[0])
    row = min(max(int(times[0] * track.tick_hz) - track.first, 0), ticks - 1)
    near = np.empty(count, dtype=np.int64)
    n_near = 0
    for m in range(count):
        away = np.hypot(places[row, m, 0] - rays[0, 0], places[row, m, 1] - rays[0, 1])
        if away - radii[:, m].max() - spread < max_range:
            near[n_near] = m
            n_near += 1
    for k in range(len(rays) if n_near else 0):
        # Between two ticks walkers go straight.
        at = min(max(times[k] * track.tick_hz - track.first, 0.0), ticks - 1.0)
        before = min(int(at), max(ticks - 2, 0))
        after, share = min(before + 1, ticks - 1), at - before
        for n in range(n_near):
            m = near[n]
            radius = radii[before, m]
            if radius <= 0.0:
                continue
            x = (1.0 - share) * places[before, m, 0] + share * places[after, m, 0]
            y = (1.0 - share) * places[before, m, 1] + share * places[after, m, 1]
            foot = (1.0 - share) * feet[before, m] + share * feet[after, m]
            # On a slope the rim of the foot would hang in the air: it goes into the ground.
            distance = _to_cylinder(rays[k], x, y, foot - radius, foot + track.heights[m], radius)
            if distance < ranges[k] and distance <= max_range:
                ranges[k], classes[k] = distance, _WALKER


@inlined_kernel
def _to_cylinder(
    ray: NDArray[np.float32], x: float, y: float, low: float, high: float, radius: float
) -> float:
    """Return the range at which a ray meets an upright cylinder [m], infinite if it misses.

    From inside the far side is hit, as of all solid objects.
    """
    dx, dy, dz = np.float64(ray[3]), np.float64(ray[4]), np.float64(ray[5])
    ox, oy, oz = ray[0] - x, ray[1] - y, np.float64(ray[2])
    # Of the infinite cylinder: begin and end of the part inside, from |o + t d|^2 = r^2.
    square, half = dx * dx + dy * dy, ox * dx + oy * dy
    excess = ox * ox + oy * oy - radius * radius
    begin, end = -np.inf, np.inf
    if square > 0.0:
        root = half * half - square * excess
        if root < 0.0:
            return np.inf
        root = np.sqrt(root)
        begin, end = (-half - root) / square, (-half + root) / square
    elif excess > 0.0:
        return np.inf
    # Between its two faces.
    if dz != 0.0:
        a, b = (low - oz) / dz, (high - oz) / dz
        begin, end = max(begin, min(a, b)), min(end, max(a, b))
    elif oz < low or oz > high:
        return np.inf
    if begin >= end or end <= 0.0:
        return np.inf
    return begin if begin > 0.0 else end
