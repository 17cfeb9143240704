"""Rigid transforms and their history."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.records.frames.transform import (
    Transform,
    TransformHistory,
    differ,
    mounting_numbers,
    pose_difference,
    yaw_pitch_roll,
)
from tests.support.edited_bags import turn


def test_transforms_multiply_as_matrices_do():
    """The product applies the right factor first."""
    rng = np.random.default_rng(0)
    parts = [Transform(Rotation.random(random_state=k), rng.normal(size=3)) for k in range(2)]
    points = rng.normal(size=(5, 3))
    both = (parts[0] @ parts[1]).apply(points)
    np.testing.assert_allclose(both, parts[0].apply(parts[1].apply(points)), atol=1e-12)


def test_a_transform_rotates_then_translates():
    """A known point: a quarter turn to the left, then the offset of the frame."""
    found = Transform(Rotation.from_euler("Z", 90, degrees=True), np.array([1.0, 2.0, 3.0]))
    np.testing.assert_allclose(found.apply(np.array([[1.0, 0, 0]])), [[1, 3, 3]], atol=1e-12)
    np.testing.assert_array_equal(Transform.identity().apply(np.ones((1, 3))), np.ones((1, 3)))


def test_positions_are_interpolated_linearly_and_kept_beyond_the_ends():
    """All three axes at a quarter of the time, and the nearest row outside."""
    history = TransformHistory("a", False)
    for stamp, xyz in ((2.0, [1.0, -2.0, 3.0]), (4.0, [5.0, 2.0, 1.0]), (5.0, [7.0, 2.0, 1.0])):
        history.add(stamp, [*xyz, 0, 0, 0, 1])
    found = history.at(np.array([1.9, 2.0, 2.5, 4.0, 4.5, 5.1])).translation
    expected = [[1, -2, 3], [1, -2, 3], [2, -1, 2.5], [5, 2, 1], [6, 2, 1], [7, 2, 1]]
    np.testing.assert_allclose(found, expected, atol=1e-12)
    np.testing.assert_array_equal(history.latest().translation, [7, 2, 1])


def test_the_inverse_undoes_a_transform():
    """Inverse after transform is the identity, for one instant and for several."""
    rng = np.random.default_rng(1)
    points = rng.normal(size=(4, 3))
    for shape in ((3,), (4, 3)):
        rotation = Rotation.random(*shape[:-1], random_state=2)
        found = Transform(rotation, rng.normal(size=shape))
        np.testing.assert_allclose(found.inverse.apply(found.apply(points)), points, atol=1e-12)
    translation = Transform(Rotation.from_euler("Z", 90, degrees=True), np.array([1.0, 0, 0]))
    np.testing.assert_allclose(translation.inverse.translation, [0, 1, 0], atol=1e-12)


def row(x, yaw_deg):
    """Return a position on the x axis and the quaternion x, y, z, w of a yaw."""
    return [x, 0.0, 0.0, *Rotation.from_euler("Z", yaw_deg, degrees=True).as_quat()]


def test_the_last_element_of_a_quaternion_is_its_real_part():
    """Rows are in the order x, y, z, w."""
    history = TransformHistory("base_link", True)
    history.add(0.0, [0, 0, 0, 0, 0, np.sqrt(0.5), np.sqrt(0.5)])
    np.testing.assert_allclose(history.latest().rotation.apply([1, 0, 0]), [0, 1, 0], atol=1e-12)


def test_quaternions_of_either_sign_are_one_rotation():
    """Interpolation and comparison ignore the sign of a quaternion."""
    one, other = row(0.0, 10), row(0.0, 30)
    negative = [*other[:3], *(-part for part in other[3:])]
    assert not differ(other, negative)
    assert differ(one, other)
    assert differ(row(5.0, 10), row(5.0 + 2e-6, 10))
    assert not differ(row(5.0, 10), row(5.0, 10))
    history = TransformHistory("base_link", False)
    history.add(0.0, one)
    history.add(1.0, negative)
    yaw = history.at(np.array([0.25])).rotation.as_euler("ZYX", degrees=True)[0, 0]
    assert yaw == pytest.approx(15)


def test_a_static_history_keeps_the_last_and_a_moving_one_all():
    """Only a moving history grows, and equal rows do not move it."""
    static, moving = TransformHistory("a", True), TransformHistory("a", False)
    for k, x in enumerate((0.0, 0.0, 1.0)):
        static.add(float(k), row(x, 0))
        moving.add(float(k), row(x, 0))
        assert moving.moves == (k == 2)
    assert static.table.tolist() == [[2.0, *row(1.0, 0)]]
    assert len(moving.table) == 3


def test_pruning_keeps_the_rows_of_the_latest_seconds():
    """A row of just that age stays; nothing is dropped before twice the age."""
    history = TransformHistory("a", False)
    for k in range(5):
        history.add(float(k), row(k, 0))
    history.prune(2.0)
    assert history.table[:, 0].tolist() == [0, 1, 2, 3, 4]
    history.add(5.0, row(5, 0))
    history.prune(2.0)
    assert history.table[:, 0].tolist() == [3, 4, 5]


@pytest.mark.parametrize("degrees", [(10, 20, 30), (-170, -60, 170), (0, 0, -90)])
def test_angles_are_yaw_pitch_and_roll(degrees):
    """The order is that of rotations about z, the new y and the new x."""
    found = np.rad2deg(yaw_pitch_roll(turn(degrees)))
    np.testing.assert_allclose(found, degrees[::-1], atol=1e-9)


@pytest.mark.filterwarnings("error")
def test_an_upright_pitch_has_no_roll():
    """Angles that are not unique raise no warning."""
    _, pitch, roll = yaw_pitch_roll(turn((30, 90, 40)))
    assert pitch == pytest.approx(np.pi / 2)
    assert roll == 0.0


def test_a_mounting_is_written_as_the_option_takes_it():
    """Metres, then roll, pitch and yaw in degrees."""
    numbers = mounting_numbers(Transform(turn((10, 20, 30)), np.array([1.0, 2.0, 3.0])))
    np.testing.assert_allclose(numbers, [1, 2, 3, 10, 20, 30])


def test_poses_differ_by_a_distance_and_an_angle():
    """The angle is that between the rotations, whichever sign the quaternions have."""
    one = [0, 0, 0, *turn((0, 0, 10)).as_quat()]
    other = [0, 3, 4, *-turn((0, 0, 50)).as_quat()]
    assert pose_difference(one, other) == pytest.approx((5.0, np.deg2rad(40)))
