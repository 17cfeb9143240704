"""Import guard: the generic names are ours, and every seed has one purpose."""

import base64
import hashlib
import importlib.util
from types import SimpleNamespace

import pytest

from andabata.app.doctor.import_guard import (
    PackageOriginError,
    changed_files,
    changed_text,
    check_origins,
    other_claims,
)
from andabata.distribution import install_again
from worlds.splits import TRAINING_SEEDS, dataset_world, evaluation_world


def test_the_packages_are_beside_each_other():
    """All five packages come from one place."""
    assert set(check_origins()) == {"andabata", "terrain", "worlds", "traversability", "rl"}


def test_another_distribution_of_a_name_is_refused(monkeypatch):
    """A sibling package from elsewhere is an error."""
    monkeypatch.setattr(
        "andabata.app.doctor.import_guard.find_spec",
        lambda name: SimpleNamespace(origin=f"/elsewhere/{name}/__init__.py"),
    )
    with pytest.raises(PackageOriginError, match="package terrain: expected"):
        check_origins()
    assert importlib.util.find_spec("terrain").origin.endswith("terrain/__init__.py")


def install(site, name, files):
    """Install a distribution as pip does: its files, and their record."""
    about = site / f"{name.replace('-', '_')}-0.4.2.dist-info"
    about.mkdir(parents=True)
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 0.4.2\n")
    rows = []
    for file, text in files.items():
        (site / file).parent.mkdir(parents=True, exist_ok=True)
        (site / file).write_text(text)
        digest = base64.urlsafe_b64encode(hashlib.sha256(text.encode()).digest())
        rows.append(f"{file},sha256={digest.rstrip(b'=').decode()},{len(text)}")
    (about / "RECORD").write_text("\n".join(rows))


OURS = {"rl/__init__.py": "ours", "rl/sac.py": "ours", "andabata/__init__.py": ""}
THEIRS = {"rl/__init__.py": "theirs", "rl/core.py": "theirs", "notes/rl.py": ""}


@pytest.mark.parametrize("order", ["before", "after"])
def test_another_distribution_among_our_files_is_found(tmp_path, monkeypatch, order):
    """Installed before us it has lost its files to us; installed after us we have lost ours."""
    first, second = ("keras-rl", THEIRS), ("andabata", OURS)
    for name, files in (first, second) if order == "before" else (second, first):
        install(tmp_path, name, files)
    install(tmp_path, "other", {"other/terrain.py": "", "rl-notes.txt": ""})
    monkeypatch.setattr("andabata.app.doctor.import_guard.HOME", tmp_path)
    (claim,) = other_claims([str(tmp_path)])
    assert (claim.distribution, claim.version, claim.package) == ("keras-rl", "0.4.2", "rl")
    assert set(claim.files) == {"__init__.py", "core.py"}
    assert claim.shared == ("__init__.py",)
    assert claim.overwritten == (("__init__.py",) if order == "after" else ())
    assert claim.is_mixed
    assert ("rl/__init__.py in place of ours" in claim.text) == (order == "after")
    assert "`pip uninstall keras-rl`, then `pip install --force-reinstall" in claim.text


def test_a_distribution_in_another_folder_needs_no_new_installation(tmp_path):
    """Its files are not among ours, those of a clone."""
    install(tmp_path, "keras-rl", THEIRS)
    (claim,) = other_claims([str(tmp_path)])
    assert not claim.is_mixed
    assert claim.folder == tmp_path / "rl"
    assert claim.text == (
        f"package rl: keras-rl 0.4.2 has files of it in {tmp_path}/rl; `pip uninstall keras-rl`, "
        "or keep the two in different virtual environments"
    )
    assert claim.as_dict()["shared"] == []


def test_files_that_are_gone_or_changed_are_told_when_nobody_claims_them(tmp_path):
    """What a claim tells is not told again; what pip did not record as ours is no matter."""
    names = [f"rl/{letter}.py" for letter in "abcde"]
    install(tmp_path, "andabata", dict.fromkeys(names, "ours") | {"bin/andabata": ""})
    site = [str(tmp_path)]
    assert (changed_files(site), changed_text([], [])) == ([], None)
    install(tmp_path, "keras-rl", {"rl/a.py": "theirs"})
    (tmp_path / "rl/b.py").unlink()
    (tmp_path / "bin/andabata").unlink()
    changed = changed_files(site)
    assert changed == [tmp_path / "rl/a.py", tmp_path / "rl/b.py"]
    text = changed_text(changed, other_claims(site))
    assert text.startswith("files: expected them as they were installed, got others or none: ")
    assert f": {tmp_path}/rl/b.py; `pip install --force-reinstall --no-deps " in text
    assert changed_text(changed[:1], other_claims(site)) is None
    for name in names:
        (tmp_path / name).write_text("other")
    assert f"rl/c.py and 2 more; `{install_again()}`" in changed_text(changed_files(site), [])


def test_an_origin_elsewhere_names_its_distribution(tmp_path, monkeypatch):
    """The error says whose the package is, and what to do."""
    install(tmp_path, "keras-rl", THEIRS | {"terrain/__init__.py": ""})
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(
        "andabata.app.doctor.import_guard.find_spec",
        lambda name: SimpleNamespace(origin=str(tmp_path / name / "__init__.py")),
    )
    with pytest.raises(
        PackageOriginError, match=r"package terrain: .*keras-rl 0\.4\.2: `pip uninstall"
    ):
        check_origins()


def test_no_world_serves_two_purposes():
    """Seeds of training, evaluation and data sets never meet."""
    training = set(TRAINING_SEEDS)
    evaluation = {evaluation_world(seed, trial) for seed in (0, 1, 9999) for trial in (0, 9999)}
    clouds = {dataset_world(seed, number) for seed in (0, 1, 50) for number in (0, 99_999)}
    assert max(training) < min(evaluation) <= max(evaluation) < min(clouds)


@pytest.mark.parametrize(("seed", "trial"), [(-1, 0), (10_000, 0), (0, 10_000)])
def test_seeds_that_would_reach_others_are_refused(seed, trial):
    """A seed or trial outside its range is an error."""
    with pytest.raises(ValueError, match="expected 0 to 9999"):
        evaluation_world(seed, trial)
