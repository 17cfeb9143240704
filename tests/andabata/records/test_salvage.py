"""Salvaged recordings are read by the reference readers and lack no whole message."""

import json
import os
import struct
import subprocess
from pathlib import Path

import pytest
import zstandard
from mcap.reader import make_reader

from andabata.app.cli import main
from andabata.records.bags import Bag, BagError
from andabata.records.salvage import salvage
from tests.support.recordings import (
    bag_record,
    mcap_records,
    stamp,
    write_bag,
    write_db3,
    write_mcap,
)

DEBIAN_PYTHON = "/usr/bin/python3"


def has_rosbag():
    """Return True if Debian's rosbag package is installed."""
    if not Path(DEBIAN_PYTHON).exists():
        return False
    words = [DEBIAN_PYTHON, "-c", "import rosbag"]
    return subprocess.run(words, capture_output=True, check=False).returncode == 0


def by_rosbags(path):
    """Return connection, time and bytes of each message, as rosbags reads them."""
    from rosbags.rosbag1 import Reader

    with Reader(path) as reader:
        return [
            (c.topic, c.msgtype, c.digest, c.msgdef.data, c.ext, stamp, bytes(data))
            for c, stamp, data in reader.messages()
        ]


def by_mcap(path):
    """Return everything that the mcap package reads of a file, checksums looked at."""
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        header, summary = reader.get_header(), reader.get_summary()
        messages = [
            (schema, channel, message) for schema, channel, message in reader.iter_messages()
        ]
        attachments, metadata = list(reader.iter_attachments()), list(reader.iter_metadata())
    return header, summary.statistics, messages, attachments, metadata


@pytest.mark.parametrize("compression", [None, "bz2", "lz4"])
def test_a_whole_bag_with_two_publishers_is_the_same_to_rosbags(tmp_path, compression):
    """Salvage of an undamaged bag keeps every message and publisher for rosbags."""
    path = write_bag(tmp_path / "two.bag", 40, compression=compression, chunk=300)
    found = salvage(path, tmp_path / "kept.bag")
    assert (found.messages, found.lost, found.lost_messages) == (40, False, 0)
    kept = by_rosbags(tmp_path / "kept.bag")
    assert kept == by_rosbags(path)
    assert {each[4].callerid for each in kept} == {"/node0", "/node1"}
    assert {each[4].latching for each in kept} == {1}


def test_equal_connections_stay_separate(tmp_path):
    """Two equal connections remain two."""
    # Bags merged by some tools hold equal connections, which rosbags refuses to write.
    path = write_bag(tmp_path / "two.bag")
    data = path.read_bytes().replace(b"callerid=/node1", b"callerid=/node0")
    path.write_bytes(data)
    assert salvage(path, tmp_path / "kept.bag").messages == 10
    with Bag(tmp_path / "kept.bag") as bag:
        assert [c.publisher for c in bag.connections] == ["/node0", "/node0"]
        assert [m.content.data for m in bag.messages()] == [f"note {k}" for k in range(10)]


