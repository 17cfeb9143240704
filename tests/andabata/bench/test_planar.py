"""Speed in rooms: the plain caster is right, and each row is of the work that it names."""

import numpy as np
import pytest

from andabata.bench import planar as bench
from andabata.bench.planar import crowded_room, slab_ranges, standing_batch
from andabata.machine.planar_lidar import TRAINING_LIDAR


def test_the_plain_caster_knows_boxes_and_circles():
    """Beams along the axes end at a face, at a circle's near side, or at the largest range."""
    boxes, circles = np.array([[1.0, -1.0, 2.0, 1.0]]), np.array([[0.0, 3.0, 0.5]])
    angles = np.array([0.0, np.pi / 4, np.pi / 2, np.pi])
    found = slab_ranges(boxes, circles, np.zeros(2), angles, 4.0)
    np.testing.assert_allclose(found, [1.0, np.sqrt(2), 2.5, 4.0])
    assert slab_ranges(boxes, circles, np.array([1.5, 0.0]), angles, 4.0)[0] == 0.0


def test_both_casters_see_the_same():
    """What is compared in speed gives the same ranges in the room that it is timed in."""
    room = crowded_room()
    batch = standing_batch(room, TRAINING_LIDAR, 5)
    batch.observe(np.ones(5, bool))
    for pose, row in zip(batch.poses, batch.reciprocals, strict=True):
        angles = TRAINING_LIDAR.bearings + pose[2]
        plain = slab_ranges(room.boxes, room.circles, pose[:2], angles, TRAINING_LIDAR.max_range)
        assert np.quantile(abs(1.0 / row - plain), 0.999) < 1e-5


def test_the_room_that_is_timed_has_25_boxes():
    """The walls are among them; the same seed gives the same room."""
    room = crowded_room()
    assert len(room.boxes) == 25
    np.testing.assert_array_equal(room.boxes, crowded_room().boxes)


def test_the_least_time_counts(monkeypatch):
    """Of several runs the shortest is the time."""
    now, runs = [0.0], iter([9.0, 3.0, 4.0])

    def work():
        now[0] += next(runs)

    monkeypatch.setattr(bench.time, "perf_counter", lambda: now[0])
    assert bench.least_time(work, 3) == 3.0


def test_rows_are_times_and_rates_of_one_robot(monkeypatch, capsys):
    """A time is that of a call by its robots, a rate its inverse, the ratio to one plain scan."""

    def least_time(work, runs=20):
        work()
        return 0.64

    monkeypatch.setattr(bench, "least_time", least_time)
    bench.main([])
    lines = capsys.readouterr().out.splitlines()
    assert lines[2] == "| cast of 1080 beams, 25 boxes | 1e+04 | us | 64 |"
    for beams, line in zip(bench.BEAMS, lines[3:], strict=True):
        assert line == f"| step, {beams} beams | 100 | robot-steps/s | 64 |"


@pytest.mark.parametrize("beams", [36, 180])
def test_steps_drive_cast_and_write(beams):
    """A step's rate is positive and finite for few beams too, where points are fewer."""
    row = bench.step_row(crowded_room(), beams)
    assert 0.0 < row["value"] < 1e9
