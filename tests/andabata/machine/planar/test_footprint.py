"""Footprints: contact with circles, boxes and walls, exactly."""

import numpy as np
import pytest

from andabata.machine.planar.footprint import (
    Obstacles,
    box_footprint,
    check_convex,
    inner_radius_of,
    outline_distance,
    reach_of,
    touches,
)

BOX = box_footprint(0.508, 0.430)
KITE = ((0.5, 0.0), (0.0, 0.3), (-0.2, 0.0), (0.0, -0.25))


def obstacles(boxes=(), circles=(), walls=()):
    """Return obstacles from rows."""
    return Obstacles(
        np.array(boxes, dtype=float).reshape(-1, 4),
        np.array(circles, dtype=float).reshape(-1, 3),
        np.array(walls, dtype=float).reshape(-1, 4),
    )


def touching(pose, corners, around):
    """Return whether a footprint touches something."""
    return touches(*pose, np.array(corners), reach_of(corners), around)


def dense(corners, step=0.004):
    """Return points that fill an outline, a step apart."""
    xs = np.arange(-0.6, 0.6, step)
    points = np.stack(np.meshgrid(xs, xs), -1).reshape(-1, 2)
    sides = np.roll(corners, -1, axis=0) - corners
    offsets = points[:, None] - np.array(corners)
    inside = sides[:, 0] * offsets[..., 1] - sides[:, 1] * offsets[..., 0] >= 0
    return points[inside.all(axis=1)]


def placed(points, pose):
    """Return points of the robot's frame in the plane."""
    x, y, yaw = pose
    c, s = np.cos(yaw), np.sin(yaw)
    return points @ np.array([[c, s], [-s, c]]) + (x, y)


def gap(points, around):
    """Return the distance of the nearest of points from the nearest obstacle."""
    found = [np.hypot(*(points - c[:2]).T) - c[2] for c in around.circles]
    for x0, y0, x1, y1 in around.boxes:
        dx = np.maximum(np.maximum(x0 - points[:, 0], points[:, 0] - x1), 0)
        dy = np.maximum(np.maximum(y0 - points[:, 1], points[:, 1] - y1), 0)
        found.append(np.hypot(dx, dy))
    for x0, y0, x1, y1 in around.walls:
        along = np.array([x1 - x0, y1 - y0])
        share = np.clip((points - (x0, y0)) @ along / (along @ along), 0, 1)
        found.append(np.hypot(*(points - (x0, y0) - share[:, None] * along).T))
    return min(each.min() for each in found)


@pytest.mark.parametrize("corners", [BOX, KITE])
@pytest.mark.parametrize("kind", ["boxes", "circles", "walls"])
def test_contact_is_that_of_a_dense_reference(corners, kind):
    """Random poses touch where points that fill the footprint do, but for their own distance."""
    rng, filled = np.random.default_rng(0), dense(corners)
    ends = np.zeros(2, dtype=int)
    for _ in range(150):
        a, b = np.sort(rng.uniform(-0.8, 0.8, (2, 2)), axis=1).T
        rows = {
            "boxes": [*a, *b],
            "circles": [*rng.uniform(-0.8, 0.8, 2), rng.uniform(0.05, 0.4)],
            "walls": rng.uniform(-0.8, 0.8, 4),
        }
        around = obstacles(**{kind: [rows[kind]]})
        pose = (*rng.uniform(-0.4, 0.4, 2), rng.uniform(-3, 3))
        distance = gap(placed(filled, pose), around)
        if touching(pose, corners, around):
            assert distance < 0.004
            ends[0] += 1
        else:
            assert distance > 0
            ends[1] += 1
    assert ends.min() > 20


def test_contact_begins_where_edges_meet():
    """A millimetre decides: ahead, aside, at a corner, and turned by a right angle."""
    circle = obstacles(circles=[(1.0, 0.0, 0.075)])
    assert not touching((1.0 - 0.254 - 0.075 - 0.001, 0.0, 0.0), BOX, circle)
    assert touching((1.0 - 0.254 - 0.075 + 0.001, 0.0, 0.0), BOX, circle)
    assert not touching((1.0 - 0.215 - 0.075 - 0.001, 0.0, np.pi / 2), BOX, circle)
    assert touching((1.0 - 0.215 - 0.075 + 0.001, 0.0, np.pi / 2), BOX, circle)
    far = 0.075 / np.sqrt(2)
    for short, expected in ((0.001, False), (-0.001, True)):
        corner = obstacles(circles=[(0.254 + far + short, 0.215 + far + short, 0.075)])
        assert touching((0.0, 0.0, 0.0), BOX, corner) is expected


def test_what_is_inside_touches():
    """A circle or a box under the robot, a robot inside of a box, a wall across it."""
    assert touching((0.0, 0.0, 0.3), BOX, obstacles(circles=[(0.05, 0.0, 0.01)]))
    assert touching((0.0, 0.0, 0.3), BOX, obstacles(boxes=[(0.0, 0.0, 0.01, 0.01)]))
    assert touching((0.0, 0.0, 0.3), BOX, obstacles(boxes=[(-2, -2, 2, 2)]))
    assert touching((0.0, 0.0, 0.3), BOX, obstacles(walls=[(-2, 0.1, 2, 0.1)]))
    assert not touching((0.0, 0.0, 0.3), BOX, obstacles())


def test_distances_of_points_from_an_outline():
    """0 inside, to a side, to a corner."""
    corners = np.array(box_footprint(2.0, 1.0))
    assert outline_distance(0.3, -0.2, corners) == 0
    assert outline_distance(0.3, -0.7, corners) == pytest.approx(0.2)
    assert outline_distance(1.3, 0.9, corners) == pytest.approx(0.5)


@pytest.mark.parametrize(
    "corners",
    [
        BOX[::-1],
        BOX[:2],
        ((1.0, -1.0), (2.0, 0.0), (1.0, 1.0)),
        ((0.5, -0.5), (0.1, 0.0), (0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5)),
    ],
)
def test_other_outlines_are_refused(corners):
    """Clockwise, too few corners, not around the centre, a dent."""
    with pytest.raises(ValueError, match="convex outline, counter-clockwise"):
        check_convex(corners)


def test_the_inner_radius_is_the_distance_of_the_nearest_side():
    """Of a box it is half of its lesser extent, of a regular outline that of all sides."""
    assert inner_radius_of(box_footprint(0.5, 0.4)) == pytest.approx(0.2)
    corners = tuple((np.cos(a), np.sin(a)) for a in np.arange(6) * np.pi / 3)
    assert inner_radius_of(corners) == pytest.approx(np.cos(np.pi / 6))
