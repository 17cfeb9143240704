"""Fingerprints: digests of arrays, chosen by name."""

import hashlib
import json

import numpy as np

from andabata.bench.studies import fingerprint
from andabata.bench.studies.fingerprint import digest, fingerprints


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
