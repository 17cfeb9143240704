"""Stamps of recordings whose clocks are wrong."""

import numpy as np

from andabata.records.clocks import TopicStamps
from andabata.records.messages import NS

BEGIN = 1_700_000_000 * NS
HOUR = 3600 * NS


def topic_stamps(recorder=lambda t: t, header=lambda t: t, seconds=20.0):
    """Return the stamps of three topics whose clocks are functions of the true time [ns]."""
    found = []
    for name, rate, lag, delay in (
        ("/imu", 100, 0.3, 0),
        ("/wheels", 50, 0.3, 0),
        ("/laser", 10, 1.0, 10**8),
    ):
        times = BEGIN + (np.arange(1, round(seconds * rate) + 1) * (NS // rate)).astype(np.int64)
        stamps = np.array([recorder(int(t)) for t in times], dtype=np.int64)
        heads = np.array([header(int(t) - delay) for t in times], dtype=np.int64)
        order = np.argsort(stamps, kind="stable")
        found.append(TopicStamps(name, stamps[order], heads[order], lag, delay / NS))
    return found
