"""Mounting of a sensor: known transforms."""

import numpy as np

from andabata.machine.mounting import Mounting


def test_a_sensor_point_is_rotated_then_shifted():
    """A sensor that faces left places its forward axis on the base's left."""
    mounting = Mounting(x=0.1, y=0.2, z=0.5, yaw=np.pi / 2)
    points = np.array([[1.0, 0.0, 0.0]], dtype=np.float32)
    np.testing.assert_allclose(mounting.place(points), [[0.1, 1.2, 0.5]], atol=1e-6)


def test_the_default_is_a_level_sensor():
    """The default mounting only lifts the points."""
    points = np.array([[1.0, 2.0, 3.0]], dtype=np.float32)
    np.testing.assert_allclose(Mounting().place(points), [[1.0, 2.0, 3.72]], atol=1e-6)
