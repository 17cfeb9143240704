"""Files and folders are whole or absent, and lines are on the disk."""

import errno
import os
import signal
import subprocess
import sys

import pytest

from andabata.runs import atomic_io


def test_a_file_is_written_and_replaced(tmp_path):
    """A second write replaces the file and leaves no temporary file."""
    path = tmp_path / "file.bin"
    atomic_io.write(path, b"one")
    atomic_io.write(path, b"two")
    assert path.read_bytes() == b"two"
    assert [entry.name for entry in tmp_path.iterdir()] == ["file.bin"]


def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch):
    """A failed write keeps the old contents and leaves no temporary file."""
    path = tmp_path / "file.bin"
    atomic_io.write(path, b"one")

    def fail(descriptor):
        raise OSError("disk full")

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(OSError, match="disk full"):
        atomic_io.write(path, b"two")
    assert path.read_bytes() == b"one"
    assert [entry.name for entry in tmp_path.iterdir()] == ["file.bin"]


def test_a_full_disk_is_reported_with_file_and_size(tmp_path, monkeypatch):
    """The error of a full disk names the file and the bytes needed, and the old file stays."""
    path = tmp_path / "file.bin"
    atomic_io.write(path, b"one")

    def fail(descriptor):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(OSError, match="expected disk space for 3 bytes, got none") as caught:
        atomic_io.write(path, b"two")
    assert (caught.value.errno, caught.value.filename) == (errno.ENOSPC, str(path))
    assert path.read_bytes() == b"one"


def test_an_appended_line_is_synced_to_the_disk(tmp_path, monkeypatch):
    """A line is appended whole, in UTF-8, before the one fsync."""
    path, synced = tmp_path / "lines.txt", []
    atomic_io.write(path, b"one\n")
    monkeypatch.setattr(os, "fsync", lambda descriptor: synced.append(path.read_bytes()))
    atomic_io.append_line(path, "zwölf")
    assert synced == ["one\nzwölf\n".encode()]


def test_a_line_is_not_appended_to_a_missing_file(tmp_path):
    """Appending creates no file."""
    with pytest.raises(FileNotFoundError):
        atomic_io.append_line(tmp_path / "missing.txt", "one")


def test_a_file_takes_its_name_when_it_is_whole(tmp_path):
    """A file has its name after the block, and the old contents after an interrupted one."""
    path = tmp_path / "file.bin"
    with atomic_io.open_file(path) as file:
        file.write(b"one two")
        file.seek(0)
        file.write(b"ONE")
        assert not path.exists()
    assert path.read_bytes() == b"ONE two"

    def interrupted():
        with atomic_io.open_file(path) as file:
            file.write(b"three")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert path.read_bytes() == b"ONE two"
    assert [entry.name for entry in tmp_path.iterdir()] == ["file.bin"]


def test_a_folder_takes_its_name_when_it_is_whole(tmp_path):
    """A folder has its name after the block, and does not exist after an interrupted one."""
    path = tmp_path / "folder"

    def interrupted():
        with atomic_io.create_folder(path) as folder:
            (folder / "a").write_bytes(b"a")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert list(tmp_path.iterdir()) == []
    with atomic_io.create_folder(path) as folder:
        (folder / "a").write_bytes(b"a")
        assert not path.exists()
    assert [entry.name for entry in path.iterdir()] == ["a"]
    assert list(tmp_path.iterdir()) == [path]
    with pytest.raises(FileNotFoundError), atomic_io.create_folder(tmp_path / "no" / "folder"):
        pass


def test_a_file_is_on_the_disk_before_it_takes_its_name(tmp_path, monkeypatch):
    """The bytes are synced under the temporary name, and the folder after the rename."""
    path, synced = tmp_path / "file.bin", []
    monkeypatch.setattr(os, "fsync", lambda descriptor: synced.append(path.exists()))
    atomic_io.write(path, b"one")
    assert synced == [False, True]
    assert path.stat().st_mode & 0o777 == 0o644


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EFBIG])
def test_every_kind_of_full_disk_asks_for_space(tmp_path, number):
    """Full disks, used-up quotas and size limits give the same next step."""

    def fail():
        with atomic_io.open_file(tmp_path / "file.bin"):
            raise OSError(number, "no")

    with pytest.raises(OSError, match="expected disk space for the file, got none; free some"):
        fail()
    assert list(tmp_path.iterdir()) == []


def test_other_errors_keep_their_message(tmp_path):
    """An error that is not about space is raised unchanged."""

    def fail():
        with atomic_io.open_file(tmp_path / "file.bin"):
            raise OSError(errno.EIO, "broken")

    with pytest.raises(OSError, match="broken"):
        fail()


def test_files_and_folders_need_their_parent(tmp_path):
    """A missing parent is an error that names it, and it is not created."""
    parent = tmp_path / "no"
    with pytest.raises(FileNotFoundError, match="expected an existing folder") as caught:
        atomic_io.write(parent / "file.bin", b"one")
    assert caught.value.filename == str(parent)
    assert list(tmp_path.iterdir()) == []


_BEGIN = """
import sys, time
from pathlib import Path
from andabata.runs import atomic_io
begin = getattr(atomic_io, sys.argv[1])
with begin(Path(sys.argv[2])) as begun:
    if sys.argv[1] == "open_file":
        begun.write(b"half")
        begun.flush()
    else:
        (begun / "a").write_bytes(b"half")
    print("begun", flush=True)
    time.sleep(60)
"""


