"""``andabata ros2``: the navigator, or a simulated robot, in a live ROS 2 graph, without ROS."""

import typer

from andabata.app.command import command
from andabata.app.options.live import LiveDriveOptions, OutputOptions, Ros2Options
from andabata.app.options.models import ModelOptions
from andabata.app.options.sensors import SensorOptions
from andabata.app.options.shared import (
    ConsoleOptions,
    EvaluationSeed,
    Robot,
    RobotOptions,
    SettingsOptions,
)
from andabata.app.options.view import RobotViewOptions
from andabata.app.verbs.ros import Controller, LongestDrive, WorldPreset, navigate, simulate
from worlds.splits import DEVELOPMENT_SEED

app = typer.Typer(
    help="A live ROS 2 graph, by DDS and without ROS: the navigator's nodes, and a simulated robot "
    "for them (extra `ros2`).",
    no_args_is_help=True,
)


@app.command()
@command
def navigator(
    *,
    controller: Controller = None,
    drive: LiveDriveOptions,
    form: OutputOptions,
    graph: Ros2Options,
    robot: Robot = "andabata",
    sensors: SensorOptions,
    models: ModelOptions,
    viewer: RobotViewOptions,
    output: ConsoleOptions,
) -> None:
    """Run the nodes of the paper's Figure 11: scanner, filter, virtual scan, actor, wheels.

    Examples:
        andabata ros2 navigator
        andabata ros2 navigator --start 0,0,90 --goal 20,5
        andabata ros2 navigator --cloud /points --remap /encoder_data=/wheels
        andabata ros2 navigator --namespace /robot1 --use-sim-time
    """
    console = output.console()
    opener = graph.opener(console.status)
    navigate(opener, controller, drive, robot, sensors, models, viewer, console, form.form())


@app.command()
@command
def robot(
    *,
    world: WorldPreset = "natural-test",
    seconds: LongestDrive = 300.0,
    graph: Ros2Options,
    body: RobotOptions,
    settings: SettingsOptions,
    seed: EvaluationSeed = DEVELOPMENT_SEED,
    output: ConsoleOptions,
) -> None:
    """Run a simulated robot: publish its sensors in real time, obey /wheel_speed_cmd.

    Examples:
        andabata ros2 robot
        andabata ros2 robot --world hill --seed 3 --seconds 120
        andabata ros2 robot --robot husky --set plant=kinematic
    """
    console = output.console()
    simulate(graph.opener(console.status), world, seconds, body, settings, seed, console)
