"""Drawing of clouds: what is sent when, how thinned, and in which colours."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.machine.pose import Pose
from andabata.report.class_colours import CLASS_COLOURS
from andabata.report.drive_frames import DriveFrame
from andabata.viewer.cloud_drawing import CloudDrawing, height_colours, thinned
from terrain.classes import SemanticClass
from traversability.cloud import PointCloud


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


def shown(scene):
    """Return the number of points that can be seen."""
    return sum(len(node.points) for node in scene.nodes.values() if node.visible)


def test_each_part_of_a_cloud_is_sent_once():
    """A second frame sends what is new alone; a third nothing."""
    scene, parts = Scene(), [part(k) for k in range(6)]
    drawing = CloudDrawing(scene, "/odom", 32_000)
    drawing.draw(DriveFrame(level(), parts=tuple(parts[:4])))
    assert [len(scene.nodes[name].points) for name in scene.sent] == [400]
    for _ in range(2):
        drawing.draw(DriveFrame(level(), parts=tuple(parts)))
        assert [len(scene.nodes[name].points) for name in scene.sent] == [400, 200]
    assert shown(scene) == 600


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
    assert shown(scene) == 400


def test_points_are_half_precision_around_the_robot():
    """They are right to a centimetre, wherever the robot is."""
    scene, far = Scene(), part(500)
    frame = DriveFrame(level(), parts=(far,), odometry=level(510.0))
    CloudDrawing(scene, "/odom", 32_000).draw(frame)
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
    assert shown(scene) == 120


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
