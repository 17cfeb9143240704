"""The compiled pass of rooms: exact rays, exact clearance, exact arcs."""

import numpy as np
import pytest

from andabata.bench.studies.planar import slab_ranges
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.mover_contact import Contact
from andabata.tasks.rooms.batch import laser_arrays, room_arrays
from andabata.tasks.rooms.kernel import (
    MIN_RANGE,
    Lasers,
    cast,
    clearance,
    drive,
)
from worlds.rooms.catalogue import make_room
from worlds.rooms.mover_motion import Movers
from worlds.rooms.room import Room, RoomPlan

LIDARS = (
    PlanarLidarConfig(),
    PlanarLidarConfig(fov_deg=270, resolution_deg=0.25, max_range=30, x=0.05),
    PlanarLidarConfig(fov_deg=180, resolution_deg=20, max_range=10, x=0.1, y=-0.08, yaw_deg=35),
    PlanarLidarConfig(fov_deg=90, resolution_deg=0.7, max_range=4, y=0.1, yaw_deg=-170),
    PlanarLidarConfig(fov_deg=350, resolution_deg=1, max_range=8, x=-0.1, yaw_deg=180),
    PlanarLidarConfig(fov_deg=360, resolution_deg=7.5, max_range=3, yaw_deg=-340),
)


def random_room(rng):
    """Return a cluttered room of 8 by 6 m."""
    corners = rng.uniform((-4.0, -3.0), (3.5, 2.5), (15, 2))
    boxes = np.concatenate([corners, corners + rng.uniform(0.02, 1.0, (15, 2))], axis=1)
    circles = np.concatenate([rng.uniform(-3, 3, (6, 2)), rng.uniform(0.02, 0.4, (6, 1))], axis=1)
    plan = RoomPlan(
        about="test",
        half=(4.0, 3.0),
        boxes=tuple(map(tuple, boxes)),
        circles=tuple(map(tuple, circles)),
    )
    return Room.of("test", plan)


def slanted_room(rng):
    """Return a room of turned boxes, triangles and walls without thickness."""
    outlines = []
    for middle in rng.uniform((-3.5, -2.5), (3.5, 2.5), (14, 2)):
        count = int(rng.integers(2, 6))
        angles = np.sort(rng.uniform(-np.pi, np.pi, count))
        corners = np.column_stack([np.cos(angles), np.sin(angles)]) * rng.uniform(0.1, 0.6)
        outlines.append(tuple(map(tuple, (middle + corners).tolist())))
    return Room.of("slanted", RoomPlan(about="test", half=(4.0, 3.0), outlines=tuple(outlines)))


def segment_ranges(edges, origin, bearings, reach):
    """Return the distance along each beam to the nearest of all edges, all against all [m]."""
    start, along = edges[:, :2] - origin, edges[:, 2:] - edges[:, :2]
    beams = np.stack([np.cos(bearings), np.sin(bearings)], axis=1)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        determinant = beams[..., 0] * along[:, 1] - beams[..., 1] * along[:, 0]
        away = (start[:, 0] * along[:, 1] - start[:, 1] * along[:, 0]) / determinant
        share = (start[:, 0] * beams[..., 1] - start[:, 1] * beams[..., 0]) / determinant
    met = (away > 0) & (share >= 0) & (share <= 1)
    return np.where(met, away, reach).min(axis=1, initial=reach)


def free_motions(made, rng, count, least=0.2):
    """Return robots at rest, with clearance and any heading."""
    places = rng.uniform((-4.0, -3.0), (4.0, 3.0), (200 * count, 2))
    places = places[made.clearance(places) > least][:count]
    yaws = rng.uniform(-np.pi, np.pi, len(places))
    return np.column_stack([places, yaws, np.zeros((len(places), 2))])


def scan(made, motions, lidar, movers=None):
    """Return the reciprocals of all beams."""
    count = len(motions)
    found = np.zeros((count, lidar.count), dtype=np.float32)
    zeros = np.zeros(count, dtype=np.int64)
    everyone = np.ones(count, dtype=bool)
    movers = movers or Movers.none(count)
    rooms, lasers = room_arrays([made]), laser_arrays([lidar])
    cast(motions, everyone, zeros, rooms, movers, lasers, zeros, found)
    return found


