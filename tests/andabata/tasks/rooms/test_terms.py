"""Terms of observations in rooms: what there is, in which order, and goals."""

import numpy as np

from andabata.tasks.rooms.points import SECTORS, window_of
from andabata.tasks.rooms.terms import RoomTerms, encoded_goals, room_observations


def test_the_layout_is_points_mask_windows_goal_and_velocity():
    """Terms stand in this order; the polar goal has a number less."""
    spec = room_observations(RoomTerms(120), 5.0, 1.1)
    shapes = {term.name: term.shape for term in spec.terms}
    expected = {
        "points": (120, 2),
        "mask": (120,),
        "windows": (36,),
        "goal": (3,),
        "velocity": (2,),
    }
    assert list(shapes.items()) == list(expected.items())
    polar = room_observations(RoomTerms(7, goal_encoding="polar"), 5.0, 1.1)
    assert polar.term("goal").shape == (2,)
    assert spec.size == 3 * 120 + SECTORS + 5


def test_windows_lie_side_by_side_around_straight_ahead():
    """Each bearing is the middle of the window that it falls into, the rightmost first."""
    for size, fov in ((40, 2 * np.pi), (20, np.pi), (1, np.pi)):
        bearings = RoomTerms(windows=size, window_fov=fov).window_bearings
        assert [window_of(b, size, fov, 0.0) for b in bearings] == list(range(size))
        np.testing.assert_allclose(bearings, -bearings[::-1], atol=1e-12)
        np.testing.assert_allclose(np.diff(bearings), fov / size)
    assert RoomTerms(windows=4, window_fov=np.pi).window_bearings[0] == -0.375 * np.pi


def test_goals_are_distance_and_bearing_from_the_heading():
    """A goal to the left has a positive bearing; those behind are pi, not minus pi."""
    poses = np.array([[1.0, 1.0, 0.0], [1.0, 1.0, np.pi / 2], [0.0, 0.0, 3.0]])
    goals = np.array([[1.0, 3.0], [1.0, 0.0], [-1.0, -1.0]])
    polar = encoded_goals(poses, goals, "polar")
    bearing = np.arctan2(-1, -1) - 3.0 + 2 * np.pi
    np.testing.assert_allclose(
        polar, [[2.0, np.pi / 2], [1.0, np.pi], [np.sqrt(2), bearing]], rtol=1e-12
    )
    cosine = encoded_goals(poses, goals, "cosine")
    np.testing.assert_allclose(cosine[:, 0], polar[:, 0] / 5.0)
    np.testing.assert_allclose(
        np.arctan2(cosine[:, 2], cosine[:, 1]) % 6.283185307179586, polar[:, 1] % 6.283185307179586
    )
    np.testing.assert_allclose(np.hypot(cosine[:, 1], cosine[:, 2]), 1.0)


def test_the_terms_say_what_there_is():
    """Without points there is no mask; ranges, an earlier scan and windows have their own names."""
    plain = room_observations(RoomTerms(0, windows=40), 10.0, 1.0)
    shapes = [(term.name, term.shape) for term in plain.terms]
    assert shapes == [("windows", (40,)), ("goal", (3,)), ("velocity", (2,))]
    printed = RoomTerms(0, windows=40, as_ranges=True, earlier_scan=2, goal_encoding="polar")
    spec = room_observations(printed, 10.0, 1.0)
    names = ["ranges", "earlier_ranges", "goal", "velocity"]
    assert [term.name for term in spec.terms] == names
    assert (spec.term("ranges").high, spec.term("ranges").unit) == (10.0, "m")
    assert spec.term("earlier_ranges").shape == (40,)
    seeing = room_observations(RoomTerms(0, windows=40, tracked_movers=3), 10.0, 1.0)
    assert (seeing.terms[:-1], seeing.terms[-1].name) == (plain.terms, "movers")
    assert seeing.terms[-1].shape == (3, 6)
    # The paper's state, and its earlier scan: 40 ranges, distance, bearing, speed and yaw rate.
    assert spec.size == 40 + 44
