"""``andabata ros``: the navigator, or a simulated robot, in a live ROS 1 graph."""

from typing import Annotated

import typer

from andabata.app.options import (
    ConfigFile,
    Datum,
    EvaluationSeed,
    ForestFile,
    GroundClassifierFile,
    Json,
    Mountings,
    PolicyFile,
    Quiet,
    Robot,
    Sensor,
    SensorHeight,
    Set,
)

app = typer.Typer(
    help="A live ROS 1 graph: the navigator's nodes, and a simulated robot for them.",
    no_args_is_help=True,
)


@app.command()
def navigator(
    controller: Annotated[str, typer.Option(help="learned, reactive or straight.")] = "learned",
    start: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,YAW",
            help="Where the robot stands in the map, in metres and degrees; without, /initialpose "
            "or the first fix and the compass tell.",
        ),
    ] = None,
    goal: Annotated[
        str | None,
        typer.Option(metavar="X,Y", help="Where to, in metres; /goal tells others later."),
    ] = None,
    cloud: Annotated[
        str | None,
        typer.Option(help="A 3D laser's topic (PointCloud2) instead of the turning laser's two."),
    ] = None,
    seconds: Annotated[
        float | None, typer.Option(min=0.1, help="Stop after so long; without, on Ctrl-C.")
    ] = None,
    mounting: Mountings = None,
    sensor_height: SensorHeight = None,
    datum: Datum = None,
    robot: Robot = "andabata",
    forest: ForestFile = None,
    ground_classifier: GroundClassifierFile = None,
    policy: PolicyFile = None,
    config: ConfigFile = None,
    settings: Set = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Be the nodes of the paper's Figure 11: scanner, filter, virtual scan, actor, wheels."""
    import numpy as np

    from andabata.app.console import Console
    from andabata.app.datum import datum_overrides
    from andabata.app.mountings import mountings_in_words, read_mountings, with_height
    from andabata.app.settings import resolve, with_parts
    from andabata.app.usage import numbers, words
    from andabata.assembly.controllers import BLIND_CONTROLLERS, make_controller
    from andabata.assembly.simulated_robot import SimulatedRobotConfig
    from andabata.machine.pose import Pose
    from andabata.models import Models
    from andabata.records.topics import POINT_CLOUD, Topic
    from andabata.replay.datum import given_site
    from andabata.ros.graph import RosGraph
    from andabata.ros.nodes import NavigatorNode

    (name,) = words(controller, BLIND_CONTROLLERS, "--controller")[:1]
    pose = None
    if start is not None:
        x, y, degrees = numbers(start, 3, "--start")
        pose = Pose.from_euler(np.array([x, y, 0.0]), 0.0, 0.0, float(np.deg2rad(degrees)))
    target = np.array(numbers(goal, 2, "--goal")) if goal is not None else None
    console = Console(quiet, as_json)
    mountings = read_mountings(mounting or ())
    overrides = (*with_height(settings, sensor_height), *datum_overrides(datum))

    def configure(base: SimulatedRobotConfig) -> SimulatedRobotConfig:
        return resolve(SimulatedRobotConfig, config, overrides, base)

    resolved = configure(with_parts(SimulatedRobotConfig, "utm-30lx", robot))
    models = Models.load(forest, ground_classifier, policy)
    driver = make_controller(name, None, resolved, models)
    laser = Topic(cloud, cloud, POINT_CLOUD, None) if cloud else None
    graph = RosGraph("andabata")
    try:
        node = NavigatorNode(
            graph,
            resolved,
            models.forest,
            driver,
            laser,
            mountings,
            given_site(configure),
            console.status,
        )
        if target is not None:
            node.set_goal(target)
        with console.progress("seconds", None) as step:
            data = node.run(pose, seconds, lambda: step(1))
    finally:
        graph.close()
    text = (
        f"{data['commands']} commands, {data['scans']} virtual scans, {data['missed_ticks']} ticks "
        f"missed; the filter is {data['health']}\n{mountings_in_words(data['frames'])}"
    )
    console.result(data, "\n".join([text, *(f"remark: {r}" for r in data["remark_texts"])]))


@app.command()
def robot(
    world: Annotated[str, typer.Option(help="World preset.")] = "natural-test",
    seconds: Annotated[
        float, typer.Option(min=0.1, help="Longest drive to each goal, in seconds.")
    ] = 300.0,
    sensor: Sensor = "utm-30lx",
    body: Annotated[
        str, typer.Option("--robot", help="Body: andabata (the paper's), husky or jackal.")
    ] = "andabata",
    seed: EvaluationSeed = 0,
    config: ConfigFile = None,
    settings: Set = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Be a simulated robot: publish its senses in real time, obey /wheel_speed_cmd."""
    import numpy as np

    from andabata.app.console import Console
    from andabata.app.settings import resolve, with_parts
    from andabata.assembly.simulated_robot import SimulatedRobotConfig
    from andabata.ros.graph import RosGraph
    from andabata.ros.nodes import RobotNode
    from andabata.tasks.episode_monitor import TerminationConfig
    from worlds.scenes import SceneCache
    from worlds.splits import evaluation_world

    console = Console(quiet, as_json)
    resolved = resolve(
        SimulatedRobotConfig, config, settings or (), with_parts(SimulatedRobotConfig, sensor, body)
    )
    scene = SceneCache(1).get(world, evaluation_world(seed, 0))
    graph = RosGraph("andabata_robot")
    try:
        node = RobotNode(graph, scene, resolved)
        rules = TerminationConfig(time_limit=seconds, stuck_time=max(seconds, 20.0))
        with console.progress("seconds", None) as step:
            data = node.run(
                scene.world.tasks[0], np.random.default_rng([seed, 0, 1]), rules, lambda: step(1)
            )
    finally:
        graph.close()
    console.result(data, f"{', '.join(data['outcomes'])} after {data['simulated_s']:.1f} s")
