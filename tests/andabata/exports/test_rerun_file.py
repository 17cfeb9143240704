"""rerun's own reader finds the drive in the file, with its map as rerun itself reads it."""

import json
import sys
from dataclasses import replace

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.exports.rerun_estimate import ESTIMATE
from andabata.exports.rerun_file import BASE, MAP, ODOM
from andabata.records import topics
from andabata.records.bag_writers import open_writer
from andabata.records.bags import Bag
from andabata.records.messages import NS, MessageBuilder
from andabata.records.topics import Topic
from tests.support.planned_drives import START, record_drive
from traversability.cloud import PointCloud

SECONDS = 2.0


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    """Recording of two seconds."""
    return record_drive(tmp_path_factory.mktemp("rerun") / "drive.mcap", SECONDS)


@pytest.fixture(scope="module")
def chunks(drive):
    """Rows of each entity of the exported file as pyarrow batches, and number of blueprints."""
    pytest.importorskip("rerun", reason="rerun-sdk is not installed (extra `rerun`)")
    chunk = pytest.importorskip("rerun.chunk", reason="this rerun-sdk reads no files")
    out = drive.with_suffix(".rrd")
    assert main(["bag", "export", str(drive), "--out", str(out), "--quiet", "--json"]) == 0
    reader = chunk.RrdReader(str(out))
    assert [entry.application_id for entry in reader.recordings()] == ["andabata"]
    assert len(reader.blueprints()) == 1
    found = {}
    for each in reader.stream():
        found.setdefault(str(each.entity_path).strip("/"), []).append(each.to_record_batch())
    return found


def column(chunks, entity, name):
    """Return the values of a component, one a row."""
    batches = [batch for batch in chunks[entity] if name in batch.schema.names]
    return [value for batch in batches for value in batch.column(name).to_pylist()]


def stamps(chunks, entity):
    """Return the times of an entity's rows since 1970 [ns]."""
    times = [batch.column("time").cast("int64").to_pylist() for batch in chunks[entity]]
    return sorted(stamp for part in times for stamp in part)


def test_poses_come_at_their_times(chunks):
    """The robot's first pose in odom is the start's, at the header's stamp."""
    first = stamps(chunks, BASE)[0]
    assert first == 1_700_000_000 * NS + NS // 10
    places = np.array(column(chunks, BASE, "Transform3D:translation")).reshape(-1, 3)
    expected = START.position[:2] + 0.05 * np.array([np.cos(0.2), np.sin(0.2)])
    np.testing.assert_allclose(places[0, :2], expected, atol=1e-5)
    assert len(column(chunks, ODOM, "Transform3D:translation")) == 20
    # A message without a header has the time of its recording.
    assert stamps(chunks, "plots/heading_error")[0] == first


def test_the_map_lies_where_rerun_itself_puts_it(chunks, drive):
    """Corner, cell and unknown cells are those of rerun's own decoder of ROS 2 messages."""
    from rerun.chunk import McapReader

    theirs = {}
    for each in McapReader(str(drive)).stream():
        theirs.setdefault(str(each.entity_path).strip("/"), []).append(each.to_record_batch())
    theirs = {"map": [b for b in theirs["local_map"] if "GridMap:data" in b.schema.names]}
    if not theirs["map"]:
        pytest.skip("this rerun-sdk does not decode nav_msgs/OccupancyGrid")
    for name in ("GridMap:cell_size", "GridMap:translation"):
        ours = column(chunks, f"{ODOM}/local_map", name)
        assert len(ours) == 2
        # Rows of a file are in no order.
        assert sorted(map(str, ours)) == sorted(map(str, column(theirs, "map", name)))
    data = column(theirs, "map", "GridMap:data")
    known = [(np.array(values[0]) != 255).tobytes() for values in data]
    data = column(chunks, f"{ODOM}/local_map", "GridMap:data")
    clear = [(np.array(pixels[0])[3::4] > 0).tobytes() for pixels in data]
    assert sorted(known) == sorted(clear)
    assert len(set(known)) == 2  # The robot has moved.


def test_scene_and_plots_are_complete(chunks):
    """Cloud, cells, scan, plan, goal, tracks, numbers and health are there."""
    scene = ("cloud", "local_map", "plan", "subgoal")
    moving = ("polar_cells", "virtual_scan")
    plots = ("steering/commanded", "speed/commanded", "steering/true", "speed/true")
    wanted = {f"{ODOM}/{name}" for name in scene} | {f"{BASE}/{name}" for name in moving}
    wanted |= {f"plots/{name}" for name in (*plots, "heading_error")}
    wanted |= {f"{MAP}/goal", f"{MAP}/tracks/odometry_filtered", "health", ESTIMATE}
    wanted |= {f"plots/position_error/{name}" for name in ("true", "two_sigma")}
    assert wanted <= set(chunks)
    assert len(column(chunks, "plots/steering/commanded", "Scalars:scalars")) == 20
    (track,) = column(chunks, f"{MAP}/tracks/odometry_filtered", "LineStrips3D:strips")
    assert len(track[0]) == 21


def test_a_recording_without_poses_is_refused(capsys, tmp_path):
    """The message tells what is missing, and no file is left."""
    pytest.importorskip("rerun", reason="rerun-sdk is not installed (extra `rerun`)")
    path, out = tmp_path / "x.bag", tmp_path / "x.rrd"
    writer = open_writer(path)
    writer.write(topics.TWIST, NS, MessageBuilder(1).twist(0.3, 0.1))
    writer.close()
    assert main(["bag", "export", str(path), "--out", str(out)]) == 1
    assert "expected poses" in capsys.readouterr().err
    assert not out.exists()


def test_messages_that_cannot_be_drawn_are_counted(capsys, tmp_path):
    """Another type under our name, a laser in a frame of its own and a broken cloud are notes."""
    pytest.importorskip("rerun", reason="rerun-sdk is not installed (extra `rerun`)")
    path, out = tmp_path / "x.bag", tmp_path / "x.rrd"
    writer, builder = open_writer(path), MessageBuilder(1)
    points = PointCloud(np.ones((3, 3), dtype=np.float32), "odom")
    clouds = [
        builder.cloud(k, replace(points, frame=f)) for k, f in enumerate(("odom", "velodyne"))
    ]
    clouds.append(replace(clouds[0], fields=clouds[0].fields[:2]))
    goal = Topic("/goal", "/goal", "geometry_msgs/msg/Twist", None)
    rows = [(topics.FILTERED_ODOMETRY, builder.odometry(0.0, START)), (goal, builder.twist(1, 0))]
    for topic, message in (*rows, *((topics.CLOUD, cloud) for cloud in clouds)):
        writer.write(topic, 1_700_000_000 * NS, message)
    writer.close()
    assert main(["bag", "export", str(path), "--out", str(out), "--json", "--quiet"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["entities"][f"{ODOM}/cloud"] == 1
    assert sorted(note.split(": ")[1] for note in found["notes"]) == [
        "/3D_cloud",
        "/goal",
        "clouds in 'velodyne'",
    ]


def test_without_the_sdk_the_extra_is_named(capsys, drive, tmp_path, monkeypatch):
    """The message holds the line that installs it."""
    monkeypatch.setitem(sys.modules, "rerun", None)
    assert main(["bag", "export", str(drive), "--out", str(tmp_path / "x.rrd")]) == 1
    assert "pip install -e '.[rerun]'" in capsys.readouterr().err
    with Bag(drive) as bag:  # It is the SDK that is missing, not the drive.
        assert "/odometry/filtered" in bag.topics
