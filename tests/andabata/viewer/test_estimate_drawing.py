"""Drawing of what the robot believes: ellipse, wedge, body, and the colour of its health."""

from types import SimpleNamespace

import numpy as np
import pytest

from andabata.localization.estimator_status import EstimatorStatus
from andabata.localization.localizer import Health
from andabata.machine.pose import Pose
from andabata.machine.robot import RobotModel
from andabata.report.class_colours import HEALTH_COLOURS, rgb
from andabata.report.drive_frames import DriveFrame
from andabata.viewer.estimate_drawing import (
    EstimateDrawing,
    body_lines,
    ellipse_rim,
    fan,
    wedge,
)

ROBOT = RobotModel()


def level(x=0.0, y=0.0, yaw=0.0):
    """Return a level pose."""
    return Pose.from_euler(np.array([x, y, 0.0]), 0.0, 0.0, yaw)


def status(health=Health.OK):
    """Return a status with half axes of 0.5 and 0.2 m and a heading to 0.1 rad."""
    return EstimatorStatus(health, (), np.diag([0.25, 0.04, 1.0, 0.0, 0.0, 0.01]))


class Scene:
    """Scene whose nodes are plain objects, by name."""

    def __init__(self):
        self.nodes = {}

    def add_line_segments(self, name, points, colors, **about):
        """Keep lines."""
        self.nodes[name] = SimpleNamespace(points=points, visible=True)
        return self.nodes[name]

    def add_mesh_simple(self, name, vertices, faces, **about):
        """Keep a mesh."""
        self.nodes[name] = SimpleNamespace(vertices=vertices, faces=faces, visible=True)
        return self.nodes[name]


@pytest.fixture
def scene():
    """Return an empty scene."""
    return Scene()


def test_the_ellipse_holds_two_standard_deviations():
    """Along the axes of the covariance, around the estimated place; the rim is closed."""
    rim = ellipse_rim(level(3.0, -1.0, 0.7), status())
    reach = np.abs(rim[1:] - [3.0, -1.0]).max(axis=0)
    assert reach == pytest.approx([1.0, 0.4], abs=1e-5)
    np.testing.assert_array_equal(rim[0], [3.0, -1.0])
    np.testing.assert_array_equal(rim[1], rim[-1])


def test_the_wedge_holds_two_standard_deviations_of_the_heading():
    """From the estimated place, to either side of the estimated heading."""
    tip, *arc = wedge(level(3.0, -1.0, 0.7), status())
    np.testing.assert_array_equal(tip, [3.0, -1.0])
    ahead = np.array(arc) - tip
    bearings = np.arctan2(ahead[:, 1], ahead[:, 0])
    assert (bearings[0], bearings[-1]) == pytest.approx((0.5, 0.9))


def test_the_body_stands_at_the_estimate():
    """Its corners are half a length ahead and half a width aside, turned by the heading."""
    lines = body_lines(level(1.0, 2.0, np.pi / 2), ROBOT).reshape(-1, 3)
    assert lines.max(axis=0)[:2] == pytest.approx([1 + ROBOT.width / 2, 2 + ROBOT.length / 2])
    assert lines.min(axis=0)[:2] == pytest.approx([1 - ROBOT.width / 2, 2 - ROBOT.length / 2])


def test_every_triangle_of_a_fan_has_the_middle_and_an_edge():
    """Its rim begins behind the middle."""
    assert fan(3).tolist() == [[0, 1, 2], [0, 2, 3], [0, 3, 4]]


def test_colour_and_place_follow_the_frame(scene):
    """On the ground that is given, in the colour of the health."""
    drawing = EstimateDrawing(scene, "/map", ROBOT, lambda x, y: 0.1 * x)
    drawing.draw(DriveFrame(level(), estimate=level(10.0), status=status(Health.LOST)))
    ellipse = scene.nodes["/map/estimate_ellipse"]
    assert ellipse.color == rgb(HEALTH_COLOURS[Health.LOST])
    assert len(ellipse.vertices) == ellipse.faces.max() + 1
    assert ellipse.vertices[0] == pytest.approx([10.0, 0.0, 1.14])
    lines = scene.nodes["/map/estimate"]
    assert lines.points[8:, :, 0].max() == pytest.approx(11.0, abs=1e-3)
    assert lines.colors[0, 0].tolist() == list(rgb(HEALTH_COLOURS[Health.LOST]))
    drawing.draw(DriveFrame(level(), estimate=level(10.0), status=status()))
    assert ellipse.color == rgb(HEALTH_COLOURS[Health.OK])


def test_nothing_is_drawn_where_nothing_is_believed_or_it_is_hidden(scene):
    """A path from a folder has no estimate; the box hides it, too."""
    drawing = EstimateDrawing(scene, "/map", ROBOT, None)
    drawing.draw(DriveFrame(level()))
    assert not any(node.visible for node in scene.nodes.values())
    drawing.draw(DriveFrame(level(), status=status()))
    assert all(node.visible for node in scene.nodes.values())
    drawing.show(False)
    drawing.draw(DriveFrame(level(), status=status()))
    assert not any(node.visible for node in scene.nodes.values())
