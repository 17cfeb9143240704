"""State of an installation: versions, and what is broken or missing."""

from dataclasses import replace
from pathlib import Path

import pytest

from andabata.app.doctor.import_guard import Claim
from andabata.app.doctor.installation import (
    EXTRAS,
    MODULES,
    check_installation,
    installation_text,
    receive_buffer,
    version,
)
from andabata.distribution import HOME
from andabata.machine.plants import bullet_step
from tests.support.plants import needs_bullet


def test_a_package_has_a_version_or_a_reason():
    """A package without a version is here; one that cannot be imported is broken."""
    assert version("numpy").startswith("2.")
    assert version("rosbags") == "here"
    assert version("no_such_package").startswith("broken: No module named")


@needs_bullet
def test_pybullet_is_imported_in_silence(capfd):
    """The check prints nothing."""
    assert not version("pybullet").startswith("broken")
    assert capfd.readouterr() == ("", "")


def test_one_broken_package_breaks_the_installation(monkeypatch):
    """The text names the broken package and the command for system libraries."""
    monkeypatch.setattr("andabata.app.doctor.installation.MODULES", ("numpy", "no_such_package"))
    found = check_installation()
    assert found["ok"] is False
    assert "apt-get install" in installation_text(found)


@pytest.mark.parametrize("published", [True, False])
def test_without_bullet_the_plant_is_named(monkeypatch, published):
    """A newer Python is whole without pybullet; the text has the plant and what brings bullet."""
    monkeypatch.setattr("andabata.machine.plants.find_spec", lambda name: None)
    monkeypatch.setattr("andabata.app.doctor.installation.is_published", lambda: published)
    monkeypatch.setattr(
        "andabata.app.doctor.installation.version",
        lambda name: "broken: no pybullet" if name == "pybullet" else "1",
    )
    found = check_installation()
    assert (found["ok"], found["plant"]) == (not published, "wheels")
    expected = "broken: no pybullet" if published else f"not installed, optional ({bullet_step()})"
    assert f"pybullet     {expected}" in installation_text(found).splitlines()
    assert "plant of a robot without another one: wheels" in installation_text(found)


def test_every_package_has_its_line():
    """Packages and extras are listed, with the way to install an extra that is missing."""
    found = check_installation()
    assert (found["ok"], set(found["modules"])) == (True, set(MODULES))
    text = installation_text(found | {"extras": dict.fromkeys(EXTRAS, False)})
    lines = text.splitlines()
    assert "onnx         not installed, optional (pip install -e '.[onnx]')" in lines
    assert "rospy        not installed, optional (make ros)" in lines
    assert "apt-get" not in text


def test_every_extra_is_one_of_the_projects():
    """The line that installs a package names an extra of pyproject.toml, or what is no package."""
    import tomllib

    home = Path(__file__).resolve().parents[4]
    project = tomllib.loads((home / "pyproject.toml").read_text())["project"]
    known = {f"extra {name}" for name in project["optional-dependencies"]}
    assert set(EXTRAS.values()) <= known | {"ROS 1", "a browser"}


def test_beside_a_wheel_the_lines_are_a_wheels(monkeypatch):
    """No line needs a clone."""
    monkeypatch.setattr("andabata.distribution.is_clone", lambda: False)
    found = check_installation() | {"extras": dict.fromkeys(EXTRAS, False)}
    lines = installation_text(found).splitlines()
    assert "onnx         not installed, optional (pip install 'andabata[onnx]')" in lines
    assert not any("make " in line or "-e " in line for line in lines)


def test_another_distribution_among_our_files_breaks_the_installation(monkeypatch):
    """It is named with the next step; one that lies elsewhere is named, and breaks nothing."""
    mixed = Claim("keras-rl", "0.4.2", "rl", HOME / "rl", ("__init__.py",), (), ())
    for claim, ok in ((mixed, False), (replace(mixed, folder=Path("/elsewhere/rl")), True)):
        monkeypatch.setattr(
            "andabata.app.doctor.installation.other_claims", lambda claim=claim: [claim]
        )
        found = check_installation()
        assert found["ok"] is ok
        assert found["claims"][0]["distribution"] == "keras-rl"
        text = installation_text(found)
        assert claim.text in text.splitlines()
        assert "apt-get" not in text


def test_a_changed_file_breaks_the_installation(monkeypatch):
    """It is named with the next step."""
    file = HOME / "rl/sac.py"
    monkeypatch.setattr("andabata.app.doctor.installation.changed_files", lambda: [file])
    found = check_installation()
    assert (found["ok"], found["changed_files"]) == (False, [str(file)])
    assert found["changed_text"] in installation_text(found).splitlines()


def test_small_socket_buffers_are_said_with_their_use(tmp_path):
    """The text says who needs large ones, and the line that makes them; large ones need none."""
    file = tmp_path / "rmem_max"
    assert receive_buffer(file) is None
    file.write_text("212992\n")
    assert receive_buffer(file) == 212_992
    found = check_installation()
    small = installation_text(found | {"receive_buffer_bytes": 212_992})
    large = installation_text(found | {"receive_buffer_bytes": 1 << 26})
    other = installation_text(found | {"receive_buffer_bytes": None})
    assert "up to 212,992 bytes" in small
    assert "`sudo sysctl -w net.core.rmem_max=8388608`" in small
    assert "up to 67,108,864 bytes" in large
    assert "sysctl" not in large
    assert "rmem_max" not in other