def reference(made, motion, lidar):
    """Return the ranges of all beams by slabs and quadratic equations, all against all [m]."""
    c, s = np.cos(motion[2]), np.sin(motion[2])
    origin = motion[:2] + lidar.x * np.array([c, s]) + lidar.y * np.array([-s, c])
    bearings = motion[2] + np.radians(lidar.yaw_deg) + lidar.bearings
    level = slab_ranges(made.boxes, made.circles, origin, bearings, lidar.max_range)
    return np.minimum(level, segment_ranges(made.edges, origin, bearings, lidar.max_range))


@pytest.mark.parametrize("kind", [random_room, slanted_room])
@pytest.mark.parametrize("lidar", LIDARS, ids=lambda lidar: lidar.label)
def test_rays_are_exact(lidar, kind):
    """Ranges in random rooms are those of the reference within 1e-5 m, but at grazed edges."""
    rng = np.random.default_rng(7)
    beams = grazed = 0
    for _ in range(12):
        made = kind(rng)
        motions = free_motions(made, rng, 8)
        for motion, row in zip(motions, scan(made, motions, lidar), strict=True):
            expected = reference(made, motion, lidar)
            # Reciprocals are float32: their spacing is that of a range near 5 m, and more farther.
            wrong = abs(1.0 / row - expected) > 1e-5 * np.maximum(1.0, (expected / 5.0) ** 2)
            grazed += wrong.sum()
            beams += len(row)
    assert grazed <= 1e-4 * beams


@pytest.mark.parametrize("turn", [0.0, 0.5, 1.0, 1.5])
def test_beams_along_the_axes_meet_what_is_there(turn):
    """Beams along walls' normals, where rounding decides on which side they are, are exact too."""
    lidar = PlanarLidarConfig(fov_deg=360, resolution_deg=90, max_range=20)
    made = Room.of("test", RoomPlan(about="test", half=(3.0, 2.0), boxes=[(1.0, -0.5, 1.5, 0.5)]))
    for y, ahead in ((0.0, 1.0), (-0.5, 1.0), (0.5, 1.0), (0.7, 3.0)):
        row = scan(made, np.array([[0.0, y, np.pi * turn, 0.0, 0.0]]), lidar)[0]
        # The beams start behind the robot: west at yaw 0.
        expected = np.roll([3.0, 2.0 + y, ahead, 2.0 - y], -int(2 * turn))
        np.testing.assert_allclose(1.0 / row, expected, rtol=1e-6)


def test_a_turned_room_is_seen_as_the_room_itself():
    """Boxes as outlines, turned with the robot about the middle, give the same beams."""
    rng = np.random.default_rng(13)
    made = random_room(rng)
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, -s], [s, c]])
    corners = made.boxes[:, [0, 1, 2, 1, 2, 3, 0, 3]].reshape(-1, 4, 2) @ turn.T
    centres = made.circles[:, :2] @ turn.T
    plan = RoomPlan(
        about="turned",
        half=(40.0, 40.0),
        outlines=tuple(tuple(map(tuple, each)) for each in corners.tolist()),
        circles=tuple(map(tuple, np.column_stack([centres, made.circles[:, 2]]).tolist())),
    )
    motions = free_motions(made, rng, 10)
    turned = motions.copy()
    turned[:, :2], turned[:, 2] = motions[:, :2] @ turn.T, motions[:, 2] + 0.7
    lidar = LIDARS[1]
    seen = scan(Room.of("turned", plan), turned, lidar)
    # A beam in 10,000 may pass a corner on the other side.
    assert (abs(1 / seen - 1 / scan(made, motions, lidar)) > 2e-5).mean() < 1e-4


def test_the_order_of_obstacles_does_not_matter():
    """A permutation of boxes and circles gives the same bytes."""
    rng = np.random.default_rng(8)
    made = random_room(rng)
    mixed = Room("mixed", made.half, rng.permutation(made.boxes), rng.permutation(made.circles))
    motions = free_motions(made, rng, 20)
    for lidar in LIDARS:
        np.testing.assert_array_equal(scan(made, motions, lidar), scan(mixed, motions, lidar))


