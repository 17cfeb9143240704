"""Friction of wheels in MuJoCo's contacts lies along the wheel and its axle."""

import numpy as np

from andabata.machine.mujoco_contact import align_friction

WHEEL_OF = np.array([-1, 0, 1, -1])
"""Wheel of each of four shapes: the ground, two wheels, a body."""


def aligned(normal, axle, geoms=(0, 1)):
    """Return the frame, the friction and the times of a contact of the first wheel."""
    frames, friction, times = np.zeros((1, 9)), np.full((1, 5), 0.9), np.zeros((1, 2))
    frames[0, :3] = normal
    axles = np.array([axle, [1.0, 0.0, 0.0]])
    pair = np.array([geoms], dtype=np.int32)
    align_friction(frames, friction, times, pair, axles, WHEEL_OF, 0.5, 0.1)
    return frames.reshape(3, 3), friction[0], times[0]


def test_the_axes_are_those_of_the_wheel():
    """First along the wheel, then along its axle, for each heading; frames are right-handed."""
    for yaw in (0.0, 0.7, -2.0):
        c, s = np.cos(yaw), np.sin(yaw)
        frame, friction, times = aligned([0.0, 0.0, 1.0], [-s, c, 0.0])
        np.testing.assert_allclose(frame, [[0, 0, 1], [c, s, 0], [-s, c, 0]], atol=1e-12)
        np.testing.assert_allclose(friction[:2], [0.9, 0.45])
        np.testing.assert_allclose(times, [0.1, 1.0])


def test_a_slanting_contact_has_an_orthonormal_frame():
    """The normal stays, and the wheel's direction lies in the plane of the contact."""
    normal = np.array([0.6, 0.0, 0.8])
    frame, _, _ = aligned(normal, [0.0, np.cos(0.3), np.sin(0.3)])
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(frame) > 0.0
    np.testing.assert_array_equal(frame[0], normal)
    assert abs(frame[1] @ [0.0, np.cos(0.3), np.sin(0.3)]) < 1e-12


def test_the_wheel_may_be_either_shape():
    """MuJoCo orders the shapes of a contact by their kind: the second wheel comes first here."""
    frame, friction, _ = aligned([0.0, 0.0, 1.0], [0.0, 1.0, 0.0], geoms=(2, 0))
    np.testing.assert_allclose(frame[1], [0.0, -1.0, 0.0], atol=1e-12)
    assert friction[1] == 0.45


def test_other_contacts_stay():
    """The body's contacts, and one along the axle, keep MuJoCo's friction."""
    for geoms, normal in (((0, 3), [0.0, 0.0, 1.0]), ((0, 1), [0.0, 1.0, 0.0])):
        frame, friction, times = aligned(normal, [0.0, 1.0, 0.0], geoms)
        assert not frame[1:].any()
        assert (friction == 0.9).all()
        assert not times.any()
