"""A built wheel holds all that the packages need, and runs where nothing else of the project is."""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tomllib
import venv
import zipfile
from pathlib import Path

import pytest
from hatchling.builders.sdist import SdistBuilder
from hatchling.builders.wheel import WheelBuilder

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("andabata", "terrain", "worlds", "traversability", "rl")


def files_of_packages():
    """Return every file of the packages but what Python and numba leave there."""
    found = (path for name in PACKAGES for path in (ROOT / name).rglob("*") if path.is_file())
    return {path.relative_to(ROOT).as_posix() for path in found if "__pycache__" not in path.parts}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    return Path(next(WheelBuilder(str(ROOT)).build(directory=str(folder), versions=["standard"])))


STUDIES = "andabata/bench/studies/"
"""Folder of what runs from the repository alone."""


def test_a_wheel_holds_every_file_of_the_packages_but_studies_and_no_other(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = {name for name in archive.namelist() if ".dist-info/" not in name}
    studies = {name for name in files_of_packages() if name.startswith(STUDIES)}
    assert studies
    assert names == files_of_packages() - studies
    kinds = {Path(name).suffix for name in names}
    assert {".py", ".toml", ".npz", ".safetensors"} <= kinds


def test_a_source_distribution_holds_them_and_the_documents(tmp_path):
    path = next(SdistBuilder(str(ROOT)).build(directory=str(tmp_path), versions=["standard"]))
    with tarfile.open(path) as archive:
        names = {name.split("/", 1)[1] for name in archive.getnames()}
    assert files_of_packages() | {"README.md", "LICENSE", "pyproject.toml", "Makefile"} <= names


def test_what_a_wheel_installs_finds_its_data(wheel, tmp_path):
    """Lasers, bodies, plans and models: each is read from the unpacked wheel alone."""
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path / "site")
    code = f"""
import andabata
assert andabata.__file__.startswith({str(tmp_path)!r}), andabata.__file__
from andabata.machine.robot import RobotModel
from andabata.machine.lidar_models import sensor_settings
from andabata.models import Models, shipped_policy
from andabata.training.plans import TASKS, algorithms, load_plan
from worlds.rooms.catalogue import make_room, room_names
for sensor in ("utm-30lx", "os1-64", "os0-128", "vlp-16", "livox-rosette"):
    sensor_settings(sensor)
for robot in ("andabata", "husky", "jackal"):
    RobotModel.load(robot)
plans = [load_plan(name, task=task) for task in TASKS for name in algorithms(task)]
assert len(plans) == 13, plans
assert len([make_room(name) for name in room_names()]) == 21
Models().to_bytes()
shipped_policy("actor-critic"), shipped_policy("imitation")
"""
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(tmp_path / "site")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """Return a function that runs a program of an environment with the wheel, in an empty folder.

    What the wheel needs comes from the environment of the tests, which would take minutes to copy.
    """
    folder = tmp_path_factory.mktemp("installed")
    venv.create(folder / ".venv", symlinks=True, with_pip=True)
    kept = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}

    # pip has to know nothing of it: it would find another andabata there.
    needed = {"PYTHONPATH": sysconfig.get_path("purelib")}

    def run(*words, code=0):
        done = subprocess.run(
            [folder / ".venv/bin" / words[0], *words[1:]],
            cwd=folder,
            env=kept | (needed if words[0] == "andabata" else {}),
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == code, done.stdout + done.stderr
        return done.stdout

    shutil.copy(wheel, folder)
    run("pip", "install", "--no-deps", "--no-index", wheel.name)
    run.wheel = wheel.name
    return run


def test_an_installed_wheel_is_whole(installed):
    """The doctor finds all packages in the environment, and nothing changed."""
    found = json.loads(installed("andabata", "doctor", "--json"))
    assert found["ok"], found
    assert found["origins"]["rl"].endswith("site-packages/rl")
    assert ".venv" in found["origins"]["rl"]
    assert (found["changed_files"], found["claims"]) == ([], [])


def made_wheel(folder, files):
    """Write a wheel of another distribution, as a build tool does, and return its path."""
    about = "terrain_tools-1.0.dist-info"
    files = files | {
        f"{about}/METADATA": "Metadata-Version: 2.1\nName: terrain-tools\nVersion: 1.0\n",
        f"{about}/WHEEL": "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
    }
    path = folder / "terrain_tools-1.0-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in files.items():
            archive.writestr(name, text)
        archive.writestr(f"{about}/RECORD", "".join(f"{name},,\n" for name in files))
    return path


def test_what_another_distribution_overwrites_is_mended_by_the_advised_steps(installed, tmp_path):
    """Each step of the message is typed as it is printed; afterwards all is whole."""
    other = made_wheel(tmp_path, {"terrain/__init__.py": "", "terrain/objects.py": "x = 1\n"})
    installed("pip", "install", "--no-deps", "--no-index", str(other))
    found = json.loads(installed("andabata", "doctor", "--json", code=1))
    ((text,), changed) = [each["text"] for each in found["claims"]], found["changed_files"]
    assert "terrain-tools 1.0 has files of it among ours" in text
    assert "terrain/objects.py in place of ours" in text
    assert [Path(file).name for file in changed] == ["__init__.py", "objects.py"]
    uninstall, again = re.findall(r"`(pip [^`]+)`", text)
    installed(*shlex.split(uninstall), "--yes")
    # A shell replaces the pattern by the wheel's name.
    words = [installed.wheel if word == "andabata-*.whl" else word for word in shlex.split(again)]
    assert installed.wheel in words
    installed(*words)
    found = json.loads(installed("andabata", "doctor", "--json"))
    assert (found["ok"], found["claims"], found["changed_files"]) == (True, [], [])


def test_the_command_and_nothing_that_no_library_reads_is_declared():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["scripts"] == {"andabata": "andabata.app.cli:run"}
    assert "entry-points" not in project
