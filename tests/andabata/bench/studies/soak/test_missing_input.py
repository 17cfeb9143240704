"""Missing input: few drop-outs are in time, and a robot that drives on is noticed."""

from andabata.bench.studies.soak import missing_input
from andabata.bench.studies.soak.missing_input import missing_input_stops_the_robot
from andabata.navigation.laser_monitor import LaserMonitorConfig


def test_the_robot_stands_soon_after_its_inputs_fall_silent(tmp_path):
    """Of the laser, and of inertial unit and wheels."""
    outcome = missing_input_stops_the_robot(4, tmp_path)
    assert (outcome.trials, outcome.failures) == (4, ())


def test_a_robot_that_drives_on_is_noticed(tmp_path, monkeypatch):
    """One whose laser may be silent for a second is late."""
    slow = LaserMonitorConfig(timeout=1.0)
    make = missing_input.Navigator
    monkeypatch.setattr(
        missing_input, "Navigator", lambda *parts: make(*parts, laser=slow), raising=True
    )
    assert "drop-out 2: drives after" in missing_input_stops_the_robot(2, tmp_path).failures[0]
