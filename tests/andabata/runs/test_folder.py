"""Run folders describe how a run came about."""

import errno
import json
import os
import subprocess
import sys
import types
from importlib.machinery import ModuleSpec
from pathlib import Path

import pytest

from andabata.runs.folder import (
    LEDGER,
    command_line,
    commit,
    describe,
    make_folder,
    versions,
    write_json,
)


def test_json_is_sorted_and_ends_with_a_line_feed(tmp_path):
    """The same data give the same bytes, whatever their order."""
    for name, data in (("a", {"x": 1, "y": 2}), ("b", {"y": 2, "x": 1})):
        write_json(tmp_path / name, data)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
    assert (tmp_path / "a").read_text().endswith("}\n")


def test_a_description_tells_runs_apart():
    """Settings change the hash and the seed does not; all are JSON."""
    first, second = describe("train", {"a": 1}, 3), describe("train", {"a": 2}, 3)
    assert first["config_sha256"] != second["config_sha256"]
    assert first["config_sha256"] == describe("train", {"a": 1}, 4)["config_sha256"]
    assert (first["verb"], first["seed"], first["config"]) == ("train", 3, {"a": 1})
    json.dumps(first)


@pytest.mark.parametrize(
    ("module", "program", "expected"),
    [
        ("andabata.__main__", "/x/andabata/__main__.py", "andabata train 'a b'"),
        ("andabata.bench.a.__main__", "/x/a/__main__.py", "python -m andabata.bench.a train 'a b'"),
        (None, "/x/bin/andabata", "andabata train 'a b'"),
    ],
)
def test_a_command_line_can_be_given_anywhere(module, program, expected, monkeypatch):
    """However the program was started, and wherever it lies."""
    main = types.ModuleType("__main__")
    main.__spec__ = module and ModuleSpec(module, None)
    monkeypatch.setitem(sys.modules, "__main__", main)
    monkeypatch.setattr("sys.argv", [program, "train", "a b"])
    assert command_line() == expected


def test_versions_of_missing_packages_are_none(monkeypatch):
    """A package that is not installed has no version."""
    monkeypatch.setattr("andabata.runs.folder._PACKAGES", ("numpy", "no-such-package"))
    found = versions()
    assert found["numpy"]
    assert found["no-such-package"] is None


@pytest.mark.parametrize(("status", "expected"), [("", "0123456789ab"), ("M x\n", "0123456789ab+")])
def test_a_changed_checkout_is_marked(monkeypatch, status, expected):
    """The commit has twelve digits, and a plus sign with uncommitted changes."""

    def run(words, **_):
        text = status if "status" in words else "0123456789abcdef\n"
        return subprocess.CompletedProcess(words, 0, text, "")

    monkeypatch.setattr(subprocess, "run", run)
    assert commit() == expected


def test_an_entry_in_the_ledger_is_no_change_of_the_code(monkeypatch):
    """Git is not asked about it: a judging run that goes on is of the same commit."""
    asked = []

    def run(words, **_):
        asked.append(words)
        return subprocess.CompletedProcess(words, 0, "", "")

    monkeypatch.setattr(subprocess, "run", run)
    commit()
    assert asked[0][-3:] == ["--", ".", f":(exclude){LEDGER}"]


def test_without_git_there_is_no_commit(monkeypatch):
    """A missing git gives None."""

    def run(*_, **__):
        raise FileNotFoundError

    monkeypatch.setattr(subprocess, "run", run)
    assert commit() is None


def test_a_folder_is_made_with_its_parents_once(tmp_path):
    """An existing folder is kept; a file of its name is an error."""
    folder = make_folder(tmp_path / "a" / "b")
    assert make_folder(folder) == folder
    assert folder.is_dir()
    (tmp_path / "file").touch()
    with pytest.raises(FileExistsError):
        make_folder(tmp_path / "file")


@pytest.mark.parametrize("number", [errno.EROFS, errno.ENOSPC])
def test_a_folder_that_cannot_be_made_is_named_with_the_next_step(tmp_path, monkeypatch, number):
    """Also where it is a parent that cannot be made."""

    def fail(path, *rest, **words):
        raise OSError(number, os.strerror(number), str(tmp_path / "a"))

    monkeypatch.setattr(Path, "mkdir", fail)
    for folder in (tmp_path / "a", tmp_path / "a/b/c"):
        with pytest.raises(OSError, match=r"take another folder|free some and go on") as error:
            make_folder(folder)
        assert (error.value.errno, error.value.filename) == (number, str(folder))
