"""Clips of drives: where the camera sees points, what frames hold, and what the picture shows."""

import io
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from andabata.assembly.controllers import make_steering
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.machine.pose import Pose
from andabata.models import Models
from andabata.report.drive_frames import DriveFrame
from andabata.report.plots import clip
from andabata.report.plots.clip import Camera, ClipRecorder
from tests.support.walking_worlds import peopled, walker
from traversability.virtual_scan import VirtualScan
from worlds.walking import Walkers

CONFIG = SimulatedRobotConfig(plant="kinematic")


@pytest.fixture(scope="module")
def driven(scenes):
    """Return the recorder of a robot that drove for four seconds in a natural world."""
    scene = scenes.get("natural", 3)
    robot = SimulatedRobot(
        scene, CONFIG, Models(), make_steering("straight", scene.world, CONFIG, Models())
    )
    recorder = ClipRecorder(robot)
    task = scene.world.tasks[0]
    readings = robot.place(task.start, np.array(task.goals[0]), np.random.default_rng(0))
    for _ in range(40):
        readings = robot.step(readings)
    return recorder


def test_walkers_are_in_the_picture(make_scene, driven):
    """Pixels that show one have its colour; later steps do not move it."""
    scene = make_scene()
    walkers = Walkers(peopled(scene.world, walker((2.0, 0.0), (0.5, 0.0))), 100.0)
    track = walkers.track.last(1).copy()
    walkers.step(300, (-5.0, 0.0), 0.0)
    pose = flat_pose(0.0, 0.0, 0.0)
    frames = [DriveFrame(pose, walkers=each) for each in (None, track)]
    bare, seen = (
        np.asarray(
            clip._picture(each, np.zeros((1, 3)), camera(), scene.rays, CONFIG), dtype=np.int64
        )
        for each in frames
    )
    column, row, _ = camera().project(np.array([[2.0, 0.0, 1.0]]))[0]
    red, green, blue = seen[int(row), int(column)]
    assert blue > red > green
    changed = np.argwhere((bare != seen).any(axis=2))
    assert 50 < len(changed) < 5000
    assert abs(np.median(changed[:, 1]) - column) < 8


def flat_pose(x, y, yaw):
    """Return a level pose at height zero."""
    return Pose.from_euler(np.array([x, y, 0.0]), 0.0, 0.0, yaw)


def camera():
    """Return a camera behind a robot at the origin that looks along x."""
    return Camera.behind(flat_pose(0.0, 0.0, 0.0), 0.0)


def test_a_point_ahead_is_above_the_robot_and_one_on_the_left_is_left_of_it():
    """Columns grow to the right, rows downwards."""
    robot, ahead, left = camera().project(np.array([[0, 0, 0], [5, 0, 0], [0, 2, 0]], float))
    assert robot[0] == pytest.approx(clip.WIDTH / 2)
    assert ahead[0] == pytest.approx(clip.WIDTH / 2)
    assert ahead[1] < robot[1]
    assert left[0] < robot[0]


def test_a_point_behind_the_camera_is_nowhere():
    """Its row and column are NaN."""
    assert np.isnan(camera().project(np.array([[-30.0, 0.0, 0.0]]))).all()


def test_the_ray_of_a_pixel_goes_through_the_point_projected_there():
    """Rays and projection are each other's inverse."""
    found = camera().rays(clip.WIDTH, clip.HEIGHT).astype(float)
    row, column = 200, 123
    ray = found[row * clip.WIDTH + column]
    ((x, y, distance),) = camera().project((ray[:3] + 4 * ray[3:])[None])
    assert (x, y) == pytest.approx((column + 0.5, row + 0.5), abs=0.01)
    assert distance == pytest.approx(clip._NEAR + 4, abs=1e-3)


def test_frames_are_every_second_step_and_know_their_part_of_the_path(driven):
    """Positions are of every step; a frame counts those up to its own."""
    assert len(driven.positions) == 40
    assert [frame.n_positions for frame in driven.frames] == list(range(2, 41, 2))
    last = driven.frames[-1]
    assert np.array_equal(last.pose.position, driven.positions[-1])


def test_laser_points_lie_in_the_map_around_the_robot(driven):
    """Points of a frame are within the laser's reach of the true position."""
    frame = driven.frames[-1]
    points, ages = frame.points()
    assert 500 < len(points) <= clip._MAX_POINTS
    distances = np.linalg.norm(points - frame.pose.position, axis=1)
    assert distances.max() < CONFIG.assembly.max_range + 2
    assert ages.min() == 0 < ages.max()


