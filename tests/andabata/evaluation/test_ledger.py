"""Ledger: each table judges a release once, an interrupted run goes on in its folder alone."""

import pytest

from andabata.configuration.usage import UsageError
from andabata.evaluation import ledger
from andabata.evaluation.ledger import (
    JudgingRun,
    LedgerEntry,
    LedgerError,
    find_ledger,
    ledger_rows,
    read_ledger,
    write_ledger,
)
from andabata.runs.folder import LEDGER
from tests.support.documents import ROOT

ENTRY = LedgerEntry(
    table="a",
    split="development",
    seeds="worlds 1 to 9",
    date="2026-11-27",
    commit="abc",
    command="andabata evaluate",
    page="evaluation.md",
)


@pytest.fixture
def path(tmp_path, monkeypatch):
    """Return the path of a ledger of one entry, and commit the code."""
    monkeypatch.setattr(ledger, "commit", lambda: "0123456789ab")
    write_ledger(tmp_path / "ledger.jsonl", [ENTRY])
    return tmp_path / "ledger.jsonl"


def folder_in(tmp_path, name):
    """Return a new folder of a run."""
    (tmp_path / name).mkdir()
    return tmp_path / name


def run(path, release="0.2.0", table="a", seeds="worlds 500 to 699"):
    """Return a judging run of this process."""
    return JudgingRun.of(table, release, seeds, path)


def test_entries_are_read_as_they_were_written(path):
    """A line each; defaults are left out."""
    begun = run(path).entry
    write_ledger(path, [ENTRY, begun])
    assert read_ledger(path) == [ENTRY, begun]
    assert path.read_bytes().count(b"\n") == 2
    assert b"remark" not in path.read_bytes()


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ('{"table": "a"', "expected an entry of the ledger, got"),
        ('{"table": "a"}', "split: field required"),
        ('{"colour": 1}', "line 3: expected an entry"),
    ],
)
def test_a_damaged_ledger_is_refused_with_its_line(path, line, message):
    """The error names file, line and step; nothing is judged by a ledger that cannot be read."""
    path.write_text(f"{path.read_text()}\n{line}\n")
    with pytest.raises(LedgerError, match=message) as error:
        run(path).begin()
    assert "line 3" in str(error.value)
    assert "restore the line" in str(error.value)
    assert "\n" not in str(error.value)


def test_an_entry_stands_before_the_first_drive_and_is_finished_after(path, tmp_path):
    """It has table, seeds, release, commit, command and day; others stay as they are."""
    begun = run(path).begin(folder_in(tmp_path, "run"))
    first, entry = read_ledger(path)
    assert (first, entry) == (ENTRY, begun.entry)
    assert (entry.state, entry.split, entry.release) == ("begun", "judging", "0.2.0")
    assert (entry.seeds, entry.commit) == ("worlds 500 to 699", "0123456789ab")
    assert len(entry.date) == len("2026-11-27")
    assert entry.command
    done = begun.finish()
    assert read_ledger(path) == [ENTRY, done]
    assert done == entry.model_copy(update={"state": "finished"})


def test_a_run_goes_on_in_its_folder_alone(path, tmp_path):
    """With the same seeds and commit; another folder, other trials or other code are refused."""
    mine, other = folder_in(tmp_path, "mine"), folder_in(tmp_path, "other")
    begun = run(path).begin(mine)
    (mine / "trials.jsonl").write_text("half a run\n")
    assert run(path).begin(mine).entry == begun.entry
    assert len(read_ledger(path)) == 2
    for again, folder in (
        (run(path), other),
        (run(path), None if begun.entry.state == "finished" else other),
        (run(path, seeds="worlds 500 to 999"), mine),
    ):
        with pytest.raises(LedgerError, match="expected a release that a has not judged") as error:
            again.begin(folder)
        assert "go on with the same command at the same commit" in str(error.value)


