"""Picture of a moment of a drive: cells where they are, plan, goal, shadow, legend, words."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.machine.pose import Pose
from andabata.machine.robot import RobotModel
from andabata.report.class_colours import BLOCKED_COLOUR, FREE_COLOUR, rgb
from andabata.report.drive_frames import DriveFrame, PlanFrame
from andabata.report.plots import drive_picture
from andabata.report.plots.clip import Stand
from andabata.report.plots.drive_picture import draw_drive, legend, status, tinted, way_in_map
from andabata.report.rendering.scenery import Scenery
from traversability.cloud import PointCloud
from traversability.grid import PolarGrid
from traversability.virtual_scan import VirtualScan

GRID, ROBOT = PolarGrid(), RobotModel()


def flat_pose(x, y, yaw):
    """Return a level pose at height zero."""
    return Pose.from_euler(np.array([x, y, 0.0]), 0.0, 0.0, yaw)


def scan_of(log_odds):
    """Return a scan with log odds of its cells."""
    ranges = np.ones(GRID.n_sectors, dtype=np.float32)
    return VirtualScan(ranges, GRID.outer_radius, log_odds.astype(np.float32))


def test_cells_are_tinted_where_they_are():
    """Blocked ground turns redder, free ground greener; unknown ground and crowns stay."""
    log_odds = np.full((GRID.n_sectors, GRID.n_rings), np.nan)
    log_odds[GRID.n_sectors * 3 // 4] = 1.0  # The sector that begins on the left.
    log_odds[GRID.n_sectors // 4] = -1.0  # The sector that begins on the right.
    frame = DriveFrame(flat_pose(10.0, 0.0, np.pi / 2), scan_of(log_odds))
    # Heading along y: left is -x, right is +x; a little further on in the turn for each.
    left, right, ahead = (7.0, -0.1, 0.0), (13.0, 0.1, 0.0), (10.0, 3.0, 0.0)
    crown, far = (7.0, -0.1, 3.0), (-30.0, -0.5, 0.0)
    grey = np.full((5, 3), 120.0)
    change = tinted(grey, np.array([left, right, ahead, crown, far]), frame, GRID) - grey
    assert change[0, 0] > 0 > change[0, 1]
    assert change[1, 1] > 0 > change[1, 0]
    assert np.array_equal(change[2:], np.zeros((3, 3)))


def test_cells_are_lighter_at_their_edges():
    """The colour of a cell is stronger in its middle than at its rim and at its sides."""
    log_odds = np.full((GRID.n_sectors, GRID.n_rings), -1.0)
    frame = DriveFrame(flat_pose(0.0, 0.0, 0.0), scan_of(log_odds))
    edges = GRID.ring_edges
    middle, rim = (edges[-2] + edges[-1]) / 2, edges[-2] + 0.01
    # A sector begins straight ahead.
    half = np.pi / GRID.n_sectors
    places = [(middle, half), (rim, half), (middle, 0.001)]
    hits = np.array([[r * np.cos(a), r * np.sin(a), 0.0] for r, a in places])
    inner, at_rim, at_side = np.abs(tinted(np.full((3, 3), 120.0), hits, frame, GRID) - 120).sum(1)
    assert at_rim == pytest.approx(at_side)
    assert at_rim < 0.5 * inner


def test_a_scan_stays_at_the_pose_at_which_it_was_taken():
    """A robot that drove on does not take its cells along."""
    log_odds = np.full((GRID.n_sectors, GRID.n_rings), 1.0)
    frame = DriveFrame(
        flat_pose(50.0, 0.0, 0.0), scan_of(log_odds), scan_pose=flat_pose(0.0, 0.0, 0.0)
    )
    grey = np.full((2, 3), 120.0)
    change = tinted(grey, np.array([[3.0, 0.3, 0.0], [53.0, 0.3, 0.0]]), frame, GRID) - grey
    assert change[0].any()
    assert not change[1].any()


def test_the_way_lies_around_the_drawn_robot():
    """What is ahead in odom is ahead in the map, where the two differ by a turn."""
    plan = PlanFrame(np.array([2.0, 0.0]), np.array([[1.0, 5.0], [3.0, 5.0]]))
    odometry = Pose.from_euler(np.array([1.0, 5.0, 0.0]), 0.0, 0.0, 0.0)
    frame = DriveFrame(flat_pose(10.0, 0.0, np.pi / 2), odometry=odometry, plan=plan)
    assert way_in_map(frame) == pytest.approx(np.array([[10.0, 0.0], [10.0, 2.0]]))
    assert way_in_map(replace(frame, plan=None)).shape == (0, 2)


def test_the_legend_is_what_is_drawn():
    """An empty frame has none; each thing that comes has its entry, in its colour."""
    frame = DriveFrame(flat_pose(0.0, 0.0, 0.0))
    assert legend(frame) == []
    scan = scan_of(np.zeros((GRID.n_sectors, GRID.n_rings)))
    cloud = PointCloud(np.zeros((1, 3), dtype=np.float32), "odom", np.zeros(1))
    way = np.array([[0.0, 0.0], [3.0, 0.0]])
    frame = replace(
        frame, scan=scan, parts=(cloud,), n_positions=9, plan=PlanFrame(np.zeros(2), way)
    )
    entries = legend(frame)
    assert [each.text for each in entries] == ["free", "blocked", "laser", "driven", "plan"]
    assert [each.colour for each in entries[:2]] == [rgb(FREE_COLOUR), rgb(BLOCKED_COLOUR)]
    assert {each.colour for each in entries} <= set(drive_picture.LEGEND_COLOURS)


def test_the_caption_tells_time_and_distance():
    """Without a goal the time alone."""
    frame = DriveFrame(flat_pose(1.0, 0.0, 0.0), stamp=12.4)
    assert status(frame) == "12 s"
    assert status(replace(frame, goal=np.array([4.0, 4.0]))) == "12 s, goal 5 m away"


@pytest.fixture(scope="module")
def scenery(scenes):
    """Return the scenery of a natural world."""
    return Scenery(scenes.get("natural", 3).world)


def drawn(scenery, frame, path):
    """Return the pixels of a frame from behind its robot."""
    camera = Stand(6.5, 5.0, 3.5).camera(frame.pose, frame.pose.yaw, (480, 300))
    return camera, np.asarray(draw_drive(frame, path, camera, scenery, GRID, ROBOT)).astype(int)


def near(pixels, colour):
    """Return places of the pixels of a colour, row and column, shape (k, 2)."""
    return np.argwhere((np.abs(pixels - colour) < 30).all(axis=2))


def test_plan_goal_and_path_are_in_the_picture(scenery):
    """The flag stands at the goal, the plan leads there, the path comes from behind."""
    start = scenery.world.tasks[0].start
    ground = scenery.world.ground
    height = float(ground.height_at(start.x, start.y))
    pose = Pose.from_euler(np.array([start.x, start.y, height]), 0.0, 0.0, start.yaw)
    ahead = np.array([np.cos(start.yaw), np.sin(start.yaw)])
    goal = pose.position[:2] + 5 * ahead
    path = pose.position - np.linspace(3.0, 0.0, 30)[:, None] * np.append(ahead, 0.0)
    bare = DriveFrame(pose, odometry=pose, n_positions=30)
    way = pose.position[:2] + np.linspace(0, 5, 20)[:, None] * ahead
    camera, without = drawn(scenery, bare, path[-1:])
    _, shown = drawn(scenery, replace(bare, goal=goal, plan=PlanFrame(goal, way)), path)
    blue = near(shown, drive_picture.PLAN)
    # The legend has some, too.
    blue = blue[blue[:, 0] < 280]
    foot = np.append(goal, ground.height_at(*goal))
    column, row, _ = camera.project(foot[None])[0]
    assert np.hypot(*(blue - [row, column]).T).min() < 12
    assert blue[:, 0].min() < row - 15  # The flag.
    assert len(blue) > 100
    assert len(near(without[:280], drive_picture.PLAN)) < 20
    assert len(near(shown[:280], drive_picture.PATH)) > 20


def test_a_robot_throws_a_shadow_on_the_ground():
    """Under its deck it is darker, two metres away it is not."""
    frame = DriveFrame(flat_pose(0.0, 0.0, 0.0))
    hits = np.array([[0.0, 0.0, 0.0], [2.0, 2.0, 0.0], [0.0, 0.0, 0.6]])
    found = drive_picture.under_robot(np.full((3, 3), 100.0), hits, frame, ROBOT)
    assert found[0, 0] < 100
    assert found[1:].tolist() == [[100.0] * 3] * 2
