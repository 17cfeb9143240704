"""The layout names what our recordings hold, and nothing else."""

import json
from operator import attrgetter

import pytest
from mcap.reader import make_reader
from rosbags.rosbag1 import Reader

from andabata.app.cli import main
from andabata.exports.foxglove_layout import HEALTH, SCENE, foxglove_layout
from andabata.records.topics import message_types
from tests.support.planned_drives import record_drive


def panels_of(tree):
    """Return the panels of a layout's tree."""
    if isinstance(tree, str):
        return [tree]
    return panels_of(tree["first"]) + panels_of(tree["second"])


def curves(layout):
    """Return topic and field of each curve."""
    plots = [about for name, about in layout["configById"].items() if name.startswith("Plot!")]
    return [tuple(path["value"].split(".", 1)) for plot in plots for path in plot["paths"]]


def named_topics(layout):
    """Return every topic that a layout names."""
    panels = layout["configById"]
    return {
        *panels[SCENE]["topics"],
        panels[HEALTH]["topicToRender"],
        *(topic for topic, _ in curves(layout)),
    }


def last_messages(path):
    """Return the last message of each topic of an MCAP file, read by the mcap library alone."""
    types = message_types(2)
    with path.open("rb") as file:
        return {
            channel.topic: types.deserialize_cdr(message.data, schema.name)
            for schema, channel, message in make_reader(file).iter_messages()
        }


def test_every_topic_and_field_is_in_a_recording(tmp_path):
    """The written layout is JSON; each topic is recorded, and each field is a number there."""
    out = tmp_path / "layout.json"
    assert main(["bag", "layout", "--out", str(out), "--json"]) == 0
    layout = json.loads(out.read_text())
    found = last_messages(record_drive(tmp_path / "drive.mcap"))
    assert named_topics(layout) <= set(found)
    assert curves(layout)
    for topic, field in curves(layout):
        assert isinstance(attrgetter(field)(found[topic]), float)
    frames = {t.child_frame_id for t in found["/tf"].transforms} | {"map"}
    wanted = {name.removeprefix("frame:") for name in layout["configById"][SCENE]["transforms"]}
    assert wanted == frames
    assert layout["configById"][SCENE]["followTf"] in frames


def test_the_layout_of_ros_1_names_the_topics_of_a_bag(tmp_path):
    """A ROS 1 bag has the paper's names."""
    with Reader(record_drive(tmp_path / "drive.bag")) as bag:
        assert named_topics(foxglove_layout(1)) <= {each.topic for each in bag.connections}


@pytest.mark.parametrize("ros", [1, 2])
def test_every_panel_has_its_place_once(ros):
    """The tree holds each configured panel exactly once; shares leave room for both sides."""
    layout = foxglove_layout(ros)
    panels = panels_of(layout["layout"])
    assert sorted(panels) == sorted(layout["configById"])
    assert 0 < layout["layout"]["splitPercentage"] < 100


def test_an_unknown_version_of_ros_is_refused(capsys, tmp_path):
    """The message names the versions there are."""
    assert main(["bag", "layout", "--out", str(tmp_path / "x.json"), "--ros", "3"]) == 2
    assert "'--ros'" in capsys.readouterr().err


def test_a_folder_that_is_missing_is_named(capsys, tmp_path):
    """Nothing is written where there is no folder."""
    assert main(["bag", "layout", "--out", str(tmp_path / "no" / "x.json")]) == 1
    assert "expected an existing folder" in capsys.readouterr().err
