"""Groups of options: what the user typed becomes what the libraries take."""

import pytest

from andabata.app.console import COMPILES
from andabata.app.options.shared import ConsoleOptions, RobotOptions, SettingsOptions
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.configuration.settings import SettingsError
from andabata.configuration.usage import UsageError
from andabata.machine.lidar_models import UnknownSensorError
from andabata.machine.reality import LEVELS
from andabata.machine.robot import RobotModel
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


def test_a_wrong_setting_names_its_field():
    """An unknown field is an error with its name."""
    with pytest.raises(SettingsError, match="expected a known field"):
        SettingsOptions(None, ["robot.colour=1"]).resolve(SimulatedRobotConfig)


def test_the_console_has_the_form_of_the_options(capsys):
    """``--json`` gives JSON; ``--quiet`` leaves out the status."""
    console = ConsoleOptions(as_json=True, quiet=True).console()
    console.status("working")
    console.result({"a": 1}, "text")
    assert capsys.readouterr() == ('{"a": 1}\n', "")


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
