"""An export holds all that was recorded, and is written completely or not at all."""

import base64
import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer

from andabata.app.cli import main
from andabata.exports.csv_table import LONGEST_ARRAY, LONGEST_BYTES, LONGEST_LIST
from andabata.exports.topics import decode_bag_cloud, export_bag, file_names
from andabata.records.bags import BagError
from andabata.records.messages import MessageBuilder
from andabata.records.topics import POINT_CLOUD, message_types
from tests.support.recordings import stamp, write_bag
from traversability.cloud import PointCloud
from traversability.files import decode_cloud_file
from traversability.formats import ply

BUILDER, TYPES = MessageBuilder(1), message_types(1)


def write(path, rows):
    """Write topic, type and message of each row, a second apart; bytes go as they are."""
    with Writer(path) as writer:
        connections = {}
        for k, (topic, kind, message) in enumerate(rows):
            if (topic, kind) not in connections:
                own = writer.add_connection(topic, kind, typestore=TYPES)
                connections[topic, kind] = own
            raw = isinstance(message, bytes)
            data = message if raw else TYPES.serialize_ros1(message, kind)
            writer.write(connections[topic, kind], stamp(k), data)
    return path


def rows_of(path):
    """Return the rows of a CSV file."""
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def transforms(*children):
    """Return topic, type and message of transforms to some child frames."""
    kind = "tf2_msgs/msg/TFMessage"
    parts = []
    for k, child in enumerate(children):
        (one,) = BUILDER.transform(k, np.array([k, 0.5, 0, 0, 0, 0, 1.0]), kind).transforms
        one.child_frame_id = child
        parts.append(one)
    return ("/tf", kind, BUILDER.new(kind, transforms=parts))


def test_arrays_that_grow_keep_all_their_columns(tmp_path):
    """A longer array adds columns; shorter ones leave them empty."""
    path = write(tmp_path / "x.bag", [transforms("a"), transforms("a", "b", "c"), transforms()])
    export_bag(path, tmp_path / "out")
    rows = rows_of(tmp_path / "out" / "tf.csv")
    assert [row["transforms.2.child_frame_id"] for row in rows] == ["", "c", ""]
    assert rows[1]["transforms.2.transform.translation.x"] == "2.0"
    assert [row["transforms.0.child_frame_id"] for row in rows] == ["a", "a", ""]
    names = list(rows[0])
    assert names[0] == "recorded_ns"
    assert names.index("transforms.1.child_frame_id") > names.index("transforms.0.child_frame_id")


def test_integers_and_special_floats_are_kept(tmp_path):
    """64-bit integers, NaN and infinities are written exactly."""
    imu = BUILDER.imu(np.array([0, np.nan, np.inf, -np.inf, 0, 0, 9.81]))
    count = BUILDER.new("std_msgs/msg/UInt64", data=2**64 - 1)
    rows = [("/imu", "sensor_msgs/msg/Imu", imu), ("/count", "std_msgs/msg/UInt64", count)]
    export_bag(write(tmp_path / "x.bag", rows), tmp_path / "out")
    (row,) = rows_of(tmp_path / "out" / "imu.csv")
    assert row["recorded_ns"] == str(stamp(0))
    assert [row[f"angular_velocity.{axis}"] for axis in "xyz"] == ["nan", "inf", "-inf"]
    (row,) = rows_of(tmp_path / "out" / "count.csv")
    assert row == {"recorded_ns": str(stamp(1)), "data": str(2**64 - 1)}


def test_strings_with_commas_quotes_and_lines_come_back(tmp_path):
    """Strings survive the quoting of CSV."""
    text = 'a, "b"\nc\r\nß'
    kind = "std_msgs/msg/String"
    rows = [("/notes", kind, BUILDER.new(kind, data=text))]
    export_bag(write(tmp_path / "x.bag", rows), tmp_path / "out")
    (row,) = rows_of(tmp_path / "out" / "notes.csv")
    assert row["data"] == text