def names(folder):
    """Return the names of all entries of a folder."""
    return sorted(entry.name for entry in folder.iterdir())


@pytest.mark.parametrize("begin", ["open_file", "create_folder"])
def test_what_a_kill_leaves_is_swept_and_what_is_being_written_is_not(tmp_path, begin):
    """A temporary file or folder stays while its process lives; names and other files stay."""
    folder, path = tmp_path / "run", tmp_path / "run/result"
    folder.mkdir()
    for name in (".result.abcdefgh", ".git", "result.abcdefgh.part", ".result.ABC.part"):
        (folder / name).touch()
    before = names(folder)
    words = [sys.executable, "-c", _BEGIN, begin, str(path)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "begun\n"
        begun = names(folder)
        assert len(begun) == len(before) + 1
        atomic_io.sweep(tmp_path)
        assert names(folder) == begun
        process.send_signal(signal.SIGKILL)
    assert names(folder) == begun
    atomic_io.sweep(folder, "other")
    atomic_io.sweep(tmp_path, "result")
    assert names(folder) == begun
    atomic_io.sweep(tmp_path)
    assert names(folder) == before


def test_a_sweep_goes_by_the_name_and_follows_no_link(tmp_path):
    """With a name only its own temporary file is removed; the target of a link stays."""
    for name in (".a.abcdefgh.part", ".b.abcdefgh.part", "kept"):
        (tmp_path / name).touch()
    (tmp_path / ".a.link_123.part").symlink_to(tmp_path / "kept")
    atomic_io.sweep(tmp_path, "a")
    assert names(tmp_path) == [".a.link_123.part", ".b.abcdefgh.part", "kept"]


def test_a_folder_that_is_made_again_sweeps_its_last_try(tmp_path):
    """There is no lock of a run for it."""
    (tmp_path / ".bag.abcdefgh.part").mkdir()
    (tmp_path / ".bag.abcdefgh.part/a").touch()
    with atomic_io.create_folder(tmp_path / "bag"):
        assert len(names(tmp_path)) == 1
    assert names(tmp_path) == ["bag"]


def test_a_file_that_is_swept_before_it_is_locked_is_made_again(tmp_path, monkeypatch):
    """The sweep of another process in that moment costs nothing."""
    flock, tries = atomic_io.fcntl.flock, []

    def swept_first(handle, kind):
        tries.append(kind)
        if len(tries) == 1:
            for entry in tmp_path.iterdir():
                entry.unlink()
        flock(handle, kind)

    monkeypatch.setattr(atomic_io.fcntl, "flock", swept_first)
    atomic_io.write(tmp_path / "file.bin", b"one")
    assert (tmp_path / "file.bin").read_bytes() == b"one"
    assert len(tries) == 2


def test_no_descriptor_is_left_open(tmp_path):
    """Files and folders close what they have opened, also after an error."""
    (tmp_path / "lines").touch()
    before = len(os.listdir("/proc/self/fd"))
    atomic_io.write(tmp_path / "file", b"one")
    atomic_io.append_line(tmp_path / "lines", "one")
    for name in ("folder", "folder/file/no"):
        try:
            with atomic_io.create_folder(tmp_path / name):
                pass
        except OSError:
            pass
    atomic_io.sweep(tmp_path)
    assert len(os.listdir("/proc/self/fd")) == before


_FULL = """
import resource, sys
from pathlib import Path
from andabata.runs import atomic_io
resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))
for act in (atomic_io.append_line, lambda path, text: atomic_io.write(path, text.encode())):
    try:
        act(Path(sys.argv[1]), "x" * 150)
    except OSError as error:
        print(error.filename, error.strerror, sep=": ")
"""


def test_a_disk_that_is_really_full_leaves_every_file_as_it_was(tmp_path):
    """A line of which a part was written is taken back; the error names file and need."""
    path = tmp_path / "lines.txt"
    atomic_io.write(path, b"one\n")
    words = [sys.executable, "-c", _FULL, str(path)]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == [
        f"{path}: expected disk space for {needed}, got none; free some and go on"
        for needed in ("a line", "150 bytes")
    ]
    assert path.read_bytes() == b"one\n"
    assert names(tmp_path) == ["lines.txt"]


@pytest.mark.parametrize("number", [errno.EACCES, errno.EPERM, errno.EROFS])
@pytest.mark.parametrize("begin", ["open_file", "create_folder"])
def test_a_folder_that_cannot_be_written_is_named_and_not_a_temporary_file(
    tmp_path, monkeypatch, begin, number
):
    """The error names what the user knows, and the next step."""

    def fail(path, *rest):
        raise OSError(number, os.strerror(number), path)

    for name in ("open", "mkdir"):
        monkeypatch.setattr(atomic_io.tempfile._os, name, fail)
    begun = getattr(atomic_io, begin)(tmp_path / "out")
    with pytest.raises(OSError, match="take another folder") as caught, begun:
        pass
    assert (caught.value.errno, caught.value.filename) == (number, str(tmp_path / "out"))
    assert os.strerror(number) in caught.value.strerror


def test_an_error_about_another_file_is_not_explained(tmp_path):
    """What a block reads may be unreadable, too."""
    begun = atomic_io.open_file(tmp_path / "out")
    with pytest.raises(PermissionError, match="no") as caught, begun:
        raise PermissionError(errno.EACCES, "no", str(tmp_path / "source"))
    assert caught.value.filename == str(tmp_path / "source")
