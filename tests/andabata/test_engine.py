"""The engine's laws for this process and for several, without the cluster."""

import errno
from dataclasses import replace

import pytest

from andabata.engine import SerialEngine, answer
from andabata.engine_origin import OriginError, here
from andabata.engine_processes import ProcessEngine
from tests.support import engine_laws as laws


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


def test_a_full_disk_of_another_machine_is_named():
    """An error of a file says on whose disk, unless it is that of the driver."""

    def fill_the_disk(number):
        raise OSError(errno.ENOSPC, "no space", "/tmp/file")

    for driver, text in ((here().host, "no space"), ("driver", f"no space (on {here().host})")):
        with pytest.raises(OSError, match="no space") as caught:
            answer(replace(here(), host=driver), fill_the_disk, 1)
        assert (caught.value.strerror, caught.value.filename) == (text, "/tmp/file")


def test_workers_of_other_machines_are_told_once():
    """The machine, and the note of another processor, come with its first result."""
    told, theirs = [], replace(here(), host="node-7", cpu="another")
    engine = ProcessEngine(2, told.append)
    for origin in (here(), theirs, theirs):
        engine._greet(origin)
    assert len(told) == 2
    assert told[0].startswith("results from node-7: another, commit")
    assert "node-7 has another processor" in told[1]


def test_a_worker_of_other_code_runs_nothing():
    """The origin is checked before the work begins."""
    ran = []
    with pytest.raises(OriginError):
        answer(replace(here(), sources="0" * 64), ran.append, 1)
    assert not ran
    assert answer(here(), lambda number: number + 1, 1).result == 2
