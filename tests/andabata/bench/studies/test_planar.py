"""Speed of robots in rooms: the plain caster is right, and every work has its row."""

import numpy as np
import pytest

from andabata.bench.studies import planar
from andabata.bench.studies.planar import crowded_room, slab_ranges, standing_batch
from andabata.machine.planar.lidar import TRAINING_LIDAR


def test_the_plain_caster_knows_boxes_and_circles():
    """Ahead, behind and to the side of a box and a circle stand their distances."""
    boxes, circles = np.array([[1.0, -0.5, 2.0, 0.5]]), np.array([[0.0, 3.0, 0.5]])
    angles = np.array([0.0, np.pi, np.pi / 2, np.arctan2(0.49, 1.0), np.arctan2(0.51, 1.0)])
    ranges = slab_ranges(boxes, circles, np.zeros(2), angles, 6.0)
    np.testing.assert_allclose(ranges, [1.0, 6.0, 2.5, np.hypot(1.0, 0.49), 6.0])
    assert slab_ranges(boxes, circles[:0], np.array([1.5, 0.0]), angles, 6.0).tolist() == [0.0] * 5


def test_both_casters_see_the_same():
    """What is timed against each other gives the same ranges, but for a beam at an edge or two."""
    room = crowded_room()
    assert len(room.boxes) == 25
    batch = standing_batch(room, TRAINING_LIDAR, 8)
    batch.observe(np.ones(8, dtype=bool))
    for (x, y, yaw), row in zip(batch.poses, batch.reciprocals, strict=True):
        angles = TRAINING_LIDAR.bearings + yaw
        plain = slab_ranges(room.boxes, room.circles, np.array([x, y]), angles, 5.0)
        assert (abs(1 / row - plain) > 1e-5).sum() <= 2


def test_every_work_has_a_row(monkeypatch, capsys):
    """Rays come first, then a step with each number of beams, each beside the plain caster."""
    monkeypatch.setattr(planar, "_ROBOTS", 2)
    monkeypatch.setattr(planar, "least_time", lambda work, runs=1: (work(), 2e-3)[1])
    planar.main([])
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "| work | value | unit | plain / ours |"
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]
    assert [row[0] for row in cells] == [
        "cast of 1080 beams, 25 boxes",
        "step, 36 beams",
        "step, 180 beams",
        "step, 1080 beams",
        "step, 180 beams, 4 movers",
    ]
    assert [float(row[1]) for row in cells] == pytest.approx([1000.0] * 5)
    assert {row[3] for row in cells} == {"2"}
