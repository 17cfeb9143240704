"""Planar lasers as data: beams, labels and their bounds."""

import numpy as np
import pytest

from andabata.machine.planar.lidar import PLANAR_LIDARS, TRAINING_LIDAR, PlanarLidarConfig


def test_the_training_laser_has_the_papers_beams():
    """1080 beams a third of a degree apart go once around, and none twice."""
    bearings = TRAINING_LIDAR.bearings
    assert len(bearings) == TRAINING_LIDAR.count == 1080
    np.testing.assert_allclose(np.diff(bearings), np.pi / 540)
    assert bearings[0] == pytest.approx(-np.pi)
    assert bearings[-1] == pytest.approx(np.pi - np.pi / 540)


@pytest.mark.parametrize(("name", "count"), [("hokuyo-270", 1081), ("ten-beams", 10)])
def test_a_field_of_view_ends_in_beams(name, count):
    """Both edges of a field of view have a beam, and it is symmetric about the heading."""
    laser = PLANAR_LIDARS[name]
    bearings = np.degrees(laser.bearings)
    assert len(bearings) == count
    np.testing.assert_allclose(bearings, -bearings[::-1], atol=1e-9)
    assert bearings[-1] == pytest.approx(laser.fov_deg / 2)


@pytest.mark.parametrize(
    ("name", "label", "beams", "edges"),
    [
        ("full-fine", "360|0.5|10|0", 720, (-180, 179.5)),
        ("hokuyo-270", "270|0.25|30|0", 1081, (-135, 135)),
        ("wide-270", "270|0.5|10|0", 541, (-135, 135)),
        ("front-220", "220|1|5|0", 221, (-110, 110)),
        ("front-180", "180|1|10|0", 181, (-90, 90)),
        ("ten-beams", "180|20|10|0", 10, (-90, 90)),
        ("ten-beams-forward", "180|20|10|0.05", 10, (-90, 90)),
    ],
)
def test_the_seven_lasers_are_what_their_labels_say(name, label, beams, edges):
    """Field of view, resolution, range and place are the label's, and so are the beams."""
    assert len(PLANAR_LIDARS) == 7
    laser, (fov, resolution, reach, ahead) = PLANAR_LIDARS[name], map(float, label.split("|"))
    assert (laser.label, laser.max_range, laser.x) == (label, reach, ahead)
    assert (laser.y, laser.yaw_deg, laser.count) == (0, 0, beams)
    bearings = np.degrees(laser.bearings)
    np.testing.assert_allclose((bearings[0], bearings[-1]), edges, atol=1e-9)
    np.testing.assert_allclose(np.diff(bearings), resolution)
    assert np.ptp(bearings) == pytest.approx(fov if fov < 360 else fov - resolution)


def test_a_resolution_that_does_not_divide_the_view_stays_inside_it():
    """Beams keep their distance, are centred, and do not leave the field of view."""
    laser = PlanarLidarConfig(fov_deg=100, resolution_deg=30)
    np.testing.assert_allclose(np.degrees(laser.bearings), [-45, -15, 15, 45])


def test_one_beam_is_a_laser():
    """A field of view narrower than the resolution has its middle beam alone."""
    np.testing.assert_allclose(PlanarLidarConfig(fov_deg=5, resolution_deg=20).bearings, [0.0])
    assert PlanarLidarConfig(fov_deg=360, resolution_deg=360).count == 1


def test_labels_are_read_as_they_are_written():
    """A label gives the same laser back, and a name the one of the table."""
    for name, laser in PLANAR_LIDARS.items():
        assert PlanarLidarConfig.parse(name) == laser
        assert PlanarLidarConfig.parse(laser.label) == laser
    moved = PlanarLidarConfig(fov_deg=180, resolution_deg=1, max_range=4, x=0.1, yaw_deg=90)
    assert moved.label == "180|1|4|0.1|0|90"
    assert PlanarLidarConfig.parse(moved.label) == moved


@pytest.mark.parametrize("label", ["", "180", "180|20", "a|b|c", "1|1|1|0|0|0|0", "ten"])
def test_other_labels_are_refused(label):
    """What is neither a label nor a name is named, with what was expected."""
    with pytest.raises(ValueError, match=r"expected FOV\|RESOLUTION\|RANGE"):
        PlanarLidarConfig.parse(label)


@pytest.mark.parametrize("label", ["361|1|5", "180|0|5", "180|1|0", "0|1|5", "nan|1|5"])
def test_impossible_lasers_are_refused(label):
    """No beams, more than a turn, no range: each is refused by its field."""
    with pytest.raises(ValueError, match=r"fov_deg|resolution_deg|max_range"):
        PlanarLidarConfig.parse(label)