def test_a_long_drive_keeps_few_frames(driven, monkeypatch):
    """Beyond the limit every second frame goes, and later ones come half as often."""
    monkeypatch.setattr(clip, "MAX_FRAMES", 10)
    monkeypatch.setattr(driven, "_interval", 2)
    monkeypatch.setattr(driven, "frames", [])
    source = driven._source
    monkeypatch.setattr(source, "positions", [])
    frame = DriveFrame(flat_pose(1.0, 2.0, 0.3))
    monkeypatch.setattr(source, "advance", lambda result: source.positions.append(None))
    monkeypatch.setattr(
        source, "frame", lambda result, with_plan: replace(frame, n_positions=len(source.positions))
    )
    for _ in range(60):
        driven(None)
    counts = [frame.n_positions for frame in driven.frames]
    assert len(counts) < 10
    assert len(set(np.diff(counts))) == 1


def test_the_clip_is_a_moving_picture_of_the_asked_length(driven):
    """Ten pictures in a second, no more than there are frames; they differ."""
    moving = Image.open(io.BytesIO(driven.film(seconds=0.5, rate=10.0)))
    assert (moving.n_frames, moving.size) == (5, (clip.WIDTH, clip.HEIGHT))
    first = np.asarray(moving.convert("RGB"))
    moving.seek(4)
    assert (first != np.asarray(moving.convert("RGB"))).any()
    assert Image.open(io.BytesIO(driven.film(seconds=8.0))).n_frames == len(driven.frames)


def test_cells_are_tinted_where_they_are():
    """Blocked ground turns redder, free ground greener; unknown ground and crowns stay."""
    grid = CONFIG.grid
    log_odds = np.full((grid.n_sectors, grid.n_rings), np.nan, dtype=np.float32)
    log_odds[grid.n_sectors * 3 // 4] = 1.0  # The sector that begins on the left.
    log_odds[grid.n_sectors // 4] = -1.0  # The sector that begins on the right.
    scan = VirtualScan(np.ones(grid.n_sectors, dtype=np.float32), grid.outer_radius, log_odds)
    frame = DriveFrame(flat_pose(10.0, 0.0, np.pi / 2), scan)
    # Heading along y: left is -x, right is +x; a little further on in the turn for each.
    left, right, ahead = (7.0, -0.1, 0.0), (13.0, 0.1, 0.0), (10.0, 3.0, 0.0)
    crown, far = (7.0, -0.1, 3.0), (-30.0, -0.5, 0.0)
    grey = np.full((5, 3), 120.0)
    tinted = clip._tinted(grey, np.array([left, right, ahead, crown, far]), frame, grid) - grey
    assert tinted[0, 0] > 0 > tinted[0, 1]
    assert tinted[1, 1] > 0 > tinted[1, 0]
    assert np.array_equal(tinted[2:], np.zeros((3, 3)))


def test_points_behind_something_are_hidden():
    """A projected point is drawn if it is in the picture and nearer than what is seen there."""
    seen = np.full((clip.HEIGHT, clip.WIDTH), 10.0, dtype=np.float32)
    near, far, outside, behind = (5.0, 5.0, 9.0), (5.0, 5.0, 11.0), (-1.0, 5.0, 9.0), (np.nan,) * 3
    shown = clip._visible(np.array([near, far, outside, behind]), seen, 0.4)
    assert shown.tolist() == [True, False, False, False]


def test_a_robot_without_the_rotating_laser_is_refused(scenes):
    """The horizontal scanner makes no clouds to draw."""
    config = CONFIG.model_copy(
        update={"sensing": CONFIG.sensing.model_copy(update={"scanner": "horizontal"})}
    )
    scene = scenes.get("natural", 3)
    robot = SimulatedRobot(
        scene, config, Models(), make_steering("straight", scene.world, config, Models())
    )
    with pytest.raises(ValueError, match="leave out --clip"):
        ClipRecorder(robot)


def test_no_frames_make_no_clip(scenes):
    """A robot that did not drive cannot be drawn."""
    scene = scenes.get("natural", 3)
    steering = make_steering("straight", scene.world, CONFIG, Models())
    with pytest.raises(ValueError, match="expected a drive of two steps"):
        ClipRecorder(SimulatedRobot(scene, CONFIG, Models(), steering)).film()
