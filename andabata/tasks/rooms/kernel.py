"""Compiled pass of disc robots in rooms: motion, contact, rays.

Rays are cast by angular spans. Along a straight face the reciprocal of the distance is linear in
the cosine and the sine of a beam's bearing, so that each visible face of a box, and each slanted
edge of another obstacle, is one multiply and maximum over the beams of its angular interval;
nothing is walked, and the result is exact. The reciprocals are what networks take, too.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.machine.planar.mover_contact import Contact, contact_with_mover
from andabata.machine.planar.odometry import move_along_arc
from terrain.kernel import inlined_kernel, kernel
from worlds.agent_motion import RobotMotion, decide, stride
from worlds.agents import Agents, agents_of
from worlds.rooms.edges import edge_clearance
from worlds.rooms.mover_motion import Movers, Solids, advance, movers_of

MIN_RANGE = 0.02
"""Smallest distance that a beam or a point can have [m]: reciprocals stay finite at contact."""

X, Y, YAW, V, W = range(5)
"""Columns of a motion: position [m], heading [rad], speed [m/s], yaw rate [rad/s]."""

_EDGE = 1e-9
"""Widening of an interval [beams]: what is at an edge must not be lost to rounding."""

_END_ON = 1e-9
"""Distance from an edge's line up to which the edge is seen end on [m]."""

_TURN = 2 * np.pi

_OBSTACLE = int(Contact.OBSTACLE)


class Rooms(NamedTuple):
    """Rooms of any number of obstacles, padded.

    Attributes:
        boxes: x_min, y_min, x_max, y_max [m], shape (r, most, 4).
        box_counts: Number of boxes of each room, shape (r,).
        circles: x, y, radius [m], shape (r, most, 3).
        circle_counts: Number of circles of each room, shape (r,).
        edges: Slanted edges: x, y at the begin and at the end [m], shape (r, most, 4).
        edge_counts: Number of edges of each room, shape (r,).
        halves: Half of the extent of each in x and y [m], shape (r, 2).
    """

    boxes: NDArray[np.float64]
    box_counts: NDArray[np.int64]
    circles: NDArray[np.float64]
    circle_counts: NDArray[np.int64]
    edges: NDArray[np.float64]
    edge_counts: NDArray[np.int64]
    halves: NDArray[np.float64]


class Lasers(NamedTuple):
    """Planar lasers, padded to the beams of the finest.

    Attributes:
        counts: Number of beams of each, shape (l,).
        firsts: Bearing of the first beam from the robot's heading [rad], shape (l,).
        steps: Angle between two beams [rad], shape (l,).
        directions: Cosine and sine of each beam's bearing from the heading, shape (l, 2, b).
        offsets: Position on the robot [m], shape (l, 2).
        max_ranges: Range beyond which a beam returns nothing [m], shape (l,).
    """

    counts: NDArray[np.int64]
    firsts: NDArray[np.float64]
    steps: NDArray[np.float64]
    directions: NDArray[np.float32]
    offsets: NDArray[np.float64]
    max_ranges: NDArray[np.float64]


class View(NamedTuple):
    """One laser where it is.

    Attributes:
        x: Position in the room [m].
        y: Position in the room [m].
        c: Cosine of the robot's heading.
        s: Sine of the robot's heading.
        first: Bearing of the first beam in the room, from 0 to 2 pi [rad].
        density: Number of beams for each radian.
        beams: Number of beams.
        max_range: Largest range [m].
    """

    x: float
    y: float
    c: float
    s: float
    first: float
    density: float
    beams: int
    max_range: float