def test_each_robot_has_its_own_room_and_laser():
    """Robots of one call see what they would see alone; those not chosen keep their rows."""
    rng = np.random.default_rng(9)
    rooms = [random_room(rng), make_room("spn-env5"), random_room(rng)]
    lasers = laser_arrays(LIDARS)
    motions = np.concatenate([free_motions(made, rng, 2) for made in rooms])
    places = np.repeat(np.arange(3), 2)
    mounted = np.arange(len(LIDARS))
    chosen = np.array([True, True, False, True, True, True])
    found = np.full((6, lasers.directions.shape[2]), 9.0, dtype=np.float32)
    cast(motions, chosen, places, room_arrays(rooms), Movers.none(6), lasers, mounted, found)
    for k, lidar in enumerate(LIDARS):
        if chosen[k]:
            alone = scan(rooms[places[k]], motions[k : k + 1], lidar)[0]
            np.testing.assert_array_equal(found[k, : lidar.count], alone)
    assert (found[2] == 9.0).all()


def test_moving_circles_are_seen_as_standing_ones():
    """A mover gives the beams of a circle of the room at its place; radius 0 is nobody."""
    rng = np.random.default_rng(10)
    bare = Room.of("test", RoomPlan(about="test", half=(4.0, 3.0)))
    posted = Room.of("test", RoomPlan(about="test", half=(4.0, 3.0), circles=[(1.0, 0.5, 0.3)]))
    motions = free_motions(posted, rng, 10)
    movers = Movers.none(10, 2)
    movers.places[:, 0], movers.radii[:, 0] = (1.0, 0.5), 0.3
    movers.places[:, 1] = motions[:, :2]
    for lidar in LIDARS:
        seen = scan(bare, motions, lidar, movers)
        np.testing.assert_array_equal(seen, scan(posted, motions, lidar))


@pytest.mark.parametrize("gap", [1e-3, 1e-9, 0.0, -1e-3, -0.1])
def test_a_laser_at_or_inside_an_obstacle_stays_finite(gap):
    """Reciprocals end at that of the smallest range, wherever the laser is."""
    boxes, circles = [(1.0, -1.0, 2.0, 1.0)], [(-1.0, 0.0, 0.5)]
    made = Room.of("test", RoomPlan(about="t", half=(4.0, 3.0), boxes=boxes, circles=circles))
    motions = np.array([[1.0 - gap, 0.0, 0.3, 0, 0], [-0.5 + gap, 0.0, -2.0, 0, 0]])
    for lidar in (PlanarLidarConfig(), PlanarLidarConfig(fov_deg=180, resolution_deg=1)):
        found = scan(made, motions, lidar)
        assert np.isfinite(found).all()
        assert found.min() >= np.float32(1.0 / lidar.max_range)
        assert (found.max(axis=1) == np.float32(1.0 / MIN_RANGE)).all()


@pytest.mark.parametrize("gap", [1e-3, 1e-9, 0.0, -1e-9, -0.1])
def test_a_laser_at_a_slanted_edge_stays_finite(gap):
    """Beams from the edge, from before it and from behind it end between the least and the most."""
    corners = ((0.0, 0.0), (1.0, 1.0), (-1.0, 1.0))
    made = Room.of("test", RoomPlan(about="test", half=(4.0, 3.0), outlines=(corners,)))
    x, y = np.array([0.5, 0.5]) + gap * np.array([1.0, -1.0])
    lidar = PlanarLidarConfig(fov_deg=360, resolution_deg=1)
    found = scan(made, np.array([[x, y, 0.3, 0.0, 0.0], [0.0, -gap, 0.0, 0.0, 0.0]]), lidar)
    assert found.min() >= np.float32(1.0 / lidar.max_range)
    assert found.max() <= np.float32(1.0 / MIN_RANGE)


@pytest.mark.parametrize("kind", [random_room, slanted_room])
def test_clearance_is_that_of_the_room(kind):
    """Outside of obstacles it is the room's own; a mover counts, and one of radius 0 does not."""
    rng = np.random.default_rng(11)
    made = kind(rng)
    rooms, movers = room_arrays([make_room("spn-env0"), made]), Movers.none(1, 2)
    points = rng.uniform((-4.0, -3.0), (4.0, 3.0), (500, 2))
    points = points[made.clearance(points) > 0.0]
    for point, expected in zip(points, made.clearance(points), strict=True):
        assert clearance(*point, 1, rooms, 0, movers) == pytest.approx(expected)
    movers.places[0, 1], movers.radii[0, 1] = points[0] + (0.3, 0.4), 0.45
    least = min(made.clearance(points[:1])[0], 0.05)
    assert clearance(*points[0], 1, rooms, 0, movers) == pytest.approx(least)


