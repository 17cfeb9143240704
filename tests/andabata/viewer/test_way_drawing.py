"""Drawing of the way: paths of any length in few segments."""

import numpy as np

from andabata.viewer.way_drawing import path_lines


def test_a_long_path_is_drawn_in_few_segments_to_its_end():
    """They are joined, and end at the last position."""
    positions = [np.array([k, 0.0, 0.0]) for k in range(10_000)]
    lines = path_lines(positions)
    assert len(lines) <= 1500
    assert (lines[1:, 0] == lines[:-1, 1]).all()
    assert lines[-1, 1, 0] == 9999
    assert path_lines(positions[:1]).shape == (0, 2, 3)