@kernel
def drive(
    motions: NDArray[np.float64],
    chosen: NDArray[np.bool_],
    places: NDArray[np.int64],
    rooms: Rooms,
    movers: Movers,
    radius: float,
    period: float,
    substeps: int,
    contacts: NDArray[np.int64],
    people: tuple[Agents, NDArray[np.float64]] | None = None,
) -> None:
    """Drive the chosen robots and their movers for one control period, robots along exact arcs.

    In each sub-step first the robot moves, then its movers. A robot that touches something stays
    there until it is put down anew.

    Args:
        motions: State of each robot, columns as above, changed in place, shape (n, 5). Speed and
            yaw rate are those to drive.
        chosen: True for robots that move, shape (n,).
        places: Index of each robot's room, shape (n,).
        rooms: Rooms.
        movers: Moving obstacles, changed in place.
        radius: Radius of the robots [m].
        period: Control period [s].
        substeps: Number of checks for contact in a period.
        contacts: ``Contact`` of each robot, changed in place, shape (n,).
        people: People among the movers, changed in place, and the time of each robot at the begin
            of the period [s], shape (n,); None without any.
    """
    dt = period / substeps
    for k in range(len(chosen)):
        if not chosen[k]:
            continue
        contacts[k] = 0
        motion, room = motions[k], places[k]
        boxes = rooms.boxes[room, : rooms.box_counts[room]]
        circles = rooms.circles[room, : rooms.circle_counts[room]]
        edges = rooms.edges[room, : rooms.edge_counts[room]]
        if people is not None:
            agents, own = agents_of(people[0], k), movers_of(movers, k)
            solids = Solids(boxes, circles, edges)
            half = rooms.halves[room, 0], rooms.halves[room, 1]
            vx, vy = motion[V] * np.cos(motion[YAW]), motion[V] * np.sin(motion[YAW])
            robot = RobotMotion(motion[X], motion[Y], vx, vy, radius)
            nearby = decide(own, agents, solids, half, robot, people[1][k], period)
        for _ in range(substeps):
            move_along_arc(motion, X, motion[V] * dt, motion[W] * dt)
            if people is not None:
                stride(own, agents, solids, nearby, dt)
            elif movers.radii.shape[1] > 0:
                advance(k, movers, boxes, circles, edges, dt)
            x, y = motion[X], motion[Y]
            if clearance(x, y, room, rooms, k, movers) < radius:
                # Touching both what stands and what moves is the robot's own doing.
                contact = _OBSTACLE
                if standing_clearance(x, y, room, rooms) >= radius:
                    contact = contact_with_mover(x, y, motion[YAW], motion[V], radius, k, movers)
                contacts[k] = contact
                break


@kernel
def clearance(x: float, y: float, room: int, rooms: Rooms, k: int, movers: Movers) -> float:
    """Return the distance of a point to the nearest obstacle [m], 0 inside a box."""
    nearest = standing_clearance(x, y, room, rooms)
    for m in range(movers.radii.shape[1]):
        if movers.radii[k, m] > 0.0:
            away = np.hypot(movers.places[k, m, 0] - x, movers.places[k, m, 1] - y)
            nearest = min(nearest, away - movers.radii[k, m])
    return nearest


@kernel
def standing_clearance(x: float, y: float, room: int, rooms: Rooms) -> float:
    """Return the distance of a point to the nearest box or circle of a room [m], 0 inside a box."""
    squared = np.inf
    for b in range(rooms.box_counts[room]):
        box = rooms.boxes[room, b]
        dx = max(box[0] - x, 0.0, x - box[2])
        dy = max(box[1] - y, 0.0, y - box[3])
        squared = min(squared, dx * dx + dy * dy)
    nearest = np.sqrt(squared)
    for c in range(rooms.circle_counts[room]):
        circle = rooms.circles[room, c]
        nearest = min(nearest, np.hypot(circle[0] - x, circle[1] - y) - circle[2])
    if rooms.edge_counts[room]:
        aside = edge_clearance(x, y, rooms.edges[room], rooms.edge_counts[room])
        nearest = min(nearest, aside)
    return nearest