def test_images_long_arrays_and_long_lists_get_one_column_each(tmp_path):
    """Long arrays are one column of base64 or JSON, and a note names it."""
    pixels = np.arange(LONGEST_BYTES + 1, dtype=np.uint8)
    image = BUILDER.new(
        "sensor_msgs/msg/Image",
        header=BUILDER.header(0, "camera"),
        height=1,
        width=len(pixels),
        encoding="mono8",
        is_bigendian=0,
        step=len(pixels),
        data=pixels,
    )
    layout = BUILDER.new("std_msgs/msg/MultiArrayLayout", dim=[], data_offset=0)
    kind = "std_msgs/msg/Float32MultiArray"
    long = np.linspace(0, 1, LONGEST_ARRAY + 1, dtype=np.float32)
    children = [f"frame_{k}" for k in range(LONGEST_LIST + 1)]
    rows = [
        ("/image", "sensor_msgs/msg/Image", image),
        ("/long", kind, BUILDER.new(kind, layout=layout, data=long)),
        transforms(*children),
    ]
    found = export_bag(write(tmp_path / "x.bag", rows), tmp_path / "out")
    (row,) = rows_of(tmp_path / "out" / "image.csv")
    assert base64.b64decode(row["data"]) == pixels.tobytes()
    assert len(row) < 15
    csv.field_size_limit(1 << 24)
    (row,) = rows_of(tmp_path / "out" / "long.csv")
    np.testing.assert_array_equal(np.array(json.loads(row["data"]), dtype=np.float32), long)
    (row,) = rows_of(tmp_path / "out" / "tf.csv")
    assert [each["child_frame_id"] for each in json.loads(row["transforms"])] == children
    assert found.notes == (
        "image.csv: data is written as base64",
        "long.csv: data is written as a JSON list",
        "tf.csv: transforms is written as a JSON list",
    )


def test_short_arrays_of_bytes_get_a_column_each(tmp_path):
    """The longest short array of bytes still has a column per byte."""
    layout = BUILDER.new("std_msgs/msg/MultiArrayLayout", dim=[], data_offset=0)
    kind = "std_msgs/msg/UInt8MultiArray"
    message = BUILDER.new(kind, layout=layout, data=np.arange(LONGEST_BYTES, dtype=np.uint8))
    export_bag(write(tmp_path / "x.bag", [("/b", kind, message)]), tmp_path / "out")
    (row,) = rows_of(tmp_path / "out" / "b.csv")
    assert [int(row[f"data.{k}"]) for k in range(LONGEST_BYTES)] == list(range(LONGEST_BYTES))


def test_no_two_topics_share_a_file():
    """File names are unique even without regard to case, and contain no path."""
    streams = [
        ("/a/b", "x"),
        ("/a_b", "x"),
        ("/a_b_2", "x"),
        ("/A_b", "x"),
        ("/a/b", "y"),
        ("~", "x"),
    ]
    names = file_names(streams)
    assert len({name.lower() for name in names.values()}) == len(streams)
    assert names["/a/b", "x"] == "A_b_2" or names["/a/b", "x"].startswith("a_b")
    assert file_names([("/../../etc", "x")])["/../../etc", "x"].count("/") == 0


def test_topics_whose_names_collide_are_both_written(tmp_path):
    """Two topics with the same file name both get a file."""
    kind = "std_msgs/msg/String"
    rows = [(topic, kind, BUILDER.new(kind, data=topic)) for topic in ("/a/b", "/a_b")]
    found = export_bag(write(tmp_path / "x.bag", rows), tmp_path / "out")
    assert {rows_of(path)[0]["data"] for path in found.files} == {"/a/b", "/a_b"}


def test_two_types_of_one_topic_have_files_of_their_own(tmp_path):
    """Each message type of a topic has its own file."""
    rows = [
        ("/x", "std_msgs/msg/String", BUILDER.new("std_msgs/msg/String", data="a")),
        ("/x", "std_msgs/msg/Int8", BUILDER.new("std_msgs/msg/Int8", data=3)),
    ]
    found = export_bag(write(tmp_path / "x.bag", rows), tmp_path / "out")
    assert sorted(rows_of(path)[0]["data"] for path in found.files) == ["3", "a"]


