"""Terminations: what ends a drive, in which order, and what does not."""

import numpy as np
import pytest

from andabata.tasks.terminations import (
    Drives,
    Ending,
    Outcome,
    TerminationConfig,
    Terminations,
)


def drives(
    stamps, positions=None, distances=None, collided=None, tipped=None, times=None, nearest=None
):
    stamps = np.atleast_1d(np.asarray(stamps, dtype=np.float64))
    n = len(stamps)
    return Drives(
        positions=np.zeros((n, 2)) if positions is None else np.asarray(positions, np.float64),
        goal_distances=np.full(n, 9.0) if distances is None else np.asarray(distances),
        collided=np.zeros(n, bool) if collided is None else np.asarray(collided),
        tipped=np.zeros(n, bool) if tipped is None else np.asarray(tipped),
        stamps=stamps,
        times=stamps if times is None else np.asarray(times, np.float64),
        nearest=None if nearest is None else np.asarray(nearest, np.float64),
    )


def test_the_papers_rules():
    """The goal's radius is 1 m, 20 s within 0.3 m is stuck."""
    config = TerminationConfig()
    assert (config.goal_radius, config.stuck_time, config.stuck_radius) == (1.0, 20.0, 0.3)


def test_the_goal_is_reached_below_its_radius():
    """A drive ends nearer than 1 m and goes on at 1 m and beyond."""
    terminations = Terminations(TerminationConfig(), 4)
    found = terminations.endings(drives([1.0] * 4, distances=[0.999, 1.0, 1.2, 1.49]))
    assert found.tolist() == [Ending.GOAL, Ending.NONE, Ending.NONE, Ending.NONE]


def test_the_first_that_holds_counts():
    """Rolled over, collision, goal, stuck, time-out: in this order."""
    terminations = Terminations(TerminationConfig(time_limit=30.0), 5)
    found = terminations.endings(
        drives(
            [100.0] * 5,
            distances=[0.5, 0.5, 0.5, 9.0, 9.0],
            collided=[True, True, False, False, False],
            tipped=[True, False, False, False, False],
            positions=[(0, 0)] * 4 + [(1, 0)],
        )
    )
    assert found.tolist() == [
        Ending.TIPOVER,
        Ending.COLLISION,
        Ending.GOAL,
        Ending.STUCK,
        Ending.TIMEOUT,
    ]
    assert found.dtype == np.int64


def test_a_robot_is_stuck_after_its_time():
    """Without leaving the radius a drive goes on at 20 s and ends after it."""
    terminations = Terminations(TerminationConfig())
    terminations.begin(0, np.zeros(2), 5.0)
    for stamp, ending in ((24.9, Ending.NONE), (25.0, Ending.NONE), (25.1, Ending.STUCK)):
        inside = [(0.29 * np.cos(stamp), 0.29 * np.sin(stamp))]
        assert terminations.endings(drives(stamp, inside, times=[1.0]))[0] == ending


def test_leaving_the_radius_starts_the_time_again():
    """The place and time of the last departure count, not those of the start."""
    terminations = Terminations(TerminationConfig())
    terminations.begin(0, np.zeros(2))
    assert terminations.endings(drives(15.0, [(0.0, 0.31)]))[0] == Ending.NONE
    np.testing.assert_array_equal(terminations.anchors, [[0.0, 0.31]])
    np.testing.assert_array_equal(terminations.anchor_stamps, [15.0])
    assert terminations.endings(drives(35.0, [(0.0, 0.6)]))[0] == Ending.NONE
    assert terminations.endings(drives(35.1, [(0.0, 0.05)]))[0] == Ending.STUCK


def test_the_time_limit_counts_from_the_begin_of_the_drive():
    """A drive ends at its limit of drive time, whatever the robot's clock shows."""
    config = TerminationConfig(time_limit=7.0)
    for time, ending in ((6.9, Ending.NONE), (7.0, Ending.TIMEOUT)):
        terminations = Terminations(config)
        terminations.begin(0, np.zeros(2), 100.0)
        assert terminations.endings(drives(101.0, times=[time]))[0] == ending


def test_robots_end_one_by_one():
    """Each of many robots has its own place and clock; beginning one leaves the others."""
    terminations = Terminations(TerminationConfig(), 3)
    terminations.begin(1, np.array([5.0, 6.0]), 50.0)
    np.testing.assert_array_equal(terminations.anchors, [[0, 0], [5, 6], [0, 0]])
    found = terminations.endings(
        drives([21.0, 70.0, 21.0], [(0, 0), (5, 6), (1, 0)], times=[1.0] * 3)
    )
    assert found.tolist() == [Ending.STUCK, Ending.NONE, Ending.NONE]


def test_a_drive_that_ended_keeps_its_anchor():
    """A body that collided far away does not count as one that moved on."""
    terminations = Terminations(TerminationConfig(), 3)
    terminations.endings(
        drives(
            [9.0] * 3,
            [(3, 0)] * 3,
            distances=[9.0, 9.0, 0.1],
            collided=[True, False, False],
            tipped=[False, True, False],
        )
    )
    np.testing.assert_array_equal(terminations.anchors, np.zeros((3, 2)))


@pytest.mark.parametrize("terminates", [False, True])
def test_time_alone_cuts_drives_short_unless_it_terminates_them(terminates):
    """Of all endings a time-out truncates; with ``timeout_terminates`` none does."""
    config = TerminationConfig(timeout_terminates=terminates)
    endings = np.array(list(Ending))
    expected = [ending is Ending.TIMEOUT and not terminates for ending in Ending]
    assert config.truncated(endings).tolist() == expected
    assert not TerminationConfig().timeout_terminates


@pytest.mark.parametrize("ending", list(Ending))
def test_every_ending_has_the_outcome_of_its_name(ending):
    """Numbers and names of endings agree; ``NONE`` has no outcome."""
    if ending is Ending.NONE:
        assert ending.outcome is None
    else:
        assert ending.outcome is Outcome(ending.name.lower().replace("_", " "))


def test_a_near_range_is_a_collision_where_the_rule_is_on():
    """Under 0.72 m it ends the drive, at 0.72 m it does not; without the rule contact alone."""
    near = [0.0, 0.7199, 0.72, np.inf]
    found = [
        Terminations(TerminationConfig(collision_range=limit), 4, sees_scan=True)
        for limit in (0.72, None)
    ]
    ended = [each.endings(drives([1.0] * 4, nearest=near)).tolist() for each in found]
    assert ended[0] == [Ending.COLLISION, Ending.COLLISION, Ending.NONE, Ending.NONE]
    assert ended[1] == [Ending.NONE] * 4


def test_a_near_range_comes_before_the_goal_and_after_a_tip_over():
    """It has the place of a contact, and a drive that it ended keeps its anchor."""
    terminations = Terminations(TerminationConfig(collision_range=0.72), 2, sees_scan=True)
    last = drives(
        [9.0] * 2, [(3, 0)] * 2, distances=[0.1] * 2, tipped=[False, True], nearest=[0.6] * 2
    )
    assert terminations.endings(last).tolist() == [Ending.COLLISION, Ending.TIPOVER]
    assert terminations.too_near(last).all()
    np.testing.assert_array_equal(terminations.anchors, np.zeros((2, 2)))


def test_the_rule_is_refused_by_name_where_no_scan_is_seen():
    """Whoever ends drives without a scan would ignore it in silence."""
    with pytest.raises(
        ValueError, match=r"terminations\.collision_range: expected None .* got 0\.7"
    ):
        Terminations(TerminationConfig(collision_range=0.7))
    assert TerminationConfig().collision_range is None
