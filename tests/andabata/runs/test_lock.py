"""Lock of a run folder: one command writes there, and a dead one is no obstacle."""

import errno
import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest

from andabata.app.cli import main
from andabata.runs.lock import LOCK, RunLockError, locked_file, locked_folder

_HOLD = """
import sys, time
from pathlib import Path
from andabata.runs.lock import locked_folder
with locked_folder(Path(sys.argv[1])):
    print("locked", flush=True)
    time.sleep(60)
"""


@pytest.fixture
def other(tmp_path):
    """A process that writes the folder ``run``."""
    words = [sys.executable, "-c", _HOLD, str(tmp_path / "run")]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "locked\n"
        yield process
        process.kill()


def test_a_second_writer_is_refused_with_the_first_one_named(tmp_path, other):
    """The error names folder and process; the refused one leaves the lock to its owner."""
    folder = tmp_path / "run"
    for _ in range(2):
        with pytest.raises(RunLockError) as error, locked_folder(folder):
            pass
        assert f"{folder}: expected" in str(error.value)
        assert f"process {other.pid} (-c {folder})" in str(error.value)
        assert str(error.value).endswith("take another --out")
    assert (folder / LOCK).exists()


def test_the_lock_of_a_dead_process_is_no_obstacle(tmp_path, other):
    """The file stays when its process is killed, and the folder is free."""
    other.send_signal(signal.SIGKILL)
    other.wait()
    assert (tmp_path / "run" / LOCK).exists()
    with locked_folder(tmp_path / "run") as folder:
        assert (folder / LOCK).read_text().startswith(f"{os.getpid()} ")
    assert not (tmp_path / "run" / LOCK).exists()


def test_a_lock_ends_with_its_block(tmp_path):
    """Also after an error; a file that was written stays, the lock's does not."""
    for number in range(2):
        with suppress(KeyError), locked_folder(tmp_path / "a/run") as folder:
            (folder / f"{number}").touch()
            raise KeyError
    assert sorted(path.name for path in folder.iterdir()) == ["0", "1"]


def test_what_writes_nothing_leaves_no_folder(tmp_path):
    """Folders that were there before stay."""
    (tmp_path / "here").mkdir()
    with locked_folder(tmp_path / "here/run/deep"):
        pass
    assert list(tmp_path.rglob("*")) == [tmp_path / "here"]
    with locked_folder(tmp_path / "here"):
        pass
    assert (tmp_path / "here").is_dir()


def test_no_folder_needs_no_lock():
    """A command without ``--out`` writes none."""
    with locked_folder(None) as folder:
        assert folder is None


@pytest.mark.parametrize(
    "words",
    [
        ["drive", "--time-limit", "1"],
        ["train", "--workers", "1"],
        ["evaluate", "--trials", "1"],
        ["evaluate", "--task", "barn"],
        ["evaluate", "--task", "spn"],
        ["lidar-study"],
        ["demo"],
        ["clouds", "generate", "--train", "1", "--validation", "0"],
        ["classifier", "train", "--clouds", "none"],
        ["classifier", "ground", "--clouds", "none"],
    ],
    ids=" ".join,
)
def test_each_command_that_writes_a_run_folder_refuses_a_busy_one(tmp_path, capsys, words):
    """One line on stderr, exit code 1, and nothing is written."""
    with locked_folder(tmp_path):
        assert main([*words, "--out", str(tmp_path)]) == 1
        error = capsys.readouterr().err
        assert f"error: {tmp_path}: expected a folder that no other command writes" in error
        assert len([line for line in error.splitlines() if line.startswith("error")]) == 1
        assert [path.name for path in tmp_path.iterdir()] == [LOCK]


def test_a_command_that_writes_a_file_refuses_one_that_another_writes(tmp_path, capsys):
    """Other files of the folder are free, and nothing is left."""
    words = ["classifier", "adapt", "none.bag", "--clouds", "none"]
    with locked_file(tmp_path / "mine.npz") as path:
        assert main([*words, "--out", str(path)]) == 1
        error = capsys.readouterr().err
        assert f"error: {path}: expected a file that no other command writes" in error
        with locked_file(tmp_path / "other.npz"):
            assert len(list(tmp_path.iterdir())) == 2
    assert list(tmp_path.iterdir()) == []


def test_the_lock_of_a_file_needs_its_folder(tmp_path, capsys):
    """The command fails before its work, not after it."""
    out = tmp_path / "missing/mine.npz"
    assert main(["classifier", "adapt", "none.bag", "--clouds", "none", "--out", str(out)]) == 1
    assert capsys.readouterr().err == f"error: {out.parent}: expected an existing folder\n"


def test_who_gets_the_lock_sweeps_what_kills_have_left(tmp_path):
    """Of a folder all of it; of a file only its own."""
    (tmp_path / "deep").mkdir()
    for name in (".a.npz.abcdefgh.part", ".b.abcdefgh.part", "deep/.c.abcdefgh.part"):
        (tmp_path / name).touch()
    with locked_file(tmp_path / "a.npz"):
        left = sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*.part"))
        assert left == [".b.abcdefgh.part", "deep/.c.abcdefgh.part"]
    with locked_folder(tmp_path):
        assert list(tmp_path.rglob("*.part")) == []


def test_a_busy_folder_is_not_swept(tmp_path, other):
    """A refused command changes nothing."""
    left = tmp_path / "run/.b.abcdefgh.part"
    left.touch()
    with pytest.raises(RunLockError), locked_folder(tmp_path / "run"):
        pass
    assert left.exists()


@pytest.mark.parametrize(
    ("number", "expected"),
    [
        (errno.EROFS, "expected permission to write, got 'Read-only file system'; take another"),
        (errno.ENOSPC, "expected disk space for a lock, got none; free some and go on"),
    ],
)
def test_a_folder_that_cannot_be_written_is_named_before_the_work(
    tmp_path, monkeypatch, number, expected
):
    """The text gives the next step, whether it is read-only or on a full disk."""

    def fail(path, *rest, **words):
        raise OSError(number, os.strerror(number), str(path))

    monkeypatch.setattr(Path, "open", fail)
    with pytest.raises(OSError, match=expected) as error, locked_folder(tmp_path):
        pass
    assert error.value.filename == str(tmp_path / LOCK)