def cloud(big=False, count=5, bad=False):
    """Return a lidar's cloud with fields of many types, padding, and a point without a return."""
    order = ">" if big else "<"
    fields = [
        ("x", 7, 0), ("y", 7, 4), ("z", 7, 8), ("intensity", 7, 16),
        ("t", 6, 20), ("ring", 4, 24), ("label", 2, 26), ("time stamp", 8, 32),
    ]  # fmt: skip
    kinds = {2: "u1", 4: "u2", 6: "u4", 7: "f4", 8: "f8"}
    step = 44
    data = np.zeros((count, step), np.uint8)
    columns = {}
    for name, kind, offset in fields:
        dtype = np.dtype(order + kinds[kind])
        values = (np.arange(count) * 7 + offset).astype(dtype)
        if name == "x" and count:
            values[1] = np.nan
        columns[name] = values
        data[:, offset : offset + dtype.itemsize] = values.view(np.uint8).reshape(
            count, dtype.itemsize
        )
    return columns, BUILDER.new(
        POINT_CLOUD,
        header=BUILDER.header(0, "velodyne"),
        height=1,
        width=count + 3 * bad,
        fields=[
            BUILDER.new("sensor_msgs/msg/PointField", name=n, offset=o, datatype=k, count=1)
            for n, k, o in fields
        ],
        is_bigendian=big,
        point_step=step,
        row_step=step * count,
        data=data.ravel(),
        is_dense=False,
    )


@pytest.mark.parametrize("kind", ["pcd", "las"])
def test_other_formats_leave_out_points_without_a_return(tmp_path, kind):
    """The others keep their places and fields; whole numbers of LAS have no NaN."""
    if kind == "las":
        pytest.importorskip("laspy", reason="laspy is not installed (extra `las`)")
    columns, message = cloud()
    path = write(tmp_path / "x.bag", [("/points", POINT_CLOUD, message)])
    (file,) = export_bag(path, tmp_path / "out", clouds=kind).files
    found = decode_cloud_file(file)
    assert len(found.cloud) == 4
    assert found.no_returns == 0
    np.testing.assert_allclose(found.cloud.points[1:, 1], columns["y"][2:], atol=1e-4)
    np.testing.assert_array_equal(found.others["ring"], np.delete(columns["ring"], 1))


def test_an_unknown_format_of_clouds_is_refused(tmp_path):
    """The message names the formats there are."""
    path = write(tmp_path / "x.bag", [("/points", POINT_CLOUD, cloud()[1])])
    with pytest.raises(BagError, match=r"expected one of ply, pcd, las, laz, got 'vtk'"):
        export_bag(path, tmp_path / "out", clouds="vtk")


@pytest.mark.parametrize("big", [False, True])
def test_clouds_keep_every_field_of_every_point(tmp_path, big):
    """A PLY file holds all fields of all points, from either byte order."""
    columns, message = cloud(big)
    (path,) = export_bag(
        write(tmp_path / "x.bag", [("/points", POINT_CLOUD, message)]), tmp_path / "out"
    ).files
    found = ply.parse(path.read_bytes())
    assert list(found) == [name.replace(" ", "_") for name in columns]
    for name, values in columns.items():
        own = found[name.replace(" ", "_")]
        np.testing.assert_array_equal(own, values)
        assert own.dtype == values.dtype.newbyteorder("<")


def test_what_a_cloud_says_wrongly_of_itself_is_noted_once(tmp_path):
    """Clouds whose byte order contradicts their flag are exported right, with one note."""
    columns, message = cloud()
    rows = [("/points", POINT_CLOUD, replace(message, is_bigendian=True))] * 3
    found = export_bag(write(tmp_path / "x.bag", rows), tmp_path / "out")
    (note,) = found.notes
    assert note.startswith("/points: is_bigendian: the coordinates are little-endian")
    data = ply.parse(found.files[2].read_bytes())
    np.testing.assert_array_equal(data["ring"], columns["ring"])


def mcap_of(path, kind):
    """Write an MCAP with a cloud whose schema holds the name of its type alone."""
    store = message_types(2)
    builder = MessageBuilder(2)
    message = builder.cloud(0.0, PointCloud(np.ones((5, 3), np.float32), "velodyne"))
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.start(profile="ros2", library="test")
        schema = writer.register_schema(kind, "ros2msg", kind.encode())
        channel = writer.register_channel("/points", "cdr", schema)
        writer.add_message(channel, 1, bytes(store.serialize_cdr(message, POINT_CLOUD)), 1)
        writer.finish()
    return path


def test_a_definition_that_is_the_types_name_is_the_standard_one(tmp_path):
    """A cloud of a standard type is read and that is noted; another type is named."""
    decoded = decode_bag_cloud(mcap_of(tmp_path / "x.mcap", POINT_CLOUD), None)
    assert len(decoded.cloud) == 5
    assert decoded.remarks[0] == (
        f"/points: expected a message definition of {POINT_CLOUD}, got its name alone; read by the "
        "standard definition"
    )
    other = mcap_of(tmp_path / "y.mcap", "my_msgs/msg/Cloud")
    text = "none; got no name; /points: expected a message definition of my_msgs/msg/Cloud, got its"
    with pytest.raises(BagError, match=text):
        decode_bag_cloud(other, None)


