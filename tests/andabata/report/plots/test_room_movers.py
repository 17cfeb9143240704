"""Movers in figures of rooms: tracks where they were there, discs where they were last."""

import numpy as np
from matplotlib.figure import Figure

from andabata.report.plots.room_movers import MOVER_COLOUR, draw_tracks, track_legend


def test_a_track_is_drawn_while_its_mover_is_there():
    """One that vanishes ends where it was; one that never comes is not drawn."""
    movers = np.zeros((4, 3, 3))
    movers[:, 0] = [[k, 1.0, 0.3] for k in range(4)]
    movers[:2, 1] = [[5.0, 5.0, 0.2], [5.0, 6.0, 0.2]]
    axes = Figure().add_subplot()
    draw_tracks(axes, movers)
    assert [(disc.center, disc.radius) for disc in axes.patches] == [
        ((3.0, 1.0), 0.3),
        ((5.0, 6.0), 0.2),
    ]
    first, second = axes.lines
    np.testing.assert_array_equal(first.get_xydata(), movers[:, 0, :2])
    np.testing.assert_array_equal(second.get_xydata()[:2], movers[:2, 1, :2])
    assert np.isnan(second.get_xydata()[2:]).all()


def test_the_legend_has_the_tracks_colour():
    """What is named is what is drawn."""
    assert track_legend().get_color() == MOVER_COLOUR
