"""A built wheel holds all that the packages need, and runs where nothing else of the project is."""

import os
import subprocess
import sys
import tarfile
import tomllib
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
assert len(plans) == 12, plans
assert len([make_room(name) for name in room_names()]) == 21
Models().to_bytes()
shipped_policy("actor-critic")
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


def test_the_command_and_nothing_that_no_library_reads_is_declared():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["scripts"] == {"andabata": "andabata.app.cli:run"}
    assert "entry-points" not in project
