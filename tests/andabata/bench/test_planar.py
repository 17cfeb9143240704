"""Speed in rooms: each row is of the work that it names."""

import numpy as np

from andabata.bench import planar as bench
from andabata.bench.planar import cluttered_room, starts_in


def test_the_room_that_is_timed_has_25_boxes():
    """The walls are among them, and robots fit between them."""
    room = cluttered_room()
    assert len(room.boxes) == 25
    places = np.array([(start.x, start.y) for start in starts_in(room, 30)])
    assert room.clearance(places).min() > 0.2


def test_times_are_divided_by_what_was_done(monkeypatch):
    """A scan's time is that of a call by its places; a rate is that of all robots and steps."""

    def fastest(call, loops):
        call()
        return 128.0

    monkeypatch.setattr(bench, "fastest", fastest)
    assert bench.time_scans(36, places=4) == 32.0
    assert bench.time_simulator(2, 36) == 2e6 / 128.0
    assert bench.time_environment(2, 36) == 2e7 / 128.0


def test_the_fastest_loop_counts(monkeypatch):
    """The first loop compiles and does not count; the shortest of the others does, in us."""
    now, loops = [0.0], iter([1.0, 9.0, 3.0, 4.0])

    def call():
        now[0] += next(loops)

    monkeypatch.setattr(bench.time, "perf_counter", lambda: now[0])
    assert bench.fastest(call, 3) == 3e6


def test_the_table_has_a_row_for_each_size(monkeypatch, capsys):
    """Parts, numbers of robots and beams are named, and each number is in its own row."""
    monkeypatch.setattr(bench, "BEAMS", (36, 72))
    monkeypatch.setattr(bench, "time_scans", lambda beams: beams / 10)
    monkeypatch.setattr(bench, "time_simulator", lambda robots, beams: 1000.0 * robots + beams)
    monkeypatch.setattr(bench, "time_environment", lambda robots, beams: 10.0 * robots + beams)
    monkeypatch.setattr(bench, "time_oracle", lambda: np.array([20.0, 40.0]))
    bench.main([])
    printed = capsys.readouterr().out
    assert "| scan | 25 boxes | 72 | 7.2 | us |" in printed
    assert "| simulator | 64 robots | 36 | 6.404e+04 | robot steps/s |" in printed
    assert "| environment | 16 robots | 72 | 232 | robot steps/s |" in printed
    assert "| oracle | mean | - | 30 | ms |" in printed
    assert "| oracle | slowest | - | 40 | ms |" in printed
    assert len(printed.splitlines()) == 2 + 2 + 4 + 4 + 2


def test_the_oracle_is_timed_in_each_room(monkeypatch):
    """As many times come back as tasks were driven, all of them positive."""
    monkeypatch.setattr(bench, "JUDGING_ROOMS", ("spn-env4", "spn-env5"))
    times = bench.time_oracle(tasks=2)
    assert times.shape == (4,)
    assert (times > 0.0).all()
