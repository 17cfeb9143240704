"""The engine's laws for this process and for several, without the cluster."""

import pytest

from andabata.engine import SerialEngine
from andabata.engine_processes import ProcessEngine
from tests import engine_laws as laws


@pytest.mark.parametrize("make", [SerialEngine, lambda: ProcessEngine(1), lambda: ProcessEngine(2)])
def test_the_laws_of_an_engine(make):
    """Results once, tasks as they are needed, errors as they are."""
    with make() as engine:
        laws.each_task_has_its_result_once(engine)
        laws.tasks_are_taken_as_they_are_needed(engine, 2 * engine.workers)
        laws.an_error_of_the_work_is_raised(engine)


def test_one_worker_works_here():
    """One worker needs no ``with`` block and no process; results come as they are asked for."""
    for engine in (SerialEngine(), ProcessEngine(1)):
        seen = []
        found = engine.map(lambda number, seen=seen: seen.append(number) or number**2, range(4))
        assert next(found) == 0
        assert seen == [0]
        assert list(found) == [1, 4, 9]