@kernel
def cast(
    motions: NDArray[np.float64],
    chosen: NDArray[np.bool_],
    places: NDArray[np.int64],
    rooms: Rooms,
    movers: Movers,
    lasers: Lasers,
    mounted: NDArray[np.int64],
    reciprocals: NDArray[np.float32],
) -> None:
    """Write the reciprocal distances of the chosen robots' beams.

    Args:
        motions: State of each robot, shape (n, 5).
        chosen: True for robots to cast for, shape (n,).
        places: Index of each robot's room, shape (n,).
        rooms: Rooms.
        movers: Moving obstacles.
        lasers: Lasers.
        mounted: Index of each robot's laser, shape (n,).
        reciprocals: Reciprocals of the distances from the laser [1/m], float32, shape (n, b); that
            of the maximum range where nothing returns.
    """
    for k in range(len(chosen)):
        if not chosen[k]:
            continue
        laser, room = mounted[k], places[k]
        c, s = np.cos(motions[k, YAW]), np.sin(motions[k, YAW])
        ahead, left = lasers.offsets[laser]
        view = View(
            motions[k, X] + c * ahead - s * left,
            motions[k, Y] + s * ahead + c * left,
            c,
            s,
            (motions[k, YAW] + lasers.firsts[laser]) % _TURN,
            1.0 / lasers.steps[laser],
            lasers.counts[laser],
            lasers.max_ranges[laser],
        )
        row, directions = reciprocals[k], lasers.directions[laser]
        row[:] = np.float32(1.0 / view.max_range)
        for b in range(rooms.box_counts[room]):
            _box(row, directions, view, rooms.boxes[room, b])
        for o in range(rooms.circle_counts[room]):
            circle = rooms.circles[room, o]
            _circle(row, directions, view, circle[0], circle[1], circle[2])
        for e in range(rooms.edge_counts[room]):
            _edge(row, directions, view, rooms.edges[room, e])
        for m in range(movers.radii.shape[1]):
            if movers.radii[k, m] > 0.0:
                x, y = movers.places[k, m]
                _circle(row, directions, view, x, y, movers.radii[k, m])
        most = np.float32(1.0 / MIN_RANGE)
        for i in range(view.beams):
            row[i] = row[i] if row[i] < most else most


@inlined_kernel
def _box(
    row: NDArray[np.float32],
    directions: NDArray[np.float32],
    view: View,
    box: NDArray[np.float64],
) -> None:
    """Take the larger reciprocals of a box into a row of beams.

    Args:
        row: Reciprocals, changed in place.
        directions: Cosine and sine of each beam's bearing from the heading, shape (2, b).
        view: Laser in the room.
        box: x_min, y_min, x_max, y_max [m].
    """
    west, south, east, north = box[0] - view.x, box[1] - view.y, box[2] - view.x, box[3] - view.y
    # A face is visible from its outer side alone: two faces of a box at most.
    across = west if west > 0.0 else min(east, 0.0)
    along = south if south > 0.0 else min(north, 0.0)
    if across * across + along * along > view.max_range * view.max_range:
        return
    if across == 0.0 and along == 0.0:
        row[:] = np.float32(1.0 / MIN_RANGE)
        return
    # The reciprocal of the distance to the line x = a is cos / a of the bearing in the room. Where
    # two faces are visible they share a corner.
    if across != 0.0 and along != 0.0:
        corner = np.arctan2(along, across)
        other = np.arctan2(north if along == south else south, across)
        _face(row, directions, view, corner, other, view.c / across, -view.s / across)
        other = np.arctan2(along, east if across == west else west)
        _face(row, directions, view, corner, other, view.s / along, view.c / along)
    elif across != 0.0:
        one, other = np.arctan2(south, across), np.arctan2(north, across)
        _face(row, directions, view, one, other, view.c / across, -view.s / across)
    else:
        one, other = np.arctan2(along, west), np.arctan2(along, east)
        _face(row, directions, view, one, other, view.s / along, view.c / along)


@kernel
def _edge(
    row: NDArray[np.float32],
    directions: NDArray[np.float32],
    view: View,
    edge: NDArray[np.float64],
) -> None:
    """Take the larger reciprocals of a slanted edge, seen from either side, into a row of beams.

    Args:
        row: Reciprocals, changed in place.
        directions: Cosine and sine of each beam's bearing from the heading, shape (2, b).
        view: Laser in the room.
        edge: x, y at the begin and at the end [m].
    """
    ax, ay = edge[0] - view.x, edge[1] - view.y
    bx, by = edge[2] - view.x, edge[3] - view.y
    dx, dy = bx - ax, by - ay
    length = dx * dx + dy * dy
    share = min(max(-(ax * dx + ay * dy) / length, 0.0), 1.0)
    nearest_x, nearest_y = ax + share * dx, ay + share * dy
    if nearest_x * nearest_x + nearest_y * nearest_y > view.max_range * view.max_range:
        return
    # The line is (dy, -dx) (p - a) = 0. Seen end on, its edges' neighbours are what beams meet.
    away = dy * ax - dx * ay
    if abs(away) < _END_ON * np.sqrt(length):
        return
    u, v = (dy * view.c - dx * view.s) / away, -(dx * view.c + dy * view.s) / away
    _face(row, directions, view, np.arctan2(ay, ax), np.arctan2(by, bx), u, v)


