"""``--release`` and ``--ledger``: a version, a ledger, and no option that the release chooses."""

import pytest

from andabata.app.options.release import ReleaseOptions, refuse_beside_release
from andabata.configuration.usage import UsageError
from andabata.evaluation import ledger
from andabata.evaluation.ledger import LedgerError


def test_without_a_release_nothing_judges():
    """A ledger alone is refused: it would be written by nobody."""
    assert ReleaseOptions().named() is None
    assert ReleaseOptions().run("a", "1 to 9") is None
    with pytest.raises(UsageError, match="--ledger: expected --release beside it, got none"):
        ReleaseOptions(ledger="own.jsonl").named()


@pytest.mark.parametrize("release", ["latest", "0.2", "v0.2.0"])
def test_a_release_is_a_version(release):
    """The error has the option's name and the form."""
    with pytest.raises(UsageError, match=r"^--release: expected a version .* as 0\.2\.0"):
        ReleaseOptions(release).named()


def test_a_run_has_its_place_in_the_ledger_that_is_named(tmp_path, monkeypatch):
    """Without one the run is refused with the step to take."""
    monkeypatch.setattr(ledger, "commit", lambda: "0123456789ab")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(LedgerError, match="name a ledger with --ledger FILE"):
        ReleaseOptions("0.2.0").run("a", "1 to 9")
    path = tmp_path / "own.jsonl"
    path.touch()
    run = ReleaseOptions("0.2.0", path).run("a", "1 to 9")
    assert (run.ledger, run.entry.table, run.entry.seeds) == (path, "a", "1 to 9")
    assert run.entry.release == "0.2.0"
    assert path.read_bytes() == b""  # Until it begins.


def test_what_a_release_chooses_is_refused_beside_it():
    """All that were typed are named; those that it leaves open, and other runs, are not."""
    typed = {"seed", "world", "controllers"}
    refuse_beside_release(None, typed, "seed", "world")
    refuse_beside_release("0.2.0", typed, "suite")
    with pytest.raises(UsageError, match=r"--release: expected no --seed, --world beside it"):
        refuse_beside_release("0.2.0", typed, "seed", "world", "suite")
