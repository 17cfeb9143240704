"""The recording of a live drive gives its scans and commands again, to the bit."""

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.assembly.controllers import make_steering
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.machine.pose import Pose
from andabata.models import Models
from andabata.records import topics
from andabata.records.bags import Bag, BagError
from andabata.replay.options import ReplayOptions
from andabata.replay.replay import replay_bag
from andabata.ros.graph import RosError
from andabata.ros.live_recording import LiveRecording
from andabata.ros.navigator_node import NavigatorNode
from tests.support.played_graph import PlayedGraph


@pytest.fixture(scope="module", params=["utm-30lx", "vlp-16"])
def live(request, tmp_path_factory):
    """Return the recording of a live navigator on played readings, its result, and its laser."""
    folder, laser = tmp_path_factory.mktemp("live"), request.param
    words = ["drive", "--world", "natural-test", "--seed", "3", "--controller", "reactive"]
    words += ["--out", str(folder / "out"), "--set", "plant=kinematic", "--no-clouds"]
    words += ["--sensor", laser, "--time-limit", "8", "--record", str(folder / "drive.bag")]
    assert main([*words, "--json", "--quiet"]) == 0
    config, cloud = SimulatedRobotConfig(), topics.LASER_CLOUD if laser == "vlp-16" else None
    recording = LiveRecording(folder / "live.bag", 1)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("andabata.ros.navigator_node._FLUSH_TIME", 0.0)
        node = NavigatorNode(
            PlayedGraph.of_bag(folder / "drive.bag"),
            config,
            Models(),
            make_steering("reactive", None, config, Models()),
            cloud,
            recording=recording,
        )
        result = node.run(Pose.from_euler(np.zeros(3), 0.0, 0.0, 0.0), 7.0)
    recording.close()
    return folder / "live.bag", result, cloud


def test_a_replay_repeats_the_live_drive(live):
    """No scan and no command differs, and each period is there once."""
    path, result, cloud = live
    options = ReplayOptions(controller="reactive", cloud=None if cloud is None else cloud.ros1)
    replayed = replay_bag(path, options)
    assert result["scans"] > 5
    assert replayed["compared_scans"] == replayed["scans"] == result["scans"]
    assert replayed["differing_scans"] == replayed["differing_commands"] == 0
    assert replayed["periods"] == result["commands"]
    assert replayed["counts"]["imu"] == result["counts"]["imu"]


def test_an_update_is_recorded_between_two_commands(live):
    """Each period has one update in its middle, and one command at its end."""
    with Bag(live[0]) as bag:
        stamps = {
            name: [m.stamp_ns for m in bag.messages((name,))] for name in ("/update", "/cmd_vel")
        }
    gaps = np.array(stamps["/cmd_vel"]) - np.array(stamps["/update"])[: len(stamps["/cmd_vel"])]
    np.testing.assert_array_equal(gaps, 50_000_000)


def test_the_format_is_that_of_the_graph(tmp_path):
    """A bag of ROS 1 cannot hold messages of ROS 2, nor the other way round."""
    with pytest.raises(RosError, match=r"mcap or .db3 in a ROS 2 graph, got '.bag'"):
        LiveRecording(tmp_path / "x.bag", 2)
    with pytest.raises(RosError, match=r"\.bag in a ROS 1 graph, got '.mcap'"):
        LiveRecording(tmp_path / "x.mcap", 1)
    with pytest.raises(BagError):
        LiveRecording(tmp_path / "x.txt", 2)
