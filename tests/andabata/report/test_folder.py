"""Run folders that are incomplete, damaged or of another version: errors with their next step."""

import json

import pytest

from andabata.app.cli import main
from andabata.evaluation.barn import BarnEvaluationConfig
from andabata.report.folder import (
    RunFolderError,
    check_keys,
    read_about,
    read_result,
    read_rows,
    settings_of,
)
from andabata.runs.journal import Journal
from tests.support.report_folders import written_drive, written_evaluation


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    """Return the folder of a drive."""
    return written_drive(tmp_path_factory.mktemp("runs") / "drive")


def refused(capsys, *folders):
    """Return the error of a report."""
    assert main(["report", *map(str, folders), "--quiet"]) == 1
    printed = capsys.readouterr()
    assert (printed.out, printed.err.count("\n")) == ("", 1)
    return printed.err


def copied(folder, path, **changes):
    """Return a copy of a folder's description in another folder, with changes."""
    path.mkdir()
    about = json.loads((folder / "run.json").read_text()) | changes
    (path / "run.json").write_text(json.dumps(about))
    return path


def test_a_missing_folder_and_one_without_a_run_are_told_apart(capsys, tmp_path):
    """The first is a wrong name, the second an unfinished run."""
    assert "expected a run folder, got no such folder" in refused(capsys, tmp_path / "none")
    assert "run its command again with the same --out" in refused(capsys, tmp_path)


def test_a_damaged_description_is_named(capsys, tmp_path):
    """Half a file, one that is nested too deep, and one that holds no object."""
    (tmp_path / "run.json").write_text("[" * 100_000)
    assert "run.json: expected JSON, got a damaged file" in refused(capsys, tmp_path)
    (tmp_path / "run.json").write_text('{"verb": "dri')
    assert "run.json: expected JSON, got a damaged file" in refused(capsys, tmp_path)
    (tmp_path / "run.json").write_text("[1]")
    assert "expected a JSON object, got list" in refused(capsys, tmp_path)


def test_an_unfinished_run_says_how_to_finish_it(capsys, drive, tmp_path):
    """Without its result the command has to run again."""
    error = refused(capsys, copied(drive, tmp_path / "half"))
    assert "drive.json: No such file: expected the result of a finished run" in error


def test_a_run_of_another_version_names_both(capsys, drive, tmp_path):
    """A result without a key that the report needs."""
    folder = copied(drive, tmp_path / "old", versions={"andabata": "0.0.7"}, commit="abc")
    (folder / "drive.json").write_text(json.dumps({"controller": "x"}))
    error = refused(capsys, folder)
    assert "drive.json: expected world, got none" in error
    assert "a run of andabata 0.0.7 at commit abc, this is andabata" in error
    assert "make it again, or report it with its version" in error


def test_settings_of_another_version_are_refused(capsys, drive, tmp_path):
    """The field is named, and both versions."""
    folder = copied(drive, tmp_path / "old", versions={"andabata": "0.0.7"})
    with pytest.raises(RunFolderError, match=r"speed: expected a known field.*andabata 0\.0\.7"):
        settings_of(BarnEvaluationConfig, {"speed": 1}, folder)
    assert settings_of(BarnEvaluationConfig, {"count": 3}, folder).count == 3


def test_rows_survive_a_kill_in_the_last_line_alone(tmp_path):
    """The last line may be cut short; a damaged one before is an error with its number."""
    path = tmp_path / "rows.jsonl"
    path.write_text('{"a": 1}\n{"a": 2}\n{"a"')
    assert read_rows(path) == [{"a": 1}, {"a": 2}]
    path.write_text('{"a": 1}\n{"a"\n{"a": 2}\n')
    with pytest.raises(RunFolderError, match="line 2: expected JSON"):
        read_rows(path)
    with pytest.raises(RunFolderError, match="expected the rows of a run, got none"):
        read_rows(tmp_path / "none.jsonl")


@pytest.mark.parametrize("change", [(b"12.5", b"92.5"), (b"soft", b"s\xffft")])
def test_a_changed_row_of_a_journal_is_no_result(tmp_path, change):
    """Rows come without the checksums of their lines; one that does not fit its own is refused."""
    path, entry = tmp_path / "rows.jsonl", {"time": 12.5, "ground": "soft"}
    Journal(path, {"seed": 1}).append(entry)
    assert read_rows(path) == [{"seed": 1}, entry]
    path.write_bytes(path.read_bytes().replace(*change))
    with pytest.raises(RunFolderError, match=r"rows\.jsonl: line 2: .*delete the line"):
        read_rows(path)


def test_clouds_of_earlier_versions_have_a_manifest_alone(tmp_path):
    """It says seed and settings."""
    (tmp_path / "manifest.json").write_text('{"seed": 3, "config": {"a": 1}}')
    about = read_about(tmp_path)
    assert about == {"verb": "clouds generate", "seed": 3, "config": {"a": 1}}


def test_keys_that_are_there_pass(tmp_path):
    """Nothing is raised, whatever else a row holds."""
    check_keys({"a": 1, "b": 2}, ("a",), "row", tmp_path)
    (tmp_path / "r.json").write_text('{"a": 1}')
    assert read_result(tmp_path, "r.json", ("a",)) == {"a": 1}


def test_runs_of_two_worlds_are_not_compared(capsys, drive, tmp_path):
    """Drives in one figure share their world."""
    other = written_drive(tmp_path / "other", "reactive")
    data = json.loads((other / "drive.json").read_text()) | {"world_seed": 8}
    (other / "drive.json").write_text(json.dumps(data))
    error = refused(capsys, drive, other)
    assert "expected a drive in maze 7 as the first, got maze 8" in error


def test_an_evaluation_of_an_older_version_is_refused(capsys, tmp_path):
    """Rows without a column that the page shows."""
    folder = written_evaluation(tmp_path / "old")
    data = json.loads((folder / "evaluation.json").read_text())
    for row in data["rows"]:
        del row["spl"]
    (folder / "evaluation.json").write_text(json.dumps(data))
    assert "evaluation.json: expected spl, got none" in refused(capsys, folder)
