"""State of an installation: versions, and what is broken or missing."""

from andabata.app.installation import (
    EXTRAS,
    MODULES,
    check_installation,
    installation_text,
    version,
)


def test_a_package_has_a_version_or_a_reason():
    """A package without a version is here; one that cannot be imported is broken."""
    assert version("numpy").startswith("2.")
    assert version("rosbags") == "here"
    assert version("no_such_package").startswith("broken: No module named")


def test_pybullet_is_imported_in_silence(capfd):
    """The check prints nothing."""
    assert not version("pybullet").startswith("broken")
    assert capfd.readouterr() == ("", "")


def test_one_broken_package_breaks_the_installation(monkeypatch):
    """The text names the broken package and the command for system libraries."""
    monkeypatch.setattr("andabata.app.installation.MODULES", ("numpy", "no_such_package"))
    found = check_installation()
    assert found["ok"] is False
    assert "apt-get install" in installation_text(found)


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
    """The line that installs a package names an extra of pyproject.toml, or a target of make."""
    import tomllib
    from pathlib import Path

    home = Path(__file__).resolve().parents[3]
    project = tomllib.loads((home / "pyproject.toml").read_text())["project"]
    known = {f"extra {name}" for name in project["optional-dependencies"]}
    targets = {"make ros", "make browser"}
    assert set(EXTRAS.values()) <= known | targets
    for target in targets:
        assert f"\n{target.removeprefix('make ')}:" in (home / "Makefile").read_text()
