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
from andabata.report.plots.clip import ClipRecorder
from andabata.report.plots.drive_picture import draw_drive
from andabata.report.rendering.scenery import Scenery
from tests.support.walking_worlds import peopled, walker
from worlds.walking import Walkers

CONFIG = SimulatedRobotConfig(plant="kinematic")


@pytest.fixture(scope="module")
def driven(scenes):
    """Return the recorder of a robot that drove for 2.4 seconds in a natural world."""
    scene = scenes.get("natural", 3)
    robot = SimulatedRobot(
        scene, CONFIG, Models(), make_steering("straight", scene.world, CONFIG, Models())
    )
    recorder = ClipRecorder(robot)
    task = scene.world.tasks[0]
    readings = robot.place(task.start, np.array(task.goals[0]), np.random.default_rng(0))
    for _ in range(24):
        readings = robot.step(readings)
    return recorder


@pytest.fixture(scope="module")
def planned(scenes):
    """Return the recorder of a robot that planned for a second with the shipped planner."""
    scene = scenes.get("natural", 3)
    robot = SimulatedRobot(
        scene, CONFIG, Models(), make_steering("planner", scene.world, CONFIG, Models())
    )
    recorder = ClipRecorder(robot)
    task = scene.world.tasks[0]
    readings = robot.place(task.start, np.array(task.goals[0]), np.random.default_rng(0))
    for _ in range(45):
        readings = robot.step(readings)
    return recorder


def test_walkers_are_in_the_picture(make_scene):
    """Pixels that show one have its colour; later steps do not move it."""
    scene = make_scene()
    walkers = Walkers(peopled(scene.world, walker((3.0, 0.0), (0.5, 0.0))), 100.0)
    track = walkers.track.last(1).copy()
    walkers.step(300, (-5.0, 0.0), 0.0)
    pose = flat_pose(0.0, 0.0, 0.0)
    scenery = Scenery(scene.world)
    bare, seen = (
        np.asarray(
            draw_drive(
                DriveFrame(pose, walkers=each),
                np.zeros((1, 3)),
                camera(),
                scenery,
                CONFIG.grid,
                CONFIG.robot,
            ),
            dtype=np.int64,
        )
        for each in (None, track)
    )
    column, row, _ = camera().project(np.array([[2.75, 0.0, 1.0]]))[0]
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
    return clip._FOLLOWING.camera(flat_pose(0.0, 0.0, 0.0), 0.0, (480, 300))


def test_the_camera_looks_over_the_robots_shoulder():
    """It stands behind and above, and what is ahead is in the middle."""
    stand = clip.Stand(back=6.0, up=4.0, ahead=3.0, aside=1.0)
    found = stand.camera(flat_pose(10.0, 0.0, 0.0), np.pi / 2, (480, 300))
    assert found.place == pytest.approx([9.0, -6.0, 4.0])
    assert found.project(np.array([[10.0, 3.0, 0.0]]))[0, :2] == pytest.approx([240, 150])


def test_frames_are_every_second_step_and_know_their_part_of_the_path(driven):
    """Positions are of every step; a frame counts those up to its own."""
    assert len(driven.positions) == 24
    assert [frame.n_positions for frame in driven.frames] == list(range(2, 25, 2))
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
        source, "frame", lambda result: replace(frame, n_positions=len(source.positions))
    )
    for _ in range(60):
        driven(None)
    counts = [frame.n_positions for frame in driven.frames]
    assert len(counts) < 10
    assert len(set(np.diff(counts))) == 1


def test_the_clip_is_a_moving_picture_of_the_asked_length(driven, monkeypatch):
    """Ten pictures in a second, no more than there are frames; they differ."""
    moving = Image.open(io.BytesIO(driven.film(seconds=0.3, rate=10.0)))
    assert (moving.n_frames, moving.size) == (3, (clip.WIDTH, clip.HEIGHT))
    first = np.asarray(moving.convert("RGB"))
    moving.seek(2)
    assert (first != np.asarray(moving.convert("RGB"))).any()
    monkeypatch.setattr(driven, "frames", driven.frames[-2:])
    assert Image.open(io.BytesIO(driven.film(seconds=8.0))).n_frames == 2


def test_a_clip_that_ends_in_png_is_the_last_moment(driven, monkeypatch):
    """One picture, larger than those of a film."""
    assert clip.STILL_WIDTH > clip.WIDTH
    assert clip.STILL_HEIGHT > clip.HEIGHT
    for name, size in (
        ("WIDTH", 240),
        ("HEIGHT", 150),
        ("STILL_WIDTH", 400),
        ("STILL_HEIGHT", 225),
    ):
        monkeypatch.setattr(clip, name, size)  # Rays take most of the time.
    with Image.open(io.BytesIO(driven.film(".png"))) as picture:
        assert picture.format == "PNG"
        assert picture.size == (400, 225)


def test_frames_know_the_plan_and_the_goal(planned):
    """The plan begins at the robot, and the goal is where it was set."""
    frame = planned.frames[-1]
    assert frame.plan is not None
    assert len(frame.plan.way) > 1
    assert np.hypot(*(frame.plan.way[0] - frame.odometry.position[:2])) < 0.5


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
