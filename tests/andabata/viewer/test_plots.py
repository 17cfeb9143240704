"""History behind the plots: samples in order, gaps, and a new begin."""

import numpy as np

from andabata.viewer.plots import History


def test_columns_are_the_samples_of_the_names_asked_for():
    """With stamps first; what is missing or None is a gap."""
    history = History(["speed", "error"])
    history.add(0.0, {"speed": 1.0, "error": None})
    history.add(0.1, {"error": 3.0})
    stamps, error, speed = history.columns(["error", "speed"])
    assert stamps.tolist() == [0.0, 0.1]
    assert np.isnan(error[0])
    assert error[1] == 3.0
    assert speed[0] == 1.0
    assert np.isnan(speed[1])


def test_only_the_last_hundreds_are_kept_and_an_earlier_stamp_begins_anew():
    """A drive that is played again has one line, not two over each other."""
    history = History(["a"])
    for k in range(1000):
        history.add(0.1 * k, {"a": k})
    stamps, values = history.columns(["a"])
    assert len(stamps) == 400
    assert values[-1] == 999
    history.add(5.0, {"a": 7.0})
    assert history.columns(["a"])[1].tolist() == [7.0]
    history.clear()
    assert len(history.columns(["a"])[0]) == 0
