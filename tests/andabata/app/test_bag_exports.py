"""The suffix of the output chooses the export, and options that have no meaning are refused."""

import errno
import json

import pytest

from andabata.app.bag_exports import ExportRequest
from andabata.app.cli import main
from andabata.configuration.usage import UsageError
from andabata.runs import atomic_io
from tests.support.planned_drives import record_drive
from traversability.files import read_cloud


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    """Recording of half a second."""
    return record_drive(tmp_path_factory.mktemp("exports") / "drive.mcap", 0.5)


@pytest.mark.parametrize(
    ("out", "options", "message"),
    [
        ("x.kml", {}, r"expected a folder, or a file in \.rrd, .*got .*x\.kml.*without a suffix"),
        ("x.tum", {"clouds": "las"}, "--clouds: expected with a folder only"),
        ("x", {"clouds": "vtk"}, "--clouds: expected one of ply, pcd, las, laz, got 'vtk'"),
        ("x.ply", {"datum": "1,2"}, r"--datum: expected with \.geojson only"),
        ("x.rrd", {"topics": ("/tf",)}, r"--topic: expected no topic with \.rrd, got /tf"),
    ],
)
def test_options_that_do_not_fit_are_refused(tmp_path, out, options, message):
    """Each error names the option, what was expected and what was given."""
    with pytest.raises(UsageError, match=message):
        ExportRequest(tmp_path / "drive.bag", tmp_path / out, **options).check()


def test_a_run_folder_has_places_alone(tmp_path):
    """Formats that need more are refused with the next step."""
    (tmp_path / "drive.json").write_text(json.dumps({"path": [[0, 0, 0]], "goals": []}))
    ExportRequest(tmp_path, tmp_path / "x.geojson").check()
    for name in ("x.tum", "x.rrd", "folder"):
        with pytest.raises(UsageError, match="record the drive with --record"):
            ExportRequest(tmp_path, tmp_path / name).check()


@pytest.mark.parametrize("kind", ["ply", "pcd", "las"])
def test_clouds_of_a_folder_have_the_chosen_format(drive, tmp_path, kind):
    """Every cloud is read back whole."""
    if kind == "las":
        pytest.importorskip("laspy", reason="laspy is not installed (extra `las`)")
    out = tmp_path / "out"
    words = ["--topic", "/points", "--clouds", kind, "--quiet", "--json"]
    assert main(["bag", "export", str(drive), "--out", str(out), *words]) == 0
    (file,) = out.iterdir()
    assert file.name == f"points_00000.{kind}"
    assert len(read_cloud(file)) == 1600


def test_a_full_disk_is_told_and_leaves_nothing(capsys, drive, tmp_path, monkeypatch):
    """The message asks for space; neither a file nor a rest of it remains."""

    def full(descriptor):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(atomic_io.os, "fsync", full)
    assert main(["bag", "export", str(drive), "--out", str(tmp_path / "x.tum")]) == 1
    assert "expected disk space for" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_datum_that_is_none_is_refused(capsys, drive, tmp_path):
    """Bounds are those of the geo reference."""
    words = ["--out", str(tmp_path / "x.geojson"), "--datum", "91,0"]
    assert main(["bag", "export", str(drive), *words]) == 2
    assert "--datum: expected LAT,LON" in capsys.readouterr().err