def test_clearance_is_the_distance_to_the_nearest_of_a_dense_sample():
    """No point of an obstacle's border is nearer, and one is as near, within the sample's step."""
    made = Room.of(
        "test",
        RoomPlan(about="t", half=(2, 2), boxes=[(0.3, -0.2, 0.9, 0.7)], circles=[(-0.8, 0.1, 0.4)]),
    )
    t = np.linspace(0.0, 1.0, 2001)
    sides = [
        np.stack([a + t * (c - a), np.full_like(t, y)], axis=1)
        for a, b, c, d in made.boxes
        for y in (b, d)
    ]
    sides += [
        np.stack([np.full_like(t, x), b + t * (d - b)], axis=1)
        for a, b, c, d in made.boxes
        for x in (a, c)
    ]
    angles = 2 * np.pi * t
    sides += [
        np.stack([x + r * np.cos(angles), y + r * np.sin(angles)], axis=1)
        for x, y, r in made.circles
    ]
    border = np.concatenate(sides)
    points = np.random.default_rng(12).uniform(-2.0, 2.0, (300, 2))
    rooms, movers = room_arrays([made]), Movers.none(1)
    for point in points[made.clearance(points) > 0.0]:
        nearest = np.hypot(*(border - point).T).min()
        found = clearance(*point, 0, rooms, 0, movers)
        assert nearest - 2e-3 < found <= nearest + 1e-9


def driven(made, motion, periods=1, substeps=2, movers=None):
    """Return a robot's motion and contact after some periods of 0.2 s."""
    motions, contacts = np.array([motion], dtype=np.float64), np.zeros(1, dtype=np.int64)
    one, first = np.ones(1, dtype=bool), np.zeros(1, dtype=np.int64)
    movers = movers or Movers.none(1)
    for _ in range(periods):
        rooms = room_arrays([made])
        drive(motions, one, first, rooms, movers, 0.2, 0.2, substeps, contacts)
    return motions[0], Contact(contacts[0])


@pytest.mark.parametrize("substeps", [1, 2, 7])
@pytest.mark.parametrize("w", [0.0, 1e-12, 0.4, -1.0])
def test_motion_follows_exact_arcs(substeps, w):
    """However many substeps there are, the robot is where its circle leads."""
    made = Room.of("test", RoomPlan(about="test", half=(50.0, 50.0)))
    (x, y, yaw, *_), contact = driven(made, [1.0, 2.0, 3.0, 0.5, w], 10, substeps)
    turn = 2.0 * w
    radius = 0.5 / w if abs(w) > 1e-6 else np.inf
    ahead = radius * np.sin(turn) if np.isfinite(radius) else 1.0
    left = radius * (1 - np.cos(turn)) if np.isfinite(radius) else 0.0
    assert x == pytest.approx(1.0 + ahead * np.cos(3.0) - left * np.sin(3.0))
    assert y == pytest.approx(2.0 + ahead * np.sin(3.0) + left * np.cos(3.0))
    assert np.cos(yaw - 3.0 - turn) == pytest.approx(1.0)
    assert -np.pi < yaw <= np.pi
    assert not contact


def test_contact_is_overlap_of_the_disc():
    """A robot 1 mm from a wall, a corner or a circle is free, and in contact 1 mm beyond."""
    boxes, circles = [(1.0, -1.0, 2.0, 1.0)], [(-2.0, 0.0, 0.5)]
    made = Room.of("test", RoomPlan(about="t", half=(4.0, 3.0), boxes=boxes, circles=circles))
    corner = 0.2 / np.sqrt(2)
    for place, inward in (
        ((0.8, 0.0), (1.0, 0.0)),
        ((1.0 - corner, 1.0 + corner), (1.0, -1.0)),
        ((-1.3, 0.0), (-1.0, 0.0)),
        ((0.0, 2.8), (0.0, 1.0)),
    ):
        for depth, expected in ((-1e-3, Contact.NONE), (1e-3, Contact.OBSTACLE)):
            x, y = np.array(place) + depth * np.array(inward)
            assert driven(made, [x, y, 0.0, 0.0, 0.0])[1] == expected


