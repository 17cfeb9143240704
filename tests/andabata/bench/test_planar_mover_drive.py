"""Tracks of the planar laser against the movers of rooms."""

import numpy as np
import pytest

from andabata.bench.planar_mover_drive import (
    ROOM_KINDS,
    PlanarMoverProbe,
    drive_among_planar_movers,
)
from andabata.machine.kinematics import Twist
from andabata.machine.planar.vehicle import PLANAR_VEHICLES
from andabata.navigation.planar.circle_tracks import CircleTracksConfig
from andabata.tasks.rooms.planar_drive import BARN_LIDAR, SimulatedPlanarRobot
from worlds.rooms.movers import MoverPlan
from worlds.rooms.room import Room, RoomTask
from worlds.world import Start

TASK = RoomTask(Start(0.0, 0.0, 0.0), (8.0, 0.0))
CROSSING = ((0.0, 3.0, -1.5), (4.0, 3.0, 2.5))


def watch(course=CROSSING, boxes=(), periods=60):
    """Return the measures of a robot that stands and looks at one mover of 0.3 m."""
    mover = MoverPlan(radius=0.3, place=course[0][1:], course=course)
    walls = np.reshape(np.array(boxes, dtype=float), (-1, 4))
    room = Room("r", (9.0, 9.0), walls, np.zeros((0, 3)), (TASK,), movers=(mover,))
    vehicle = PLANAR_VEHICLES["barn"]
    robot = SimulatedPlanarRobot(room, TASK, vehicle, BARN_LIDAR, np.random.default_rng(0))
    probe = PlanarMoverProbe(("planar", "r", 1), CircleTracksConfig())
    for _ in range(periods):
        probe(robot.read(), robot)
        robot.step(Twist(0.0, 0.0))
    return probe.finish(periods * vehicle.period)


def test_a_mover_in_the_open_is_found_with_its_velocity():
    """After a second in sight at each moment; its speed is the true one."""
    drive = watch()
    assert 38 <= len(drive.moments) <= 42
    assert all(moment.found for moment in drive.moments)
    assert max(moment.velocity_error for moment in drive.moments) < 0.3
    assert max(moment.place_error for moment in drive.moments) < 0.1
    assert [moment.speed for moment in drive.moments] == pytest.approx([1.0] * len(drive.moments))
    assert (drive.false_tracks, drive.encounters, drive.met) == (0, 1, 1)
    assert 0.0 < drive.cost < 1.0


def test_a_mover_behind_a_wall_or_behind_the_laser_is_not_in_sight():
    """Nothing ends at it; 270 degrees leave a quarter out."""
    assert not watch(boxes=[(1.0, -3.0, 1.2, 3.0)]).moments
    behind = ((0.0, -3.0, -0.5), (4.0, -3.0, 0.5))
    assert not watch(behind).moments


def test_half_a_mover_is_in_sight():
    """A wall that hides one side leaves two of three beams, one that hides more leaves one."""
    course = ((0.0, 3.0, 0.0), (99.0, 3.0, 0.001))
    assert watch(course, [(1.0, -3.0, 1.2, -0.06)]).moments
    assert not watch(course, [(1.0, -3.0, 1.2, 0.06)]).moments


def test_a_drive_takes_one_task_after_the_other():
    """For its time, in each kind of room; the same case gives the same moments."""
    for kind in ROOM_KINDS[:3]:
        case = ("planar", kind, 7300)
        drive = drive_among_planar_movers(CircleTracksConfig(), 1.5, case)
        assert drive.case == case
        assert drive.duration == pytest.approx(1.5)
    again = drive_among_planar_movers(CircleTracksConfig(), 1.5, case)
    assert (again.moments, again.tracks) == (drive.moments, drive.tracks)
