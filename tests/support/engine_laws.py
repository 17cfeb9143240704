"""Laws of every engine."""

from dataclasses import replace

import pytest

from andabata import engine as engines
from andabata.engine import WorkerLostError
from andabata.engine_origin import OriginError, here
from tests.support.engine_work import fail, kill_the_worker, later_first, square


def each_task_has_its_result_once(engine):
    """Every number comes once with its own task; ``map`` has the order of the tasks."""
    found = list(engine.run(square, (10 * k for k in range(12))))
    assert sorted(one.number for one in found) == list(range(12))
    assert all(one.task == 10 * one.number for one in found)
    assert all(one.result[0] == one.task**2 for one in found)
    assert list(engine.map(later_first, range(4))) == [0, 1, 2, 3]
    assert list(engine.run(square, [])) == []


def tasks_are_taken_as_they_are_needed(engine, in_flight):
    """Of endless tasks no more are taken than are in flight beside those that are given back."""
    taken = []

    def tasks():
        number = 0
        while True:
            taken.append(number)
            yield number
            number += 1

    found = engine.run(square, tasks())
    for given in range(1, 9):
        next(found)
        assert len(taken) <= given + in_flight
    found.close()


def an_error_of_the_work_is_raised(engine):
    """An error comes as it was raised in the worker, and the engine works on."""
    with pytest.raises(ArithmeticError, match="task 5"):
        list(engine.map(fail, [5]))
    assert [number for number, _ in engine.map(square, [3])] == [9]


def a_killed_worker_loses_nothing(engine, work, told):
    """The task runs again, each result comes once, and it is told."""
    assert sorted(one.result for one in engine.run(work, range(8))) == [k * k for k in range(8)]
    assert any("killed; it runs again (1 of" in line for line in told)


def a_task_that_kills_its_workers_ends_the_run(engine, told, monkeypatch):
    """Such a task is named after so many workers, with the next step."""
    monkeypatch.setattr(engines, "ATTEMPTS", 2)
    told.clear()
    with pytest.raises(WorkerLostError, match=r"task 1: expected .* got 2 that ended"):
        list(engine.run(kill_the_worker, [0]))
    assert [line.endswith("it runs again (1 of 1)") for line in told] == [True]
    assert [number for number, _ in engine.map(square, [3])] == [9]


def a_worker_of_another_origin_is_refused(engine):
    """Another commit, model, version or source is named with the next step."""
    mine = here()
    others = {
        "commit": "0123456789ab",
        "models": mine.models | {"forest.npz": "0" * 64},
        "versions": mine.versions | {"numpy": "1.0"},
        "sources": "0" * 64,
    }
    for name, other in others.items():
        engine.origin = replace(mine, **{name: other})
        with pytest.raises(OriginError, match=rf"expected {name}.*, as the driver's, got .*; inst"):
            list(engine.run(square, [1]))
    engine.origin = mine