def test_a_robot_stays_where_it_touched():
    """It stops at the first check in contact, less than a substep's way inside."""
    made = Room.of("test", RoomPlan(about="test", half=(4.0, 3.0), boxes=[(1.0, -1.0, 2.0, 1.0)]))
    (x, *_), contact = driven(made, [0.72, 0.0, 0.0, 0.5, 0.0])
    assert not contact or x == pytest.approx(0.82)
    (x, *_), contact = driven(made, [0.76, 0.0, 0.0, 0.5, 0.0])
    assert contact
    assert x == pytest.approx(0.81)


def test_a_mover_touches_a_robot_at_rest():
    """Movers move at their velocities, and contact is with them where they are at that time."""
    made, movers = Room.of("test", RoomPlan(about="test", half=(4.0, 3.0))), Movers.none(1, 1)
    movers.places[0, 0], movers.velocities[0, 0], movers.radii[0, 0] = (0.0, 1.0), (0, -1.0), 0.1
    assert not driven(made, [0.0] * 5, 3, movers=movers)[1]
    assert movers.places[0, 0, 1] == pytest.approx(0.4)
    assert driven(made, [0.0] * 5, 1, movers=movers)[1] is Contact.HIT_AT_REST


def test_a_robot_between_a_wall_and_a_mover_drove_into_the_wall():
    """What stands comes first; without the wall the same robot is hit."""
    walls = [(1.0, -1.0, 2.0, 1.0)]
    for boxes, expected in ((walls, Contact.OBSTACLE), ([], Contact.HIT)):
        made = Room.of("test", RoomPlan(about="test", half=(4.0, 3.0), boxes=boxes))
        movers = Movers.none(1, 1)
        movers.places[0, 0], movers.velocities[0, 0] = (0.3, 0.0), (0.9, 0.0)
        movers.radii[0, 0] = 0.3
        assert driven(made, [0.76, 0.0, 0.0, 0.5, 0.0], movers=movers)[1] is expected


def test_movers_bounce_in_the_robots_room():
    """Walls, boxes and circles of its own room turn a mover back, in sub-steps like the robot's."""
    parts = {"about": "test", "half": (4.0, 3.0)}
    box, post = {"boxes": [(1.0, -0.5, 1.5, 0.5)]}, {"circles": [(1.3, 0.0, 0.3)]}
    plans = [parts, parts | box, parts | post]
    rooms = room_arrays([Room.of("test", RoomPlan.model_validate(plan)) for plan in plans])
    movers, places = Movers.none(3, 1), np.arange(3)
    movers.velocities[:, 0], movers.radii[:] = (0.5, 0.0), 0.2
    motions, contacts = np.tile([0.0, 2.0, 0.0, 0.0, 0.0], (3, 1)), np.zeros(3, dtype=np.int64)
    for _ in range(9):
        drive(motions, np.ones(3, bool), places, rooms, movers, 0.2, 0.2, 2, contacts)
    # With 0.05 m a sub-step: 15 until the obstacle, one lost, two back.
    np.testing.assert_allclose(movers.places[:, 0, 0], [0.9, 0.65, 0.65], atol=0.051)
    np.testing.assert_allclose(movers.velocities[:, 0, 0], [0.5, -0.5, -0.5])
    assert not contacts.any()


def test_robots_that_are_not_chosen_stand_still():
    """Neither they nor their movers move, and their contact is kept; that of the others is new."""
    motions = np.tile([0.0, 0.0, 0.0, 0.5, 0.1], (2, 1))
    movers, contacts = Movers.none(2, 1), np.array([1, 2])
    movers.velocities[:], movers.radii[:], movers.places[:] = 1.0, 0.1, 2.0
    rooms, zeros = room_arrays([make_room("spn-env0")]), np.zeros(2, dtype=np.int64)
    drive(motions, np.array([True, False]), zeros, rooms, movers, 0.2, 0.2, 2, contacts)
    assert motions[0, 0] > 0.09
    assert motions[1, 0] == 0.0
    assert (movers.places[1] == 2.0).all()
    assert contacts.tolist() == [0, 2]


def test_lasers_are_padded():
    """A laser of few beams in a batch with a fine one has its own count, step and offset."""
    lasers = laser_arrays(LIDARS)
    assert isinstance(lasers, Lasers)
    assert lasers.counts.tolist() == [lidar.count for lidar in LIDARS]
    np.testing.assert_allclose(lasers.offsets[2], [0.1, -0.08])
    assert (lasers.directions[2, :, 10:] == 0.0).all()