@inlined_kernel
def _face(
    row: NDArray[np.float32],
    directions: NDArray[np.float32],
    view: View,
    one: float,
    other: float,
    u: float,
    v: float,
) -> None:
    """Take the larger reciprocals of one face into a row of beams.

    Args:
        row: Reciprocals, changed in place.
        directions: Cosine and sine of each beam's bearing from the heading, shape (2, b).
        view: Laser in the room.
        one: Bearing of one edge of the face in the room, from -pi to pi [rad].
        other: Bearing of the other edge [rad].
        u: Share of a beam's cosine in the reciprocal of its distance [1/m].
        v: Share of its sine [1/m].
    """
    # The interval runs counter-clockwise from the edge from which it is less than half a turn.
    begin, width = one, other - one
    if width < 0.0:
        begin, width = other, -width
    if width > np.pi:
        begin, width = begin + width, _TURN - width
    a, b = np.float32(u), np.float32(v)
    start, end = _interval(view, begin, width)
    # Once as it lies, and once a turn earlier: an interval may begin behind the first beam.
    for _ in range(2):
        i0 = max(int(np.ceil(start - _EDGE)), 0)
        i1 = min(int(np.floor(end + _EDGE)), view.beams - 1)
        for i in range(i0, i1 + 1):
            near = a * directions[0, i] + b * directions[1, i]
            row[i] = near if near > row[i] else row[i]
        start, end = start - _TURN * view.density, end - _TURN * view.density


@kernel
def _circle(
    row: NDArray[np.float32],
    directions: NDArray[np.float32],
    view: View,
    x: float,
    y: float,
    radius: float,
) -> None:
    """Take the larger reciprocals of a circle into a row of beams.

    Args:
        row: Reciprocals, changed in place.
        directions: Cosine and sine of each beam's bearing from the heading, shape (2, b).
        view: Laser in the room.
        x: Centre in the room [m].
        y: Centre in the room [m].
        radius: Radius [m].
    """
    dx, dy = x - view.x, y - view.y
    outside = dx * dx + dy * dy - radius * radius
    if outside <= 0.0:
        row[:] = np.float32(1.0 / MIN_RANGE)
        return
    distance = np.sqrt(dx * dx + dy * dy)
    if distance - radius > view.max_range:
        return
    half = np.arcsin(radius / distance)
    start, end = _interval(view, np.arctan2(dy, dx) - half, 2 * half)
    # Centre in the robot's frame, where the directions are.
    u, v = np.float32(view.c * dx + view.s * dy), np.float32(view.c * dy - view.s * dx)
    squared, inverse = np.float32(radius * radius), np.float32(1.0 / outside)
    for _ in range(2):
        i0 = max(int(np.ceil(start - _EDGE)), 0)
        i1 = min(int(np.floor(end + _EDGE)), view.beams - 1)
        for i in range(i0, i1 + 1):
            aside = u * directions[1, i] - v * directions[0, i]
            rest = squared - aside * aside
            chord = np.sqrt(rest if rest > np.float32(0.0) else np.float32(0.0))
            # The product of the distances to both ends of the chord is what lies outside.
            near = (u * directions[0, i] + v * directions[1, i] + chord) * inverse
            row[i] = near if near > row[i] else row[i]
        start, end = start - _TURN * view.density, end - _TURN * view.density


@kernel
def _interval(view: View, begin: float, width: float) -> tuple[float, float]:
    """Return begin and end of an interval of bearings in the room, counted in beams."""
    first = begin - view.first
    # Intervals begin after -1.5 pi, first beams before 2 pi: two turns are the most.
    while first < 0.0:
        first += _TURN
    start = first * view.density
    return start, start + width * view.density
