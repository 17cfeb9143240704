"""Groups of options: what the user typed becomes what the libraries take."""

from dataclasses import replace

import pytest

from andabata.app.console import COMPILES
from andabata.app.options.shared import (
    ClassifierOptions,
    ConsoleOptions,
    ForestOptions,
    ModelOptions,
    PolicyOptions,
    RobotOptions,
    SensorOptions,
    SettingsOptions,
    TopicOptions,
)
from andabata.app.options.view import DriveViewOptions
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.configuration.settings import SettingsError
from andabata.configuration.usage import UsageError
from andabata.machine.lidar_models import UnknownSensorError
from andabata.machine.reality import LEVELS
from andabata.machine.robot import RobotModel
from andabata.models import shipped_forest, shipped_ground_classifier, shipped_policy
from terrain.compilation import compilation_begins, on_first_compilation


def test_settings_come_over_the_parts_of_the_robot(tmp_path):
    """The file comes over the body's values, and ``--set`` over the file."""
    file = tmp_path / "c.toml"
    file.write_text("[robot]\nmass = 70.0\nlidar_height = 0.9\n")
    base = RobotOptions("os1-64", "husky").base()
    found = SettingsOptions(file, ["robot.mass=80"]).resolve(SimulatedRobotConfig, base)
    assert base.robot == RobotModel.load("husky")
    assert (found.robot.mass, found.robot.lidar_height) == (80.0, 0.9)
    assert found.robot.track == base.robot.track != RobotModel().track
    assert found.sensing == base.sensing != SimulatedRobotConfig().sensing


def test_without_options_the_defaults_stand():
    """No option at all gives the default robot."""
    found = SettingsOptions().resolve(SimulatedRobotConfig, RobotOptions().base())
    assert found == SimulatedRobotConfig()


def test_unknown_parts_are_refused():
    """A laser or body without a model is an error."""
    with pytest.raises(UnknownSensorError):
        RobotOptions(sensor="radar").base()
    with pytest.raises(ValueError, match="rover"):
        RobotOptions(robot="rover").base()


def test_a_level_of_reality_is_that_of_the_robot():
    """``--reality`` gives all numbers of the level, and ``--set`` changes one."""
    base = RobotOptions("os1-64", "husky", "field").base()
    assert base.reality == LEVELS["field"]
    assert base.robot == RobotModel.load("husky")
    found = SettingsOptions(None, ["reality.lag=0"]).resolve(SimulatedRobotConfig, base)
    assert found.reality == LEVELS["field"].model_copy(update={"lag": 0.0})
    with pytest.raises(UsageError, match=r"^--reality: expected one of ideal, field, harsh, got"):
        RobotOptions(reality="mud").base()


def test_a_setting_wins_over_the_height_and_the_datum_over_a_setting():
    """``--set`` comes over ``--sensor-height``, and ``--datum`` over ``--set``."""
    sensors = SensorOptions(
        settings=["robot.lidar_height=0.5", "sensing.geo_reference.latitude_deg=10"],
        sensor_height=1.5,
        datum="40,-3",
    )
    found = sensors.configure(SimulatedRobotConfig())
    assert found.robot.lidar_height == 0.5
    assert found.sensing.geo_reference.latitude_deg == 40.0
    alone = SensorOptions(sensor_height=1.5).configure(SimulatedRobotConfig())
    assert alone.robot.lidar_height == 1.5


def test_a_recorded_configuration_is_kept_where_nothing_is_given():
    """Without options the base comes back as it is."""
    base = SimulatedRobotConfig(plant="kinematic")
    assert SensorOptions().configure(base) == base
    assert SensorOptions().mountings() == {}


def test_mountings_and_units_are_read_once():
    """Mountings, names and units come as dictionaries; wrong texts are usage errors."""
    assert set(SensorOptions(mounting=["imu=0,0,0,0,0", "1,0,0,0,0"]).mountings()) == {"imu", ""}
    topics = TopicOptions(["/fix=/gps"], ["wheels=rpm"])
    assert (topics.names(), topics.units()) == ({"/fix": "/gps"}, {"wheels": "rpm"})
    assert (TopicOptions().names(), TopicOptions().units()) == ({}, {})
    with pytest.raises(UsageError, match="--map"):
        TopicOptions(["/fix"]).names()
    with pytest.raises(UsageError, match="knots"):
        TopicOptions(None, ["wheels=knots"]).units()


def test_a_wrong_setting_names_its_field():
    """An unknown field is an error with its name."""
    with pytest.raises(SettingsError, match="expected a known field"):
        SettingsOptions(None, ["robot.colour=1"]).resolve(SimulatedRobotConfig)


def test_shipped_models_stand_in_for_missing_files(tmp_path):
    """A file takes the place of its own model only."""
    path = tmp_path / "forest.npz"
    path.write_bytes(shipped_forest().to_bytes())
    assert ForestOptions().load() is shipped_forest()
    assert PolicyOptions().load() is shipped_policy()
    for models in (ModelOptions(forest=path).load(), ClassifierOptions(forest=path).load()):
        assert models.forest is not shipped_forest()
        assert models.ground_classifier is shipped_ground_classifier()
        assert models.policy is shipped_policy()
    with pytest.raises(FileNotFoundError):
        ModelOptions(policy=tmp_path / "none").load()


def test_the_console_has_the_form_of_the_options(capsys):
    """``--json`` gives JSON; ``--quiet`` leaves out the status."""
    console = ConsoleOptions(as_json=True, quiet=True).console()
    console.status("working")
    console.result({"a": 1}, "text")
    assert capsys.readouterr() == ('{"a": 1}\n', "")


def test_a_drive_waits_only_for_a_page_that_there_is():
    """``--view-wait`` without ``--view`` is refused; with it, it is a choice of who watches."""
    assert DriveViewOptions().wanted() is None
    shown = DriveViewOptions(view=True).wanted()
    assert shown is not None
    assert not shown.waits
    waits = DriveViewOptions(view=True, view_wait=True).wanted()
    assert waits == replace(shown, waits=True)
    with pytest.raises(UsageError, match="--view-wait: expected --view beside it"):
        DriveViewOptions(view_wait=True).wanted()


@pytest.mark.parametrize(
    ("options", "line"),
    [
        (ConsoleOptions(), COMPILES),
        (ConsoleOptions(as_json=True), COMPILES),
        (ConsoleOptions(quiet=True), ""),
    ],
    ids=["plain", "json", "quiet"],
)
def test_a_command_says_on_stderr_that_it_compiles(capsys, monkeypatch, options, line):
    """Also without a terminal; stdout is for the result alone, and quiet is quiet."""
    monkeypatch.setattr("andabata.app.options.shared.on_first_compilation", on_first_compilation)
    options.console()
    compilation_begins()
    compilation_begins()
    captured = capsys.readouterr()
    assert (captured.out, captured.err.strip()) == ("", line)
