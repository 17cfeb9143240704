"""Scans of the last control steps: how far back, from where, and never beyond an episode."""

import numpy as np

from andabata.tasks.rooms.scan_history import ScanHistory
from worlds.rooms.mover_motion import Movers


def scan(history, numbers, value):
    """Make a scan of some robots, all of whose numbers are a value."""
    count = len(history.earlier.poses)
    movers = Movers(
        *(np.full(shape, float(value)) for shape in ((count, 1, 2),) * 2 + ((count, 1),))
    )
    numbers = np.array(numbers)
    reciprocals = np.full((len(numbers), 4), value, dtype=np.float32)
    history.update(numbers, reciprocals, np.full((count, 3), float(value)), movers)


def seen(history):
    """Return the value of each robot's earlier scan, the same in all arrays."""
    parts = [values.reshape(len(values), -1) for values in history.earlier]
    values = np.concatenate(parts, axis=1)
    assert (values == values[:, :1]).all()
    return values[:, 0].tolist()


def test_the_scan_of_some_steps_ago_is_given():
    """After the fourth scan the one three before is seen; until then the first one is."""
    history = ScanHistory(1, 3, 4, 1)
    found = []
    for value in range(1, 10):
        scan(history, [0], value)
        found += seen(history)
    assert found == [1, 1, 1, 1, 2, 3, 4, 5, 6]


def test_robots_are_remembered_apart():
    """One that stands keeps its earlier scan while others go on."""
    history = ScanHistory(3, 1, 4, 1)
    scan(history, [0, 1, 2], 1)
    scan(history, [0, 2], 2)
    scan(history, [2], 3)
    assert seen(history) == [1, 1, 2]
    scan(history, [1], 4)
    scan(history, [1], 5)
    assert seen(history) == [1, 4, 2]


def test_an_episode_begins_with_its_own_first_scan():
    """What another episode saw is forgotten, for the robot that begins anew alone."""
    history = ScanHistory(2, 2, 4, 1)
    for value in (1, 2, 3, 4):
        scan(history, [0, 1], value)
    history.restart(1)
    scan(history, [0, 1], 7)
    assert seen(history) == [3, 7]
    scan(history, [0, 1], 8)
    assert seen(history) == [4, 7]