def test_other_code_does_not_go_on(path, tmp_path, monkeypatch):
    """What is judged is one commit."""
    mine = folder_in(tmp_path, "mine")
    run(path).begin(mine)
    monkeypatch.setattr(ledger, "commit", lambda: "ba9876543210")
    with pytest.raises(LedgerError, match=r"judged on .* at 0123456789ab"):
        run(path).begin(mine)


def test_a_release_is_judged_once_by_each_table(path, tmp_path):
    """A second run is refused; another table and the next release are not."""
    mine = folder_in(tmp_path, "mine")
    run(path).begin(mine).finish()
    with pytest.raises(LedgerError, match="judge the next release"):
        run(path).begin(folder_in(tmp_path, "other"))
    with pytest.raises(LedgerError, match="judge the next release"):
        run(path).begin()
    run(path, table="b").begin()
    run(path, release="0.2.1").begin()
    assert run(path).begin(mine).entry.state == "finished"  # Its table is shown again.


def test_without_a_folder_an_interrupted_run_may_begin_again(path):
    """Its figures are seen at its end alone; then it is done."""
    first = run(path).begin().entry
    again = run(path).begin()
    assert again.entry == first
    assert again.finish().state == "finished"
    assert len(read_ledger(path)) == 2
    with pytest.raises(LedgerError, match="judge the next release"):
        run(path).begin()


def test_a_judging_run_begins_in_an_empty_folder(path, tmp_path):
    """The journal of another run would be refused after the seeds are used up."""
    used = folder_in(tmp_path, "used")
    (used / "trials.jsonl").write_text("{}\n")
    with pytest.raises(UsageError, match=r"--out: expected a new or empty folder .* trials.jsonl"):
        run(path).begin(used)
    assert read_ledger(path) == [ENTRY]


def test_code_with_changes_judges_nothing(path, monkeypatch):
    """The ledger says which commit was judged; an installed package says its version."""
    monkeypatch.setattr(ledger, "commit", lambda: "0123456789ab+")
    with pytest.raises(UsageError, match="expected committed code, got changes after commit 0123"):
        run(path)
    monkeypatch.setattr(ledger, "commit", lambda: None)
    assert run(path).entry.commit.startswith("version ")


def test_the_ledger_of_the_checkout_is_found_from_any_folder_in_it(tmp_path):
    """A given one has to exist, and without any the error says what to do."""
    inside = tmp_path / "data/runs"
    inside.mkdir(parents=True)
    with pytest.raises(LedgerError, match=r"run it in a checkout .*, or name a ledger with --led"):
        find_ledger(None, inside)
    (tmp_path / LEDGER).parent.mkdir(parents=True)
    (tmp_path / LEDGER).touch()
    assert find_ledger(None, inside) == find_ledger(None, tmp_path) == tmp_path / LEDGER
    own = tmp_path / "own.jsonl"
    with pytest.raises(LedgerError, match=r"--ledger: expected a file .* begin one of your own"):
        find_ledger(own)
    own.touch()
    assert find_ledger(own, inside) == own
    assert read_ledger(own) == []


def test_rows_of_the_table_have_the_latest_first(path):
    """A page is linked, a run without its table says so."""
    begun = run(path).entry
    late, early = ledger_rows([ENTRY, begun])
    assert (late["release"], late["remark"]) == ("0.2.0", "begun, not finished")
    assert (early["table"], early["release"], early["remark"]) == ("[a](evaluation.md)", "", "")
    assert early["command"] == "`andabata evaluate`"


def test_the_repositorys_ledger_judges_each_release_once_by_a_table():
    """It is whole, its pages exist, and what is not judging has no release."""
    entries = read_ledger(ROOT / LEDGER)
    judged = [(each.table, each.release) for each in entries if each.split == "judging"]
    assert len(judged) == len(set(judged))
    assert all(release for _, release in judged)
    assert entries
    for each in entries:
        assert (each.release is None) == (each.split != "judging")
        assert (
            each.page is None or (ROOT / LEDGER).parent.joinpath(each.page.split("#")[0]).is_file()
        )
