"""`bag info` reports the contents of a file as text and as JSON."""

import json

import pytest
from rosbags.rosbag1 import Writer

from andabata.app.cli import main
from andabata.records.summary import summarise
from andabata.records.topics import message_types
from tests.support.recordings import STRING, bag_record, note, stamp, write_bag, write_mcap


def run(capsys, *words):
    """Run `bag info`; return exit code and output."""
    code = main(["bag", "info", *map(str, words)])
    return code, capsys.readouterr().out


@pytest.mark.parametrize("write", [write_bag, write_mcap])
def test_publishers_are_counted_and_named(tmp_path, capsys, write):
    """A topic of two publishers has one row with both names, its rate and its type."""
    path = write(tmp_path / f"x.{write.__name__[6:]}")
    code, text = run(capsys, path, "--json")
    data = json.loads(text)
    (row,) = data["topics"]
    assert code == 0
    assert (row["topic"], row["type"], row["messages"]) == ("/notes", STRING, 10)
    assert row["rate_hz"] == pytest.approx(1.0)
    assert (row["connections"], row["publishers"]) == (2, ["/node0", "/node1"])
    assert (row["readable"], row["reason"]) == (True, None)
    assert row["latching"] is (write is write_bag)
    assert data["duration_s"] == pytest.approx(9.0)
    assert (data["left_out"], data["notes"]) == ([], [])


def test_unreadable_messages_are_listed_with_count_and_reason(tmp_path, capsys):
    """Unreadable topics and messages are listed with number and reason."""
    path = tmp_path / "x.bag"
    with Writer(path) as writer:
        good = writer.add_connection("/good", STRING, typestore=message_types(1))
        bad = writer.add_connection("/bad", "my_msgs/msg/X", msgdef="", md5sum="0" * 32)
        writer.add_connection("/silent", "my_msgs/msg/Y", msgdef="", md5sum="0" * 32)
        for k in range(4):
            writer.write(good, stamp(k), b"\xff" if k == 1 else note(1, k))
            writer.write(bad, stamp(k), b"\0")
    code, text = run(capsys, path)
    assert code == 0
    reason = "expected a message definition of my_msgs/msg/X, got an empty one"
    assert f"/bad can't be read: {reason}" in text
    assert "/good: 1 messages left out" in text
    _, text = run(capsys, path, "--json")
    data = json.loads(text)
    rows = {row["topic"]: row for row in data["topics"]}
    assert [rows[name]["readable"] for name in ("/bad", "/good", "/silent")] == [False, True, False]
    assert [rows[name]["messages"] for name in ("/bad", "/good", "/silent")] == [4, 4, 0]
    assert rows["/bad"]["rate_hz"] == pytest.approx(1.0)
    assert "an empty one" in rows["/silent"]["reason"]
    assert {each["topic"]: each["messages"] for each in data["left_out"]} == {"/bad": 4, "/good": 1}


def test_damage_is_reported_with_the_next_step(tmp_path, capsys):
    """A damaged file gives exit code 3 and names the salvage command."""
    path = write_bag(tmp_path / "x.bag", chunk=100)
    data = bytearray(path.read_bytes())
    begin, end = bag_record(data, 5, skip=1)
    data[begin:end] = b"\xff" * (end - begin)
    path.write_bytes(data)
    assert main(["bag", "info", str(path)]) == 3
    shown = capsys.readouterr()
    found = summarise(path)
    lost = found.left_out[0].messages
    assert lost == 10 - found.topics[0].messages > 0
    assert f"damage: {lost} messages left out" in shown.out
    assert "bag salvage x.bag --out NEW" in shown.err
