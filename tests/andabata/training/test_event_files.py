"""Event files: what stands in them, and that a resumed run writes no step twice."""

import sys

import pytest

from andabata.training.event_files import (
    FOLDER,
    EventFiles,
    EventFilesError,
    last_step,
    read_scalars,
    scalars,
)


def row(steps, **more):
    """Return a row of a history."""
    base = {"name": "Rooms", "steps": steps, "recent_success": 0.5, "difficulty": None}
    base |= {"success_rate": 0.25, "mean_return": -2.0, "mean_steps": 9.0, "circling": 0.125}
    base |= {"outcomes": {"goal": 1, "timeout": 3}, "terms": {"goal": 5.0}, "losses": {"q": 0.5}}
    return base | {"validation": {}, "tasks": None} | more


def written(folder):
    """Return the records of all event files of a run."""
    return [one for path in sorted((folder / FOLDER).iterdir()) for one in read_scalars(path)]


def test_each_iteration_is_a_point_of_each_curve_of_its_stage():
    """Shares of ends, terms of the reward, losses; what a row lacks has no point."""
    assert scalars(row(4)) == {
        "Rooms/recent_success": 0.5,
        "Rooms/success_rate": 0.25,
        "Rooms/mean_return": -2.0,
        "Rooms/mean_steps": 9.0,
        "Rooms/circling": 0.125,
        "Rooms/reward/goal": 5.0,
        "Rooms/losses/q": 0.5,
        "Rooms/ends/goal": 0.25,
        "Rooms/ends/timeout": 0.75,
    }
    more = scalars(
        row(4, difficulty=0.3, validation={"A": 1.0}, tasks={"score": 2, "successes": 3})
    )
    assert more["Rooms/difficulty"] == 0.3
    assert more["Rooms/validation/A"] == 1.0
    assert (more["Rooms/tasks/score"], more["Rooms/tasks/successes"]) == (2.0, 3.0)


def test_a_resumed_run_goes_on_without_doubling_steps(tmp_path):
    """Rows that are written are left out; those a kill left unwritten come with the next."""
    history = [row(10 * k) for k in range(1, 5)]
    files = EventFiles(tmp_path)
    files.write(history[:2])
    files.write(history[:2])
    files.close()
    again = EventFiles(tmp_path)
    again.write(history)
    again.close()
    found = written(tmp_path)
    assert [step for step, _ in found] == [10, 20, 30, 40]
    assert found[0][1] == pytest.approx(scalars(history[0]))


def test_a_record_that_was_cut_short_is_written_again(tmp_path):
    """A kill in the middle of a record leaves those before it."""
    files = EventFiles(tmp_path)
    files.write([row(10), row(20)])
    files.close()
    (path,) = (tmp_path / FOLDER).iterdir()
    path.write_bytes(path.read_bytes()[:-5])
    assert last_step(tmp_path / FOLDER) == 10
    again = EventFiles(tmp_path)
    again.write([row(10), row(20)])
    again.close()
    assert sorted(step for step, _ in written(tmp_path)) == [10, 20]


def test_without_the_library_the_extra_is_named(tmp_path, monkeypatch):
    """The error has the line that installs it."""
    monkeypatch.setitem(sys.modules, "tensorboardX", None)
    with pytest.raises(EventFilesError, match=r"pip install -e '\.\[tensorboard\]'"):
        EventFiles(tmp_path)
