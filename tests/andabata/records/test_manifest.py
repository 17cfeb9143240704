"""The manifest beside a recording: written with it, and compared where damage is looked for."""

import hashlib
import json

import pytest

from andabata.app.cli import main
from andabata.records.bags import Bag
from andabata.records.manifest import changed_files, write_manifest
from andabata.records.salvage import salvage
from andabata.records.summary import summarise
from tests.support.recordings import write_bag, write_db3


def test_the_manifest_holds_checksums_and_facts(tmp_path):
    """The manifest holds the SHA-256 of a file, or of each file of a folder."""
    file, folder = tmp_path / "x.mcap", tmp_path / "x.db3"
    file.write_bytes(b"one")
    folder.mkdir()
    (folder / "metadata.yaml").write_bytes(b"two")
    for path, name, data in ((file, "x.mcap", b"one"), (folder, "metadata.yaml", b"two")):
        manifest = write_manifest(path, {"seed": 3})
        assert manifest == path.with_name(f"{path.name}.json")
        sums = {name: hashlib.sha256(data).hexdigest()}
        assert json.loads(manifest.read_text()) == {"sha256": sums, "seed": 3}


def recording(folder, kind):
    """Return a recording with its manifest, and the file that holds its messages."""
    path = folder / f"x.{kind}"
    if kind == "bag":
        write_bag(path)
        write_manifest(path, {})
        return path, path
    path.mkdir()
    write_db3(path / "x.db3")
    write_manifest(path, {})
    return path, path / "x.db3"


def flip(file, text):
    """Change a bit of a message, which neither format has a checksum for."""
    data = bytearray(file.read_bytes())
    data[data.index(text) + len(text) - 1] ^= 1
    file.write_bytes(data)


@pytest.mark.parametrize("kind", ["bag", "db3"])
def test_a_changed_payload_is_noticed(tmp_path, capsys, kind):
    """Info, salvage and export end with 3 and name the file; without the change with 0."""
    path, file = recording(tmp_path, kind)
    whole = salvage(path, tmp_path / f"whole.{kind}")
    assert not whole.lost
    assert not summarise(path).damaged
    assert main(["bag", "export", str(path), "--out", str(tmp_path / "whole")]) == 0
    flip(file, b"note 3")
    found = summarise(path)
    assert found.damaged
    assert f"expected {file.name} with the SHA-256 in x.{kind}.json" in found.left_out[0].reason
    kept = salvage(path, tmp_path / f"kept.{kind}")
    assert (kept.lost, kept.lost_messages) == (True, None)
    assert "messages may be wrong" in kept.reason
    capsys.readouterr()
    assert main(["bag", "info", str(path)]) == 3
    assert main(["bag", "export", str(path), "--out", str(tmp_path / "out")]) == 3
    assert "damage: 0 messages left out: expected" in capsys.readouterr().out
    with Bag(path) as bag:  # Reading itself takes no second pass over the file.
        assert len(list(bag.messages())) == 10


@pytest.mark.parametrize("text", [b"{", b"[1]", b'{"sha256": 3}', b"[" * 100_000])
def test_a_foreign_or_damaged_manifest_ends_nothing(tmp_path, text):
    """What is no manifest is no proof of damage, unless it cannot be read."""
    path, _ = recording(tmp_path, "bag")
    (tmp_path / "x.bag.json").write_bytes(text)
    damaged = text != b"[1]"
    assert bool(changed_files(path)) == damaged
    (tmp_path / "x.bag.json").unlink()
    assert changed_files(path) == ""


def test_a_missing_file_is_a_change(tmp_path):
    """A file of a folder that the manifest names has to be there."""
    path, file = recording(tmp_path, "db3")
    assert changed_files(path) == ""
    file.rename(path / "y.db3")
    assert "expected x.db3 with the SHA-256" in changed_files(path)
