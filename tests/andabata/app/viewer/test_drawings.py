"""Drawings without a browser: colours, thinning, lines and patches, and what is sent when."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.app.class_colours import CLASS_COLOURS
from andabata.app.drive_frames import DriveFrame, MapFrame
from andabata.app.viewer.cell_drawing import (
    cell_patches,
    map_squares,
    plane_height,
    range_lines,
)
from andabata.app.viewer.cloud_drawing import CloudDrawing, height_colours, thinned
from andabata.app.viewer.robot_drawing import estimate_lines
from andabata.app.viewer.way_drawing import path_lines
from andabata.app.viewer.world_drawing import coarse
from andabata.machine.pose import Pose
from andabata.machine.robot import RobotModel
from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from traversability.cloud import PointCloud
from traversability.grid import PolarGrid

GRID = PolarGrid()


class Node:
    """Node of a scene, as it was sent."""

    def __init__(self, name, points, colours, visible):
        self.name, self.points, self.colours, self.visible = name, points, colours, visible


class Scene:
    """Scene that keeps what is sent."""

    def __init__(self):
        self.sent, self.nodes = [], {}

    def add_point_cloud(self, name, points, colours, position, visible, **_):
        node = Node(name, points + position, colours, visible)
        node.kind = points.dtype
        self.sent.append(name)
        self.nodes[name] = node
        return node


def part(number, count=100):
    """Return a part of a cloud around x = number."""
    rng = np.random.default_rng(number)
    points = rng.normal((number, 0, 0), size=(count, 3)).astype(np.float32)
    classes = np.full(count, SemanticClass.TRUNK, dtype=np.uint8)
    return PointCloud(points, "odom", np.linspace(number, number + 1, count), classes)


def level(x=0.0, y=0.0, yaw=0.0, roll=0.0, pitch=0.0):
    """Return a pose."""
    return Pose.from_euler(np.array([x, y, 0.0]), roll, pitch, yaw)


def test_each_part_of_a_cloud_is_sent_once():
    """A second frame sends what is new alone; a third nothing."""
    scene, parts = Scene(), [part(k) for k in range(6)]
    drawing = CloudDrawing(scene, "/odom", 32_000)
    drawing.draw(DriveFrame(level(), parts=tuple(parts[:4])))
    assert [len(scene.nodes[name].points) for name in scene.sent] == [400]
    for _ in range(2):
        drawing.draw(DriveFrame(level(), parts=tuple(parts)))
        assert [len(scene.nodes[name].points) for name in scene.sent] == [400, 200]
    assert drawing.n_points == 600


def test_parts_that_have_gone_are_hidden_and_their_node_is_used_again():
    """Those that were sent together go together."""
    scene, parts = Scene(), [part(k) for k in range(6)]
    drawing = CloudDrawing(scene, "/odom", 32_000)
    for count in (2, 4, 5):
        drawing.draw(DriveFrame(level(), parts=tuple(parts[:count])))
    drawing.draw(DriveFrame(level(), parts=tuple(parts[1:5])))
    assert [node.visible for node in scene.nodes.values()] == [False, True, True]
    drawing.draw(DriveFrame(level(), parts=tuple(parts[1:])))
    assert scene.sent[3] == scene.sent[0]
    assert drawing.n_points == 400


def test_points_are_half_precision_around_their_middle():
    """They are right to a centimetre, wherever the part lies."""
    scene, far = Scene(), part(500)
    CloudDrawing(scene, "/odom", 32_000).draw(DriveFrame(level(), parts=(far,)))
    (node,) = scene.nodes.values()
    assert node.kind == np.float16
    assert np.abs(node.points - far.points).max() < 0.01
    assert node.colours.dtype == np.uint8
    assert (node.colours == CLASS_COLOURS[SemanticClass.TRUNK]).all()


def test_a_cloud_is_thinned_to_what_is_asked_for():
    """Of 1,000 points no more than 120 are sent, from every part alike."""
    scene = Scene()
    drawing = CloudDrawing(scene, "/odom", 120)
    drawing.draw(DriveFrame(level(), parts=tuple(part(k) for k in range(10))))
    assert drawing.n_points == 120


@pytest.mark.parametrize(("count", "share", "kept"), [(9, 1.0, 9), (10, 0.55, 5), (7, 0.01, 1)])
def test_a_share_of_points_is_evenly_spaced(count, share, kept):
    """It is as many as the share allows, each once, the first among them; nothing stays nothing."""
    chosen = thinned(count, share)
    assert len(set(chosen.tolist())) == kept
    assert chosen[0] == 0
    assert np.ptp(np.diff(chosen)) <= 1 if kept > 1 else True
    assert chosen.max() < count
    assert not len(thinned(0, 1.0))


def test_another_colouring_sends_the_points_anew():
    """By height, low ones are blue and high ones red; without classes that is so at once."""
    scene = Scene()
    drawing = CloudDrawing(scene, "/odom", 32_000)
    frame = DriveFrame(level(), parts=(part(0),))
    drawing.draw(frame)
    drawing.colour_by("height")
    drawing.draw(frame)
    assert len(scene.sent) == 2
    low, high = height_colours(np.array([-3.0, 5.0])).astype(int)
    assert low[2] > low[0]
    assert high[0] > high[2]
    bare = Scene()
    without = replace(part(0), classes=None)
    CloudDrawing(bare, "/odom", 9999).draw(DriveFrame(level(), parts=(without,)))
    heights = without.points[:, 2].astype(float)
    assert (next(iter(bare.nodes.values())).colours == height_colours(heights)).all()


def test_patches_lie_in_their_cells():
    """Every place of a patch is within the sector and the ring of its cell."""
    patches, triangles = cell_patches(GRID)
    radii, angles = np.hypot(*patches.T).T, np.arctan2(patches[..., 1], patches[..., 0])
    cells = np.arange(len(patches))
    ring, sector = cells % GRID.n_rings, cells // GRID.n_rings
    edges = GRID.ring_edges
    assert (radii > edges[ring][:, None]).all()
    assert (radii < edges[ring + 1][:, None]).all()
    apart = (angles - GRID.bearings[sector][:, None] + np.pi) % (2 * np.pi) - np.pi
    assert np.abs(apart).max() < np.pi / GRID.n_sectors
    # All triangles face upwards.
    corners = patches.reshape(-1, 2)[triangles]
    (a, b), (c, d) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
    assert (a * d - b * c > 0).all()


def test_ranges_are_arcs_at_their_distance():
    """Free sectors have green arcs at the last ring, unknown ones none, others blue ones."""
    ranges = np.full(GRID.n_sectors, 3.0, dtype=np.float32)
    ranges[0], ranges[1] = np.inf, np.nan
    lines, colours = range_lines(ranges, GRID)
    each = len(lines) // GRID.n_sectors
    reach = np.hypot(*lines[:, 0].T)
    assert reach[:each] == pytest.approx(GRID.outer_radius)
    assert not reach[each : 2 * each].any()
    assert reach[2 * each :] == pytest.approx(3.0)
    assert colours[0, 0, 1] > colours[0, 0, 2]
    assert colours[-1, 0, 2] > colours[-1, 0, 1]


def test_squares_of_the_map_are_where_its_cells_are():
    """Known cells around the robot come, in the colours of their values."""
    values = np.zeros((64, 64), dtype=np.float32)
    values[40, 32], values[30, 31] = 3.0, -3.0
    layer = MapFrame("occupancy", values, np.array([-6.4, -6.4]), 0.2, 3.0)
    places, colours = map_squares(layer, np.zeros(2))
    assert places == pytest.approx(np.array([[-0.3, -0.1], [1.7, 0.1]]))
    (free_red, free_green, _), (red, green, _) = colours.astype(int)
    assert free_green > free_red
    assert red > green
    assert not len(map_squares(layer, np.array([40.0, 0.0]))[0])


def test_the_plane_of_a_tilted_robot_rises_ahead():
    """Nose up by 10 degrees: a metre ahead lies 17.6 cm higher, beside nothing changes."""
    frame = DriveFrame(level(pitch=-np.deg2rad(10)))
    heights = plane_height(frame, np.array([1.0, 0.0]), np.array([0.0, 1.0]))
    assert heights == pytest.approx([np.tan(np.deg2rad(10)), 0.0])


def test_the_ellipse_holds_two_standard_deviations():
    """Along the axes of the covariance, around the estimated place."""
    covariance = np.diag([0.25, 0.04, 0.01])
    frame = DriveFrame(level(), estimate=level(3.0, -1.0), covariance=covariance)
    rim = estimate_lines(frame, RobotModel())[8:-2, 0]
    reach = np.abs(rim[:, :2] - [3.0, -1.0]).max(axis=0)
    assert reach == pytest.approx([1.0, 0.4], abs=1e-5)


def test_a_long_path_is_drawn_in_few_segments_to_its_end():
    """They are joined, and end at the last position."""
    positions = [np.array([k, 0.0, 0.0]) for k in range(10_000)]
    lines = path_lines(positions)
    assert len(lines) <= 1500
    assert (lines[1:, 0] == lines[:-1, 1]).all()
    assert lines[-1, 1, 0] == 9999
    assert path_lines(positions[:1]).shape == (0, 2, 3)


@pytest.mark.parametrize("nodes", [(100, 100), (801, 801), (517, 389)])
def test_drawn_terrain_has_few_nodes_and_the_same_heights(nodes):
    """A plane stays the same plane at the same place."""
    x, y = ((np.arange(n) - (n - 1) / 2) * 0.1 for n in nodes)
    heights = (0.3 * x[:, None] - 0.1 * y[None]).astype(np.float32)
    few, every = coarse(Heightfield(heights, 0.1))
    assert max(few.heights.shape) <= 160
    assert every == max(-(-max(nodes) // 160), 1)
    assert few.height_at(1.3, -0.7) == pytest.approx(0.3 * 1.3 + 0.07, abs=1e-5)
