"""Options of who does the work."""

import sys

import pytest

from andabata.app.cli import main
from andabata.app.console import Console
from andabata.app.options.shared import EngineOptions
from andabata.configuration.usage import UsageError
from andabata.engine import SerialEngine
from andabata.engine_processes import ProcessEngine
from andabata.engine_ray import RayEngine


@pytest.mark.parametrize(
    ("options", "kind"),
    [
        (EngineOptions(), ProcessEngine),
        (EngineOptions(engine="serial"), SerialEngine),
        (EngineOptions(engine="ray"), RayEngine),
        (EngineOptions(engine="ray", address="auto"), RayEngine),
    ],
)
def test_each_word_is_an_engine(options, kind):
    """Engines come by their names; Ray is not asked before it is used."""
    assert type(options.make(Console(quiet=True))) is kind


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (EngineOptions(engine="dask"), "--engine: expected one of serial, processes, ray"),
        (EngineOptions(address="auto"), "--address: expected --engine ray beside it, got proc"),
    ],
)
def test_wrong_words_are_named(options, message):
    """An unknown engine, and an address without Ray."""
    with pytest.raises(UsageError, match=message):
        options.make(Console(quiet=True))


def test_without_ray_a_command_ends_with_the_line_that_installs_it(monkeypatch, tmp_path, capsys):
    """One line, exit code 1, and nothing is written."""
    monkeypatch.setitem(sys.modules, "ray", None)
    assert main(["clouds", "generate", "--out", str(tmp_path / "x"), "--engine", "ray"]) == 1
    error = capsys.readouterr().err
    assert error.startswith("error: --engine ray: expected the package ray, got none in")
    assert error.endswith("pip install -e '.[ray]'\n")
    assert not (tmp_path / "x").exists()
