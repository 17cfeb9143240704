"""The cluster: the engine's laws on two raylets of this machine, one of which is killed.

Ray is an extra of its own: without it all but the errors are skipped.
"""

import json
import os
import sys
from functools import partial
from importlib.util import find_spec

import pytest

from andabata.app.cli import main
from andabata.bench.studies.cluster import digests
from andabata.bench.studies.raylets import raylets
from andabata.engine_origin import OriginError
from andabata.engine_ray import RayEngine, RayError
from andabata.runs.journal import Journal
from tests.support import engine_laws as laws
from tests.support.engine_work import (
    Unreadable,
    kill_the_worker_once,
    square,
    threads_of_the_worker,
)

UNLIKE = ("run.json", "trials.jsonl")
"""Files that hold the command line, and trials in the order in which they ended."""

needs_ray = pytest.mark.skipif(find_spec("ray") is None, reason="no ray: it is an extra, `ray`")
pytestmark = pytest.mark.filterwarnings("ignore")  # Ray's own, of sockets and processes.


@pytest.fixture(scope="module")
def cluster():
    os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("OMP_NUM_THREADS", "2")  # What the nodes are started with is not the workers'.
        with raylets(2) as found:
            yield found


def test_without_ray_the_line_that_installs_it_is_named(monkeypatch):
    """The error says what to type."""
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(RayError, match=r"expected the package ray, got none .*; pip install"):
        RayEngine(2).__enter__()


@needs_ray
@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("nowhere", "expected auto or HOST:PORT, got 'nowhere'"),
        ("127.0.0.1:1", "expected the head of a Ray cluster, got no answer .*ray start --head"),
    ],
)
def test_an_address_that_does_not_answer_is_named(address, message):
    """The error comes at once, with the next step."""
    with pytest.raises(RayError, match=message):
        RayEngine(2, address).__enter__()


@needs_ray
def test_the_laws_of_an_engine_hold_on_a_cluster(cluster, tmp_path, monkeypatch):
    """Results once, tasks as they are needed, killed workers, origins, one thread a worker."""
    told = []
    with RayEngine(2, cluster.address, told.append) as engine:
        laws.each_task_has_its_result_once(engine)
        laws.tasks_are_taken_as_they_are_needed(engine, 2)
        laws.an_error_of_the_work_is_raised(engine)
        work = partial(kill_the_worker_once, str(tmp_path))
        laws.a_killed_worker_loses_nothing(engine, work, told)
        laws.a_task_that_kills_its_workers_ends_the_run(engine, told, monkeypatch)
        laws.a_worker_of_another_origin_is_refused(engine)
        assert list(engine.map(threads_of_the_worker, [0])) == ["1"]
        with pytest.raises(OriginError, match=r"got one that cannot read a task .*; install that"):
            list(engine.map(str, [Unreadable()]))
    with pytest.raises(ValueError, match="expected a `with` block for Ray"):
        list(engine.map(square, [1]))


def run(capsys, *words):
    assert main([*map(str, words), "--json"]) == 0
    return json.loads(capsys.readouterr().out)


@needs_ray
def test_a_killed_raylet_changes_no_result(cluster, tmp_path, capsys, monkeypatch):
    """Clouds and trials of a cluster that loses a raylet are those of one process, each once."""
    noted, append = [], Journal.append

    def append_and_kill(journal, entry):
        append(journal, entry)
        noted.append(next(iter(entry.values())))
        if len(noted) == 1:
            cluster.kill_one()

    clouds = ["clouds", "generate", "--train", 4, "--validation", 1]
    clouds += ["--set", "patch_size=40", "--set", "patch_cell=0.25", "--set", "clouds_per_world=1"]
    trials = ["evaluate", "--world", "maze", "--trials", 3, "--controllers", "straight"]
    trials += ["--set", "terminations.time_limit=1"]
    on_ray = ["--engine", "ray", "--address", cluster.address, "--workers", 2]
    for words, count in ((clouds, 5), (trials, 3)):
        one, two = tmp_path / words[0] / "one", tmp_path / words[0] / "two"
        alone = run(capsys, *words, "--out", one, "--engine", "serial")
        with monkeypatch.context() as patch:
            patch.setattr(Journal, "append", append_and_kill)
            many = run(capsys, *words, "--out", two, *on_ray)
        assert sorted(noted) == list(range(count))
        assert many | {"out": None} == alone | {"out": None}
        assert digests(one, *UNLIKE) == digests(two, *UNLIKE)
        noted.clear()
        cluster.start_one()
