"""Memory of scans: hits that beams pass, in earlier scans and now, and those that none passes."""

import math

import numpy as np
import pytest

from andabata.navigation.planar.hit_layer import LaserPose
from andabata.navigation.planar.scan_memory import COLUMNS, PassLaw, ScanMemory

BEARINGS = np.radians(np.arange(-135.0, 135.5, 0.5))
LAW = PassLaw(margin=0.1, gate=0.3, max_range=6.0)
RADIUS = 0.2
PERIOD = 0.1


HERE = LaserPose()


def scan(place, eye=HERE, wall=8.0):
    """Return the ranges to a disc before a far wall, and its circle with three probes if seen."""
    angles = eye.yaw + BEARINGS
    dx, dy = place[0] - eye.x, place[1] - eye.y
    along = np.cos(angles) * dx + np.sin(angles) * dy
    beside = dx * dx + dy * dy - along**2
    meets = (beside < RADIUS**2) & (along > 0)
    ranges = np.where(meets, along - np.sqrt(np.maximum(RADIUS**2 - beside, 0.0)), wall)
    front = math.atan2(-dy, -dx)
    circle = np.empty(COLUMNS)
    circle[:3] = *place, RADIUS
    for probe, turn in enumerate((-0.6, 0.0, 0.6)):
        circle[3 + 2 * probe] = place[0] + 0.15 * math.cos(front + turn)
        circle[4 + 2 * probe] = place[1] + 0.15 * math.sin(front + turn)
    return ranges, circle[None][: int(meets.any())]


def passes(places, eyes=None, scans=10, law=LAW, velocity=None):
    """Return in how many scans the last place of a disc is shown to be another."""
    memory = ScanMemory(BEARINGS, scans, PERIOD, law)
    eyes = [HERE] * len(places) if eyes is None else eyes
    for place, eye in zip(places, eyes, strict=True):
        memory.take(eye, *scan(place, eye))
    last = np.array([places[-1]], dtype=np.float64)
    if velocity is None:
        velocity = (last[0] - places[0]) / (PERIOD * max(len(places) - 1, 1))
    return int(memory.count_passes(last, np.array([velocity], dtype=np.float64))[0])


@pytest.mark.parametrize("step", [(0.0, 0.1), (-0.1, 0.0), (0.1, 0.0), (0.07, -0.07)])
def test_what_moves_is_shown_by_each_scan_from_far_enough(step):
    """Across, towards, away and aslant: scans from 0.3 m away show it, those next to it do not."""
    places = [(2.5 + k * step[0], k * step[1]) for k in range(6)]
    count = passes(places)
    assert 2 <= count <= 4
    assert passes(places[:2]) == 0


def test_what_stands_is_never_shown_from_wherever_it_is_seen():
    """A robot that drives past at 2 m/s, and turns, sees hits at the edge, and none is passed."""
    eyes = [LaserPose(0.2 * k, -1.0, 0.1 * k) for k in range(10)]
    for velocity in ((0.0, 0.0), (0.3, 0.2), (-0.5, 0.5)):
        assert passes([(1.0, 0.0)] * 10, eyes, velocity=velocity) == 0


def test_a_beam_has_to_reach_behind_a_hit():
    """A disc that comes nearer by less than depth and margin is not shown."""
    assert passes([(2.5, 0.0), (2.38, 0.0)]) == 0
    assert passes([(2.5, 0.0), (2.3, 0.0)]) == 1


def test_what_no_beam_of_a_scan_can_see_shows_nothing():
    """Behind the robot, where it has no beams, and farther away than hits count."""
    behind = [LaserPose(yaw=math.pi)] * 5 + [HERE]
    assert passes([(2.0, 0.1 * k) for k in range(6)], behind) == 0
    near = LAW._replace(max_range=1.5)
    assert passes([(2.0, 0.1 * k) for k in range(6)], law=near) == 0


def test_only_so_many_scans_are_remembered():
    """The oldest are forgotten, and all of them by a reset."""
    places = [(2.0, 0.1 * k) for k in range(12)]
    assert passes(places, scans=11) > passes(places, scans=5) > 0
    memory = ScanMemory(BEARINGS, 5, PERIOD, LAW)
    for place in places:
        memory.take(HERE, *scan(place))
    memory.reset()
    memory.take(HERE, *scan(places[-1]))
    here = np.array([places[-1]])
    assert memory.count_passes(here, np.array([[0.0, 1.0]])).tolist() == [0]


def test_a_track_that_the_last_scan_did_not_see_is_not_shown():
    """Places between its scans are expectations, and hits of something else."""
    memory = ScanMemory(BEARINGS, 5, PERIOD, LAW)
    for k in range(4):
        memory.take(HERE, *scan((2.0, 0.1 * k)))
    hidden = np.array([[2.0, 0.4]])
    assert memory.count_passes(hidden, np.array([[0.0, 1.0]])).tolist() == [0]
    empty = np.zeros((0, 2))
    assert memory.count_passes(empty, empty).shape == (0,)