def test_an_empty_cloud_is_a_file_and_a_damaged_one_is_left_out(tmp_path):
    """An empty cloud gives a file; a damaged one is counted as left out."""
    rows = [
        ("/points", POINT_CLOUD, cloud(count=0)[1]),
        ("/points", POINT_CLOUD, cloud(bad=True)[1]),
        ("/points", POINT_CLOUD, cloud(bad=True)[1]),
        ("/points", POINT_CLOUD, cloud()[1]),
    ]
    found = export_bag(write(tmp_path / "x.bag", rows), tmp_path / "out")
    # A file's number is the cloud's place among its topic's.
    assert [path.name for path in found.files] == ["points_00000.ply", "points_00003.ply"]
    ((topic, count),) = {(each.topic, each.messages) for each in found.left_out}
    assert (topic, count) == ("/points", 2)


def unreadable(path):
    """A topic without definition and one message that is cut short, beside whole ones."""
    kind = "std_msgs/msg/String"
    data = bytes(TYPES.serialize_ros1(BUILDER.new(kind, data="hello"), kind))
    with Writer(path) as writer:
        good = writer.add_connection("/good", kind, typestore=TYPES)
        bad = writer.add_connection("/bad", "my_msgs/msg/X", msgdef="", md5sum="0" * 32)
        for k in range(4):
            writer.write(good, stamp(k), data[:-2] if k == 1 else data)
            writer.write(bad, stamp(k), b"\0")
    return path


def test_unreadable_messages_are_reported_and_the_rest_is_written(tmp_path, capsys):
    """Exit code 3 and counts by topic report unreadable messages; readable ones are exported."""
    path = unreadable(tmp_path / "x.bag")
    words = ["bag", "export", str(path), "--out", str(tmp_path / "out")]
    assert main(words) == 3
    text = capsys.readouterr().out
    assert "/bad: 4 messages left out: expected a message definition" in text
    assert "/good: 1 messages left out: expected a std_msgs/msg/String" in text
    assert main([*words, "--json"]) == 3
    data = json.loads(capsys.readouterr().out)
    assert {row["topic"]: row["messages"] for row in data["left_out"]} == {"/bad": 4, "/good": 1}
    assert len(rows_of(tmp_path / "out" / "good.csv")) == 3
    # Unreadable topics that were not chosen are not reported.
    assert main([*words, "--topic", "/bad"]) == 3
    assert main(["bag", "export", str(write_bag(tmp_path / "y.bag")), "--out", str(tmp_path)]) == 0


def test_a_failure_leaves_the_old_files_and_no_others(tmp_path):
    """An interrupted export changes nothing in the folder."""
    path = write_bag(tmp_path / "x.bag")
    out = tmp_path / "out"
    out.mkdir()
    (out / "notes.csv").write_text("old")

    def stop():
        raise KeyboardInterrupt

    for folder in (out, tmp_path / "new"):
        with pytest.raises(KeyboardInterrupt):
            export_bag(path, folder, on_message=stop)
    with pytest.raises(BagError, match="--topic: expected some of /notes, got /nix"):
        export_bag(path, tmp_path / "new", ("/nix",))
    assert [each.name for each in out.iterdir()] == ["notes.csv"]
    assert (out / "notes.csv").read_text() == "old"
    assert not (tmp_path / "new").exists()
    export_bag(path, out)
    assert len(rows_of(out / "notes.csv")) == 10


def test_clouds_are_counted_from_both_ends(tmp_path):
    """Numbers from 0 and from -1 count readable clouds; others are an error."""
    rows = []
    for k in range(4):
        message = BUILDER.cloud(k, PointCloud(np.full((3, 3), k, np.float32), "base_link"))
        if k == 2:  # Its bytes end too early.
            message = bytes(TYPES.serialize_ros1(message, POINT_CLOUD))[:-5]
        rows.append(("/points", POINT_CLOUD, message))
    path = write(tmp_path / "x.bag", rows)
    for number, value in ((0, 0), (1, 1), (2, 3), (-1, 3), (-2, 1), (-3, 0)):
        assert decode_bag_cloud(path, None, number).cloud.points[0, 0] == value
    for number in (3, -4):
        with pytest.raises(BagError, match="--number: expected one of the"):
            decode_bag_cloud(path, None, number)
