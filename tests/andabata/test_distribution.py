"""The line that installs what is missing: another one in a clone than beside a wheel."""

import re
import shlex
import subprocess
import tomllib
from pathlib import Path

import pytest

from andabata import distribution
from andabata.distribution import (
    HOME,
    install_again,
    install_browser,
    install_extra,
    install_ros,
    is_clone,
)


@pytest.fixture
def in_wheel(monkeypatch):
    monkeypatch.setattr(distribution, "is_clone", lambda: False)


def test_a_clone_has_its_project_file_and_makefile(tmp_path):
    """These packages stand in a clone; a folder that lacks one of the two files is none."""
    assert is_clone()
    assert not is_clone(tmp_path)
    for name in ("pyproject.toml", "Makefile"):
        assert not is_clone(tmp_path)
        (tmp_path / name).touch()
    assert is_clone(tmp_path)


def test_in_a_clone_extras_come_from_it_and_programs_from_make():
    """Targets of make are there."""
    assert shlex.split(install_extra("las")) == ["pip", "install", "-e", ".[las]"]
    assert shlex.split(install_again())[-2:] == ["-e", str(HOME)]
    for line in (install_ros(), install_browser()):
        word, target = line.split()
        assert word == "make"
        assert f"\n{target}:" in (HOME / "Makefile").read_text()


def test_beside_a_wheel_nothing_of_a_clone_is_advised(in_wheel):
    """Extras come by the distribution's name, programs from the system."""
    assert shlex.split(install_extra("las")) == ["pip", "install", "andabata[las]"]
    lines = install_extra("las"), install_ros(), install_browser(), install_again()
    assert not any("make" in line or "-e" in shlex.split(line) for line in lines)
    assert install_ros().startswith("apt install ros-core python3-rospy")
    assert install_browser().startswith("apt install chromium")


def test_no_other_module_writes_such_a_line():
    """Messages take it from here, and the extras that they name are the project's."""
    listed = subprocess.run(
        ["git", "-C", str(HOME), "ls-files", "*.py"], capture_output=True, text=True, check=False
    ).stdout.split()
    files = [HOME / name for name in listed if not name.startswith("tests/")]
    project = tomllib.loads((HOME / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    for file in files:
        text = file.read_text()
        if file != Path(distribution.__file__):
            assert not re.search(r"\.\[\w+\]'|andabata\[|make (ros|browser)\b[^`]*\"", text), file
        named = re.findall(r"install_extra\(['\"](\w+)['\"]\)", text)
        assert set(named) <= set(extras), file
