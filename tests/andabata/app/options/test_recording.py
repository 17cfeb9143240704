"""Choices for a replay, from the options of commands that read recordings."""

from andabata.app.options.recording import RecordingOptions
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.machine.faults import Fault


def test_every_option_reaches_the_replay():
    """Names, units, sources, stamps, mountings, settings, body, controller."""
    options = RecordingOptions(
        renamed=["/fix=/gps"],
        unit=["wheels=rpm"],
        time_offset=["/imu=-0.1"],
        cloud="/points",
        source=["/imu=imu_link"],
        mounting=["imu=0,0,0,180,0,0"],
        settings=["robot.wheel_radius=0.3"],
    )
    found = options.replay(None, "reactive", "husky")
    assert (found.controller, found.models, found.cloud) == ("reactive", None, "/points")
    assert (found.topics, found.units) == ({"/fix": "/gps"}, {"wheels": "rpm"})
    assert (found.sources, found.time_offsets) == ({"/imu": "imu_link"}, {"/imu": -0.1})
    assert set(found.mountings) == {"imu"}
    robot = found.configure(SimulatedRobotConfig()).robot
    assert robot.wheel_radius == 0.3
    assert robot.mass != SimulatedRobotConfig().robot.mass


def test_faults_are_added_to_the_recorded_readings():
    """They are settings of the replay; those of the recording stay there."""
    fault = Fault("gnss", "stuck", onset=20.0)
    found = RecordingOptions().replay(faults=[fault])
    assert found.configure(SimulatedRobotConfig()).faults == (fault,)
    more = RecordingOptions(settings=['faults=["imu:off"]']).replay(faults=[fault])
    assert more.configure(SimulatedRobotConfig()).faults == (Fault("imu", "off"),)


def test_without_options_all_is_as_recorded():
    """The recorded configuration passes unchanged."""
    recorded = SimulatedRobotConfig()
    assert RecordingOptions().replay().configure(recorded) == recorded
