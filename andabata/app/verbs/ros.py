"""``andabata ros``: the navigator, or a simulated robot, in a live ROS 1 graph."""

from typing import TYPE_CHECKING, Annotated

import typer

from andabata.app.command import command
from andabata.app.options.live import LiveDriveOptions
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
from worlds.splits import DEVELOPMENT_SEED

if TYPE_CHECKING:
    from andabata.app.console import Console
    from andabata.app.live import OpenGraph
    from andabata.ros.navigator_output import OutputForm

Controller = Annotated[
    str | None,
    typer.Option(
        help="planner, policy+planner, policy, reactive or straight. The default is planner, "
        "beside --policy policy+planner."
    ),
]
WorldPreset = Annotated[str, typer.Option("--world", help="World preset.")]
LongestDrive = Annotated[
    float, typer.Option("--seconds", min=0.1, help="Longest drive to each goal, in seconds.")
]

app = typer.Typer(
    help="A live ROS 1 graph: the navigator's nodes, and a simulated robot for them.",
    no_args_is_help=True,
)


@app.command()
@command
def navigator(
    *,
    controller: Controller = None,
    drive: LiveDriveOptions,
    robot: Robot = "andabata",
    sensors: SensorOptions,
    models: ModelOptions,
    viewer: RobotViewOptions,
    output: ConsoleOptions,
) -> None:
    """Run the nodes of the paper's Figure 11: scanner, filter, virtual scan, actor, wheels.

    Examples:
        andabata ros navigator
        andabata ros navigator --start 0,0,90 --goal 20,5
        andabata ros navigator --controller reactive --seconds 60 --json
        andabata ros navigator --robot husky --cloud /points --datum 40.1,-3.4
        andabata ros navigator --view --view-port 8090 --allow-commands
    """
    from andabata.ros.ros1_graph import Ros1Graph

    navigate(Ros1Graph, controller, drive, robot, sensors, models, viewer, output.console())


@app.command()
@command
def robot(
    *,
    world: WorldPreset = "natural-test",
    seconds: LongestDrive = 300.0,
    body: RobotOptions,
    settings: SettingsOptions,
    seed: EvaluationSeed = DEVELOPMENT_SEED,
    output: ConsoleOptions,
) -> None:
    """Run a simulated robot: publish its sensors in real time, obey /wheel_speed_cmd.

    Examples:
        andabata ros robot
        andabata ros robot --world hill --seed 3 --seconds 120
        andabata ros robot --robot husky --set plant=kinematic
    """
    from andabata.ros.ros1_graph import Ros1Graph

    simulate(Ros1Graph, world, seconds, body, settings, seed, output.console())


def navigate(
    open_graph: "OpenGraph",
    controller: str | None,
    drive: LiveDriveOptions,
    robot: str,
    sensors: SensorOptions,
    models: ModelOptions,
    viewer: RobotViewOptions,
    console: "Console",
    form: "OutputForm | None" = None,
) -> None:
    """Run the navigator in a graph and print its figures.

    Args:
        open_graph: Function that joins the graph.
        controller: Name of the controller; None for the default one.
        drive: Start, goal and duration.
        robot: Name of the body.
        sensors: Sensors and settings.
        models: Classifiers and policy.
        viewer: Choices of who watches.
        console: Console to print to.
        form: Form of the output; None for the paper's.
    """
    from andabata.app.live import run_navigator
    from andabata.app.replay_text import navigation_text
    from andabata.assembly.controllers import (
        MAPLESS_CONTROLLERS,
        default_controller,
        refuse_unused_policy,
    )
    from andabata.assembly.simulated_robot import SimulatedRobotConfig
    from andabata.configuration.settings import with_parts
    from andabata.configuration.usage import words

    # A list is read as elsewhere; one robot has one controller, the first.
    loaded = models.load()
    named = default_controller(loaded) if controller is None else controller
    (name,) = words(named, MAPLESS_CONTROLLERS, "--controller", takes_own=True)[:1]
    refuse_unused_policy((name,), loaded, "--controller")
    data = run_navigator(
        open_graph,
        name,
        sensors.configure,
        with_parts(SimulatedRobotConfig, "utm-30lx", robot),
        loaded,
        console,
        cloud=sensors.cloud,
        mountings=sensors.mountings(),
        sources=sensors.sources(),
        start=drive.start_pose(),
        goal=drive.first_goal(),
        path=drive.path,
        seconds=drive.seconds,
        local_map=drive.local_map,
        view=viewer.wanted(),
        form=form,
        record=drive.record,
    )
    console.result(data, navigation_text(data))


def simulate(
    open_graph: "OpenGraph",
    world: str,
    seconds: float,
    body: RobotOptions,
    settings: SettingsOptions,
    seed: int,
    console: "Console",
) -> None:
    """Run a simulated robot in a graph and print its figures.

    Args:
        open_graph: Function that joins the graph.
        world: Preset of the world.
        seconds: Longest drive to each goal [s].
        body: Body and laser.
        settings: Settings of the robot.
        seed: Seed of the drive.
        console: Console to print to.
    """
    from andabata.app.live import run_robot
    from andabata.assembly.simulated_robot import SimulatedRobotConfig

    config = settings.resolve(SimulatedRobotConfig, body.base())
    data = run_robot(open_graph, world, seed, config, seconds, console)
    console.result(data, f"{', '.join(data['outcomes'])} after {data['simulated_s']:.1f} s")
