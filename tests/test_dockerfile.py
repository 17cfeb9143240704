"""The image installs what the documents install, with the system's packages that make installs."""

import re
import subprocess
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def joined(path):
    """Return the lines of a file, continued ones in one, without comments."""
    text = (ROOT / path).read_text().replace("\\\n", " ")
    return [" ".join(line.split()) for line in text.splitlines() if not line.startswith("#")]


@pytest.fixture(scope="module")
def instructions():
    """Instructions of the Dockerfile, in their order."""
    return [line for line in joined("Dockerfile") if line]


def test_pip_lines_are_those_of_the_documents(instructions):
    """But for the environment's folder, and pip's own cache, which an image does not need."""
    ours = [
        line.removeprefix("RUN ").replace("--no-cache-dir ", "")
        for line in instructions
        if line.startswith("RUN pip")
    ]
    page = (ROOT / "docs" / "install.md").read_text()
    documented = re.findall(r"^\.venv/bin/(pip install .*)$", page, re.MULTILINE)
    assert ours == documented
    assert len(ours) == 2


def test_system_packages_are_those_of_make(instructions):
    """Whatever open3d needs."""
    (line,) = (line for line in joined("Makefile") if line.startswith("APT_PACKAGES"))
    (run,) = (line for line in instructions if "apt-get install" in line)
    wanted = line.partition(":=")[2].split()
    assert re.search(r"--no-install-recommends (.*?) &&", run).group(1).split() == wanted


def test_python_and_version_are_the_projects(instructions):
    """The reference Python, and the wheel of this version."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    version = re.search(r"python:(\d+\.\d+)", instructions[0]).group(1)
    assert project["requires-python"].startswith(f">={version}")
    assert any(f"andabata-{project['version']}-py3" in line for line in instructions)


def test_only_what_is_copied_is_sent_to_the_builder(instructions):
    """A clone's environments and runs have gigabytes."""
    copied = {line.split()[1] for line in instructions if line.startswith("COPY")}
    kept = {line[1:] for line in (ROOT / ".dockerignore").read_text().split() if line[0] == "!"}
    assert kept == copied


def has_docker():
    """Return True if a daemon answers."""
    try:
        return subprocess.run(["docker", "info"], capture_output=True, check=False).returncode == 0
    except FileNotFoundError:
        return False


@pytest.mark.skipif(not has_docker(), reason="no docker daemon answers")
def test_the_image_drives(tmp_path):
    """Built from the wheel, it drives into a folder of the host."""
    subprocess.run(["make", "wheel"], cwd=ROOT, check=True)
    subprocess.run(["docker", "build", "-t", "andabata-test", "."], cwd=ROOT, check=True)
    volume = f"{tmp_path}:/data"
    words = ["drive", "--world", "hill", "--time-limit", "5", "--out", "run"]
    run = ["docker", "run", "--rm", "-v", volume, "andabata-test", *words]
    subprocess.run(run, check=True)
    assert (tmp_path / "run" / "drive.png").exists()
