"""Time from a cloud to its virtual scan."""

from types import SimpleNamespace

import numpy as np

from andabata.bench.studies import scan
from andabata.bench.studies.scan import best_of_five, time_scans


def test_the_time_is_that_of_the_fastest_of_five_calls(monkeypatch):
    """In microseconds."""
    now, durations = [0.0], iter([5.0, 3.0, 2.0, 4.0, 6.0])

    def call():
        now[0] += next(durations)

    monkeypatch.setattr(scan.time, "perf_counter", lambda: now[0])
    assert best_of_five(call) == 2e6


def test_each_stage_has_quantiles_over_the_clouds(monkeypatch):
    """Every cloud is brought to the same number of points."""
    sizes = []
    rng = np.random.default_rng(0)
    clouds = [rng.uniform(-5, 5, (n, 3)).astype(np.float32) for n in (50, 400)]

    class Cloud(SimpleNamespace):
        def __len__(self):
            return len(self.points)

    monkeypatch.setattr(scan, "read_manifest", lambda folder: None)
    monkeypatch.setattr(scan, "read_clouds", lambda *_: [Cloud(points=each) for each in clouds])
    plain = scan.fill_quarters
    monkeypatch.setattr(scan, "fill_quarters", lambda p, *a: sizes.append(len(p)) or plain(p, *a))
    rows = time_scans(None, 100)
    assert [row["stage"] for row in rows] == list(scan.STAGES)
    assert all(row["5 % [us]"] <= row["median [us]"] <= row["95 % [us]"] for row in rows)
    assert {row["clouds"] for row in rows} == {2}
    assert set(sizes) == {100}
