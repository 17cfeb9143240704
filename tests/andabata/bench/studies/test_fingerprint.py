"""Fingerprints: digests of arrays, chosen by name."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

from andabata.bench.studies import fingerprint
from andabata.bench.studies.fingerprint import EVALUATIONS, digest, fingerprints
from andabata.evaluation.barn import FIRST_JUDGING
from tests.support.documents import complaint
from worlds.splits import DEVELOPMENT_SEEDS


def test_a_digest_is_of_the_bytes_in_their_order():
    """Layout in memory does not count, order and type do."""
    one, two = np.arange(6.0).reshape(2, 3), np.arange(3)
    assert digest([one, two]) == hashlib.sha256(one.tobytes() + two.tobytes()).hexdigest()
    assert digest([np.asfortranarray(one)]) == digest([one])
    assert digest([two, one]) != digest([one, two])
    assert digest([one.astype(np.float32)]) != digest([one])


def test_fingerprints_are_chosen_by_part_of_their_name(monkeypatch):
    """Only what is asked for is run."""
    monkeypatch.delenv("ANDABATA_REAL_DATA", raising=False)
    monkeypatch.setattr(fingerprint, "drive", lambda folder, plant: plant.upper())
    assert list(fingerprints("drive")) == [
        ("drive kinematic", "KINEMATIC"),
        ("drive bullet", "BULLET"),
        ("drive wheels", "WHEELS"),
    ]
    assert list(fingerprints("scan")) == []


def test_scans_are_of_states_and_ranges_alone(monkeypatch, capsys):
    """Other keys of the command's result do not change a fingerprint."""
    monkeypatch.setenv("ANDABATA_REAL_DATA", "/data")
    texts = []

    def run(*words):
        texts.append(words)
        return json.dumps({"cell_states": [[0]], "ranges": [1.0], "points": len(texts)})

    monkeypatch.setattr(fingerprint, "run_command", run)
    fingerprint.main(["--only", "scan"])
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == len(fingerprint.REAL_CLOUDS) == len(texts)
    wanted = hashlib.sha256(json.dumps([[1.0], [[0]]]).encode()).hexdigest()
    assert {line.split()[-1] for line in lines} == {wanted}


def test_evaluations_are_of_rows_and_of_what_was_driven(monkeypatch):
    """Commit and settings in the journal's heading do not change a fingerprint; a drive does."""

    def digest_of(journal):
        def run(*words):
            folder = Path(words[words.index("--out") + 1])
            folder.mkdir()
            (folder / "cells.jsonl").write_text(journal)
            return json.dumps({"rows": [{"successes": 1}], "config": journal})

        monkeypatch.setattr(fingerprint, "run_command", run)
        ((name, found),) = fingerprints("BARN skid")
        assert name == "BARN skid"
        return found

    wanted = hashlib.sha256(b'[{"successes": 1}]1').hexdigest()
    assert digest_of("a\n1\n") == digest_of("b\n1\n") == wanted
    assert digest_of("a\n2\n") != wanted


@pytest.mark.parametrize("name", EVALUATIONS)
def test_evaluations_judge_nothing(name):
    """Rooms are those of development seeds, fields are outside of those that judge."""
    words = EVALUATIONS[name]
    assert complaint(f"andabata evaluate {' '.join(words)}") is None
    if "barn" in words:
        (seed,) = [word.partition("=")[2] for word in words if word.startswith("first_seed=")]
        assert int(seed) >= 2 * FIRST_JUDGING
    else:
        rooms = words[words.index("--rooms") + 1].split(",")
        assert {int(room.rpartition("-")[2]) for room in rooms} <= set(DEVELOPMENT_SEEDS)
