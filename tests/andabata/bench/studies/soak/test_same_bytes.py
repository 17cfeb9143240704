"""Same seed, same bytes: equal files have one digest, and others are noticed."""

import pytest

from andabata.bench.studies.soak import same_bytes
from andabata.bench.studies.soak.same_bytes import (
    COMMANDS,
    RESULTS,
    digest,
    same_seed_gives_the_same_bytes,
)
from tests.support.documents import complaint


def writes(monkeypatch, content):
    """Let commands write files whose content is a function of the number of workers."""

    def run(words, hash_seed):
        out = same_bytes.Path(words[words.index("--out") + 1])
        out.mkdir()
        data = content(words[words.index("--workers") + 1])
        for patterns in RESULTS.values():
            for pattern in patterns:
                (out / pattern.replace("*", "a")).write_bytes(data)

    monkeypatch.setattr(same_bytes, "_run", run)


def test_equal_bytes_have_one_digest(tmp_path, monkeypatch):
    """Each number of workers has a process."""
    writes(monkeypatch, lambda workers: b"same")
    outcome = same_seed_gives_the_same_bytes(3, tmp_path)
    assert (outcome.trials, outcome.failures) == (3 * len(COMMANDS), ())


def test_bytes_that_depend_on_the_workers_are_noticed(tmp_path, monkeypatch):
    """The processes are named with their workers."""
    writes(monkeypatch, lambda workers: workers.encode())
    outcome = same_seed_gives_the_same_bytes(2, tmp_path)
    assert outcome.failed == len(COMMANDS)
    assert "['0 (1 workers)'], ['1 (2 workers)']" in outcome.failures[0]


def test_a_digest_is_that_of_names_and_bytes(tmp_path):
    """Of the files of the patterns alone; none is an error."""
    (tmp_path / "a.npz").write_bytes(b"1")
    before = digest(tmp_path, ("*.npz",))
    (tmp_path / "run.json").write_bytes(b"2")
    assert digest(tmp_path, ("*.npz",)) == before
    (tmp_path / "a.npz").rename(tmp_path / "b.npz")
    assert digest(tmp_path, ("*.npz",)) != before
    with pytest.raises(ValueError, match="expected files"):
        digest(tmp_path, ("*.txt",))


@pytest.mark.parametrize("name", COMMANDS)
def test_the_commands_exist(name):
    """With their options."""
    assert complaint(" ".join(["andabata", *COMMANDS[name]])) is None
