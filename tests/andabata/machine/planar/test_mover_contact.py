"""Contacts with moving obstacles: who hit whom, and their names."""

import numpy as np
import pytest

from andabata.machine.planar.mover_contact import AT_REST, Contact, contact_with_mover
from worlds.rooms.mover_motion import Movers


def movers(*rows):
    """Return one robot's movers of x, y, velocity in x and y, radius."""
    rows = np.array(rows, dtype=np.float64).reshape(1, -1, 5)
    return Movers(rows[..., :2].copy(), rows[..., 2:4].copy(), rows[..., 4].copy())


@pytest.mark.parametrize(
    ("speed", "yaw", "velocity", "expected"),
    [
        (0.5, 0.0, (0.0, 0.0), Contact.MOVER),
        (0.5, 0.0, (0.4, 0.0), Contact.MOVER),
        (0.5, 0.0, (-0.4, 0.0), Contact.MOVER),
        (0.5, 0.0, (-0.5, 0.0), Contact.MOVER),
        (0.5, 0.0, (-0.6, 0.0), Contact.HIT),
        (0.5, np.pi, (-0.6, 0.0), Contact.HIT),
        (0.5, np.pi / 2, (-0.1, 0.0), Contact.HIT),
        (0.5, np.pi / 2, (0.0, 0.3), Contact.MOVER),
        (0.3, np.pi / 3, (-0.14, 0.0), Contact.MOVER),
        (0.3, np.pi / 3, (-0.16, 0.0), Contact.HIT),
        (0.0, 0.0, (-0.6, 0.0), Contact.HIT_AT_REST),
        (AT_REST, 0.0, (-0.6, 0.0), Contact.HIT_AT_REST),
        (AT_REST + 1e-9, 0.0, (-0.6, 0.0), Contact.HIT),
    ],
)
def test_who_hit_whom_is_who_closed_in_faster(speed, yaw, velocity, expected):
    """Along the line between the centres the larger share counts; who stands was hit."""
    made = movers((0.45, 0.0, *velocity, 0.3))
    assert contact_with_mover(0.0, 0.0, yaw, speed, 0.2, 0, made) == expected


def test_the_mover_that_is_overlapped_most_counts():
    """One that does not touch the robot, or is not there, is nobody's fault."""
    into, hitting = (0.4, 0.0, 0.0, 0.0, 0.3), (-0.45, 0.0, 0.9, 0.0, 0.3)
    assert contact_with_mover(0, 0, 0.0, 0.5, 0.2, 0, movers(into, hitting)) == Contact.MOVER
    assert contact_with_mover(0, 0, 0.0, 0.5, 0.2, 0, movers(hitting, into)) == Contact.MOVER
    gone = (0.1, 0.0, 0.0, 0.0, 0.0)
    assert contact_with_mover(0, 0, 0.0, 0.5, 0.2, 0, movers(gone, hitting)) == Contact.HIT
    away = (0.51, 0.0, -1.0, 0.0, 0.3)
    assert contact_with_mover(0, 0, 0.0, 0.5, 0.2, 0, movers(gone, away)) == Contact.NONE


def test_contacts_have_labels():
    """None is empty; the others are words for tables."""
    assert [one.label for one in Contact] == ["", "obstacle", "mover", "hit", "hit_at_rest"]
