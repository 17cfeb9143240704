"""Files and folders are whole or absent, and lines are on the disk."""

import errno
import os

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