@pytest.mark.skipif(not has_rosbag(), reason="Debian's python3-rosbag is not installed")
def test_a_salvaged_bag_is_read_by_the_reference_rosbag(tmp_path):
    """ROS's rosbag reads a salvaged bag with its publishers."""
    path = write_bag(tmp_path / "two.bag", 40, compression="bz2", chunk=300)
    data = bytearray(path.read_bytes())
    begin, end = bag_record(data, 5, skip=1)
    data[(begin + end) // 2] ^= 1
    path.write_bytes(data)
    kept = salvage(path, tmp_path / "kept.bag").messages
    code = (
        "import json, rosbag, sys\n"
        "bag = rosbag.Bag(sys.argv[1])\n"
        "rows = [(t, m.data, s.to_nsec()) for t, m, s in bag.read_messages()]\n"
        "names = ('callerid', 'latching')\n"
        "own = [[c.header[name].decode() for name in names] for c in bag._get_connections()]\n"
        "print(json.dumps([rows, own]))"
    )
    words = [DEBIAN_PYTHON, "-c", code, str(tmp_path / "kept.bag")]
    rows, own = json.loads(subprocess.run(words, capture_output=True, check=True).stdout)
    assert len(rows) == kept > 30
    assert sorted(own) == [["/node0", "1"], ["/node1", "1"]]
    assert rows[-1] == ["/notes", "note 39", stamp(39)]


@pytest.mark.parametrize("compression", [None, "bz2", "lz4"])
def test_behind_a_damaged_chunk_of_a_bag_everything_is_kept(tmp_path, compression):
    """All chunks after a damaged one are kept, in their compression, and losses are counted."""
    path = write_bag(tmp_path / "x.bag", 400, compression=compression, chunk=3000)
    data = bytearray(path.read_bytes())
    begin, end = bag_record(data, 5, skip=1)
    middle = (begin + end) // 2
    data[middle : middle + 60] = b"\xff" * 60
    path.write_bytes(data)
    found = salvage(path, tmp_path / "kept.bag")
    assert found.lost
    assert found.lost_messages == 400 - found.messages
    assert 300 < found.messages < 400
    kept = by_rosbags(tmp_path / "kept.bag")
    assert len(kept) == found.messages
    assert set(kept) <= set(by_rosbags(write_bag(tmp_path / "y.bag", 400)))
    assert kept[-1][5] == stamp(399)
    packed = {b"bz2": "bz2", b"lz4": "lz4"}
    kinds = {name for word, name in packed.items() if b"compression=" + word in data}
    salvaged = (tmp_path / "kept.bag").read_bytes()
    assert {n for w, n in packed.items() if b"compression=" + w in salvaged} == kinds


def test_a_killed_bag_gets_its_index(tmp_path):
    """An unfinished bag is salvaged completely, with an index."""
    data = bytearray(write_bag(tmp_path / "x.bag", chunk=100).read_bytes())
    place = data.index(b"index_pos=") + 10
    data[place : place + 8] = bytes(8)
    path = tmp_path / "x.bag.active"
    path.write_bytes(data[: bag_record(data, 7)[0]])
    found = salvage(path, tmp_path / "kept.bag")
    assert (found.messages, found.lost) == (10, False)
    assert "no index" in found.notes[0]
    assert by_rosbags(tmp_path / "kept.bag") == by_rosbags(tmp_path / "x.bag")


def test_a_connection_whose_record_is_lost_is_taken_from_the_index(tmp_path):
    """The index replaces a connection record that a damaged chunk held."""
    data = bytearray(write_bag(tmp_path / "x.bag", 40, chunk=300).read_bytes())
    begin, end = bag_record(data, 5)
    data[begin:end] = b"\xff" * (end - begin)
    path = tmp_path / "bad.bag"
    path.write_bytes(data)
    found = salvage(path, tmp_path / "kept.bag")
    assert found.lost_messages == 40 - found.messages
    assert len(by_rosbags(tmp_path / "kept.bag")) == found.messages > 30


@pytest.mark.parametrize("compression", ["none", "lz4", "zstd"])
@pytest.mark.parametrize("options", [{"chunk": 200}, {"use_chunking": False}])
@pytest.mark.parametrize("ros", [1, 2])
def test_a_whole_mcap_file_is_the_same_to_mcap(tmp_path, compression, options, ros):
    """Salvage of an undamaged MCAP file gives the mcap package the same contents."""
    path = write_mcap(tmp_path / "x.mcap", 40, compression=compression, ros=ros, **options)
    found = salvage(path, tmp_path / "kept.mcap")
    assert (found.messages, found.lost, found.lost_messages) == (40, False, 0)
    before, after = by_mcap(path), by_mcap(tmp_path / "kept.mcap")
    assert after == before
    assert after[0].profile == f"ros{ros}"
    assert after[0].library == "library of a writer"
    assert after[2][0][1].metadata == {"callerid": "/node0"}
    kinds = {b"zstd", b"lz4"}
    packed = {kind for kind in kinds if kind in path.read_bytes()}
    assert {kind for kind in kinds if kind in (tmp_path / "kept.mcap").read_bytes()} == packed


@pytest.mark.parametrize("compression", ["none", "lz4", "zstd"])
def test_behind_a_damaged_chunk_of_mcap_everything_is_kept(tmp_path, compression):
    """All chunks after a damaged one are kept; channels come from the summary."""
    path = write_mcap(tmp_path / "x.mcap", 400, compression=compression, chunk=2000)
    whole = by_mcap(path)
    data = bytearray(path.read_bytes())
    _, end = next(each[1:] for each in mcap_records(data) if each[0] == 6)
    data[end - 30 : end - 10] = b"\xff" * 20
    path.write_bytes(data)
    found = salvage(path, tmp_path / "kept.mcap")
    assert found.lost
    assert found.lost_messages == 400 - found.messages
    assert 250 < found.messages < 400
    # The channels' own records were in the damaged chunk; the summary has copies.
    kept = by_mcap(tmp_path / "kept.mcap")
    assert kept[1].message_count == len(kept[2]) == found.messages
    assert kept[2] == whole[2][-found.messages :]
    assert kept[3:] == whole[3:]


def test_records_of_applications_and_unknown_channels_do_not_stop_a_salvage(tmp_path):
    """Private records are copied; messages of unknown channels are counted as lost."""
    path = write_mcap(tmp_path / "x.mcap", 10, repeat_channels=False, use_chunking=False)
    data = path.read_bytes()
    begin, end = [each[1:] for each in mcap_records(data) if each[0] == 4][1]
    private = b"\x80" + struct.pack("<Q", 5) + b"hello"
    path.write_bytes(data[:begin] + private + data[end:])
    found = salvage(path, tmp_path / "kept.mcap")
    assert (found.messages, found.lost, found.lost_messages) == (5, True, 5)
    assert private in (tmp_path / "kept.mcap").read_bytes()
    assert len(by_mcap(tmp_path / "kept.mcap")[2]) == 5


def test_a_lost_schema_is_replaced_by_an_empty_one(tmp_path):
    """A file without a schema record stays readable, and the loss is reported."""
    path = write_mcap(tmp_path / "x.mcap", 10, repeat_schemas=False, use_chunking=False)
    data = path.read_bytes()
    begin, end = next(each[1:] for each in mcap_records(data) if each[0] == 3)
    path.write_bytes(data[:begin] + data[end:])
    found = salvage(path, tmp_path / "kept.mcap")
    assert (found.messages, found.lost) == (10, True)
    assert "schema of /notes" in found.reason
    assert len(by_mcap(tmp_path / "kept.mcap")[2]) == 10


def test_messages_outside_of_chunks_are_not_hidden_by_chunks(tmp_path):
    """Messages outside of chunks are put into chunks, where readers find them."""
    # A damaged chunk's header leaves its messages bare, and readers look into chunks alone.
    path = write_mcap(tmp_path / "x.mcap", 40, compression="none", chunk=400)
    data = bytearray(path.read_bytes())
    begin, _ = [each[1:] for each in mcap_records(data) if each[0] == 6][1]
    data[begin : begin + 30] = b"\xff" * 30
    path.write_bytes(data)
    found = salvage(path, tmp_path / "kept.mcap")
    assert found.messages >= 39
    assert len(by_mcap(tmp_path / "kept.mcap")[2]) == found.messages


def test_a_damaged_attachment_is_dropped_alone(tmp_path):
    """An attachment with a wrong checksum is dropped and named; all messages stay."""
    path = write_mcap(tmp_path / "x.mcap")
    path.write_bytes(path.read_bytes().replace(b"dragons", b"Dragons"))
    found = salvage(path, tmp_path / "kept.mcap")
    assert (found.messages, found.lost, found.lost_messages) == (10, True, 0)
    assert "map.txt" in found.reason
    assert by_mcap(tmp_path / "kept.mcap")[3] == []


@pytest.mark.parametrize("definitions", [False, True])
def test_a_sqlite_file_is_copied_with_its_tables(tmp_path, definitions):
    """A sqlite3 recording keeps messages and connections, and no temporary file stays."""
    path = write_db3(tmp_path / "x.db3", definitions=definitions)
    found = salvage(path, tmp_path / "kept.db3")
    assert (found.messages, found.lost) == (10, False)
    with Bag(path) as before, Bag(tmp_path / "kept.db3") as after:
        rows = [[(m.stamp_ns, m.content.data) for m in b.messages()] for b in (before, after)]
        assert rows[0] == rows[1] == [(stamp(k), f"note {k}") for k in range(10)]
        assert before.connections == after.connections
    assert sorted(each.name for each in tmp_path.iterdir()) == ["kept.db3", "x.db3"]


@pytest.mark.parametrize(
    ("suffix", "packed"),
    [("db3", ""), ("db3", "FILE"), ("db3", "MESSAGE"), ("mcap", ""), ("mcap", "FILE")],
)
def test_a_folder_gets_metadata_that_rosbags_reads(tmp_path, suffix, packed):
    """A salvaged folder has a metadata.yaml for rosbags, in every compression."""
    from rosbags.rosbag2 import Reader

    from tests.support.recordings import note

    folder = tmp_path / "drive"
    folder.mkdir()
    name = folder / f"drive_0.{suffix}"
    if suffix == "mcap":
        write_mcap(name)
    elif packed == "MESSAGE":
        write_db3(name, data=lambda k: zstandard.compress(note(2, k)))
    else:
        write_db3(name)
    if packed == "FILE":
        (folder / f"drive_0.{suffix}.zstd").write_bytes(zstandard.compress(name.read_bytes()))
        name.unlink()
    found = salvage(folder, tmp_path / "kept")
    assert (found.messages, found.lost) == (10, False)
    with Reader(tmp_path / "kept") as reader:
        rows = [(c.topic, c.msgtype, s, bytes(d)) for c, s, d in reader.messages()]
        assert reader.message_count == 10
        assert (reader.compression_mode or "").upper() == packed
    assert rows == [("/notes", "std_msgs/msg/String", stamp(k), note(2, k)) for k in range(10)]


def test_an_interrupted_salvage_leaves_no_file(tmp_path, monkeypatch):
    """An interrupt in the middle leaves neither a target nor a temporary file."""
    sources = [
        write_bag(tmp_path / "x.bag"),
        write_mcap(tmp_path / "x.mcap"),
        write_db3(tmp_path / "x.db3"),
    ]
    before = sorted(tmp_path.iterdir())

    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", stop)
    monkeypatch.setattr("andabata.records.salvage.copy_sqlite", stop)
    for source in sources:
        with pytest.raises(KeyboardInterrupt):
            salvage(source, tmp_path / f"kept{source.suffix}")
    assert sorted(tmp_path.iterdir()) == before


def test_names_that_do_not_fit_are_refused_and_nothing_is_written(tmp_path):
    """Existing, missing and mistyped paths are errors, and nothing is written."""
    path = write_bag(tmp_path / "x.bag")
    with pytest.raises(BagError, match="an existing one"):
        salvage(path, path)
    with pytest.raises(BagError, match=r"a name in \.bag"):
        salvage(path, tmp_path / "y.mcap")
    with pytest.raises(BagError, match="got nothing"):
        salvage(tmp_path / "none.bag", tmp_path / "y.bag")
    with pytest.raises(FileNotFoundError):
        salvage(path, tmp_path / "no" / "y.bag")
    assert list(tmp_path.iterdir()) == [path]


def test_the_command_reports_the_loss(tmp_path, capsys):
    """`bag salvage` exits with 3 and reports lost messages and the damage."""
    path = write_mcap(tmp_path / "x.mcap", 40, chunk=200)
    data = bytearray(path.read_bytes())
    _, end = [each[1:] for each in mcap_records(data) if each[0] == 6][1]
    data[end - 10] ^= 1
    path.write_bytes(data)
    assert main(["bag", "salvage", str(path), "--out", str(tmp_path / "a.mcap")]) == 3
    text = capsys.readouterr().out
    words = ["bag", "salvage", str(path), "--out", str(tmp_path / "b.mcap"), "--json"]
    assert main(words) == 3
    found = json.loads(capsys.readouterr().out)
    assert found["messages"] + found["lost_messages"] == 40
    assert f"{found['lost_messages']} messages lost" in text
    assert "checksum" in found["reason"]
