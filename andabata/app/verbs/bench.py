"""``andabata bench``: accuracy and speed, ours and the installed peers', in one run."""

from pathlib import Path
from typing import Annotated, cast, get_args

import typer

from andabata.app.command import command, typed_options
from andabata.app.options.models import ForestOptions
from andabata.app.options.release import ReleaseOptions, refuse_beside_release
from andabata.app.options.shared import (
    ConsoleOptions,
    EvaluationSeed,
    RealityLevel,
    Robot,
    Seed,
    SettingsOptions,
    Workers,
    reality_level,
)
from andabata.machine.plants import Plant, available_plants, check_plant, default_plant
from worlds.splits import DEVELOPMENT_SEED, EVALUATIONS

app = typer.Typer(invoke_without_command=True)


@app.callback()
@command
def speed(
    *,
    context: typer.Context,
    world: Annotated[str, typer.Option(help="World preset.")] = "natural",
    runs: Annotated[int, typer.Option(min=1, help="Number of turns; medians are shown.")] = 5,
    seconds: Annotated[float, typer.Option(min=0, help="Seconds of a turn, at least.")] = 0.3,
    only: Annotated[str, typer.Option(help="Part of the names of the kinds of work to run.")] = "",
    out: Annotated[Path | None, typer.Option(help="Picture to write, PNG.")] = None,
    seed: EvaluationSeed = DEVELOPMENT_SEED,
    output: ConsoleOptions,
) -> None:
    """Measure accuracy and speed, ours and the peers'.

    Without a command: compare speed with every installed peer, in the same scene, in turns, in one
    run. Peers come with the extra `peers`; those that are missing are named and left out.

    Examples:
        andabata bench
        andabata bench --only filter --runs 3
        andabata bench --world hill --seed 4 --json
        andabata bench --only laser --seconds 2 --out speed.png
    """
    if context.invoked_subcommand is not None:
        return
    from andabata.app.console import table_of
    from andabata.bench.speed import bench_speed, speed_table
    from andabata.report.plots.axes import png
    from andabata.report.plots.bench import speed_figure
    from andabata.runs import atomic_io

    console = output.console()
    rows = bench_speed(world, seed, runs, seconds, only, console)
    if out is not None:
        atomic_io.write(out, png(speed_figure(rows)))
    console.result({"rows": rows}, table_of(speed_table(rows), f"medians of {runs} turns"))


@app.command()
@command
def perception(
    *,
    clouds: Annotated[Path, typer.Option(help="Data set whose validation split evaluates.")],
    tune_on: Annotated[
        Path | None,
        typer.Option(help="Data set on whose validation split the peers are tuned."),
    ] = None,
    forest: ForestOptions,
    points: Annotated[
        int,
        typer.Option(min=0, help="Training clouds of the point classifier; 0 leaves it out."),
    ] = 300,
    tuning: Annotated[int, typer.Option(min=1, help="Clouds that the peers are tuned on.")] = 42,
    sides: Annotated[
        int, typer.Option(min=0, help="Sides that hazards are seen from; 0 leaves them out.")
    ] = 4,
    seed: Seed = DEVELOPMENT_SEED,
    workers: Workers = 2,
    output: ConsoleOptions,
) -> None:
    """Compare the cell classifier with its peers on the same clouds and on hazards.

    Without `--tune-on` the peers are tuned on the training split of the same data set. Peers that
    are not installed (extra `peers`) are named and left out.

    Examples:
        andabata bench perception --clouds data/clouds
        andabata bench perception --clouds data/clouds --sides 0 --json
        andabata bench perception --clouds test --tune-on data/clouds
        andabata bench perception --clouds data/clouds --forest f/forest.npz
    """
    from andabata.app.console import table_of
    from andabata.bench.hazards import hazard_table
    from andabata.bench.perception import bench_perception, score_table, world_table

    console = output.console()
    data = bench_perception(
        forest.load(),
        clouds,
        tune_on=tune_on,
        tuning=tuning,
        points=points,
        sides=sides,
        seed=seed,
        workers=workers,
        reporter=console,
    )
    tables = [
        table_of(score_table(data["subjects"]), f"{data['clouds']} clouds"),
        table_of(world_table(data["subjects"]), "F1 by kind of world"),
    ]
    if sides:
        tables.append(table_of(hazard_table(data["hazards"]), "hazards within 4 m"))
    console.result(data, *tables)


@app.command()
@command
def fields(
    *,
    context: typer.Context,
    count: Annotated[
        int, typer.Option(min=4, help="Number of fields, and of cases of free ground.")
    ] = 200,
    picture: Annotated[
        Path | None, typer.Option(help="Picture of one case of each kind to write, PNG.")
    ] = None,
    forest: ForestOptions,
    judging: ReleaseOptions,
    seed: Seed = 1,
    workers: Workers = 2,
    output: ConsoleOptions,
) -> None:
    """Score the cell classifier on fields of plants, and on ground that must stay free.

    Fields are 0.2 to 1.2 m high, of three densities, with abrupt and gradual edges, gaps, trunks
    and slopes. Free ground is level, without any noise, or has grass, litter, undulations or a
    path with verges. Lasers and their heights are drawn. All seeds develop; with --release a suite
    of its own judges, once for each release.

    Examples:
        andabata bench fields
        andabata bench fields --count 20 --json
        andabata bench fields --forest f/forest.npz
        andabata bench fields --count 12 --picture fields.png
    """
    from andabata.app.console import table_of
    from andabata.bench.fields import evaluate_fields, field_examples, field_table
    from andabata.evaluation.judging import judged_trials, judging_seed
    from andabata.report.plots.axes import png
    from andabata.report.plots.perception import fields_figure
    from andabata.runs import atomic_io

    release = judging.named()
    refuse_beside_release(release, typed_options(context), "seed", "picture")
    if release is not None:
        judged_trials(release, count, "--count")
        seed = judging_seed(release)
    run = judging.run("bench fields", f"suite {seed}, {count} fields")
    console, loaded = output.console(), forest.load()
    if run is not None:
        run = run.begin()
    with console.progress("clouds", 2 * count) as step:
        rows = evaluate_fields(loaded.to_bytes(), count, seed, workers, step, release)
    if picture is not None:
        examples = field_examples(loaded.to_bytes(), count, seed)
        atomic_io.write(picture, png(fields_figure(examples, loaded.grid)))
    title = f"{count} fields and as many clouds of free ground, seed {seed}"
    data = {"rows": rows, "seed": seed}
    if run is not None:
        data["ledger"] = run.finish().model_dump(mode="json")
    console.result(data, table_of(field_table(rows), title))


@app.command()
@command
def localization(
    *,
    world: Annotated[str, typer.Option(help="World preset of the drives.")] = "natural-test",
    drives: Annotated[
        int,
        typer.Option(min=1, max=EVALUATIONS, help="Number of drives, each in a world of its own."),
    ] = 20,
    rides: Annotated[
        int, typer.Option(min=0, help="Rides of each row of the error-against-speed curve.")
    ] = 4,
    outages: Annotated[
        bool,
        typer.Option("--outages", help="What the filter makes of fixes that fail, jump or lie."),
    ] = False,
    reality: RealityLevel = "ideal",
    settings: SettingsOptions,
    seed: EvaluationSeed = DEVELOPMENT_SEED,
    workers: Workers = 2,
    output: ConsoleOptions,
) -> None:
    """Measure the filter on whole drives, and what motion does to clouds and virtual scans.

    Examples:
        andabata bench localization
        andabata bench localization --world hill --drives 100 --rides 0
        andabata bench localization --set plant=kinematic --json
        andabata bench localization --reality field --rides 0
        andabata bench localization --outages --rides 0
    """
    from andabata.app.console import table_of
    from andabata.app.driven_plant import announce_plant
    from andabata.assembly.simulated_robot import SimulatedRobotConfig
    from andabata.bench.localization import bench_localization, localization_table
    from andabata.bench.motion import agreement_table, error_table
    from andabata.bench.outages import bench_outages, outage_table

    base = SimulatedRobotConfig(reality=reality_level(reality))
    console, config = output.console(), settings.resolve(SimulatedRobotConfig, base)
    announce_plant(config.plant, console)
    data = bench_localization(config, world, drives, rides, seed, workers, console)
    data |= {"reality": config.reality.name}
    if outages:
        data["outages"] = bench_outages(config, world, drives, seed, workers, console)
    tables = [table_of(localization_table(data["localization"]), "filter and single sensors")]
    if outages:
        tables.append(table_of(outage_table(data["outages"]), "fixes that fail, jump or lie"))
    if rides:
        motion = data["motion"]
        tables.append(table_of(error_table(motion), "errors of clouds in motion, median and 95 %"))
        tables.append(table_of(agreement_table(motion), "agreement of virtual scans in motion"))
    console.result(data, *tables)


@app.command()
@command
def movers(
    *,
    lasers: Annotated[
        str,
        typer.Option(help="Comma-separated: planar, BARN's laser in rooms; off-road sensors."),
    ] = "planar,utm-30lx,os1-64",
    count: Annotated[int, typer.Option(min=1, help="Number of worlds of each kind.")] = 3,
    seconds: Annotated[float, typer.Option(min=0.1, help="Duration of a drive [s].")] = 60.0,
    settings: SettingsOptions,
    seed: EvaluationSeed = DEVELOPMENT_SEED,
    workers: Workers = 2,
    output: ConsoleOptions,
) -> None:
    """Compare the tracks of movers with the truth, by range and speed: found, missed, false.

    Off-road lasers drive in natural-walkers and natural-test, the planar one in rooms with and
    without movers and in BARN fields of moving cylinders. A moment counts when a mover has been in
    sight for 1 s within 5 m; a track that is never near one is false. The first world has --seed.

    Examples:
        andabata bench movers
        andabata bench movers --lasers planar --count 10 --json
        andabata bench movers --lasers os1-64,utm-30lx --seconds 120
        andabata bench movers --set circles.min_speed=0.2
    """
    from andabata.app.console import table_of
    from andabata.bench.movers import (
        LASERS,
        BenchMoversConfig,
        bench_movers,
        class_table,
        drive_table,
    )
    from andabata.configuration.usage import words
    from andabata.machine.lidar_models import sensor_names

    known = (*LASERS, *(name for name in sensor_names() if name not in LASERS))
    names = words(lasers, known, "--lasers")
    config, console = settings.resolve(BenchMoversConfig), output.console()
    data = bench_movers(config, names, count, seconds, seed, workers, console)
    console.result(
        data,
        table_of(class_table(data["ranges"], "range_m", "range [m]"), "movers in sight, by range"),
        table_of(class_table(data["speeds"], "speed_m_s", "speed [m/s]"), "the same, by speed"),
        table_of(drive_table(data["drives"]), "tracks, false ones, and the cost of a step"),
    )


@app.command()
@command
def vehicle(
    *,
    robot: Robot = "andabata",
    plant: Annotated[
        str, typer.Option(help="Plant: bullet, mujoco, wheels or kinematic.")
    ] = default_plant(),
    picture: Annotated[
        Path | None, typer.Option(help="Picture of turning and slopes to write, PNG.")
    ] = None,
    seed: Seed = 0,
    output: ConsoleOptions,
) -> None:
    """Measure a body in a plant: turning, slopes, obstacles, tipping over.

    The other plants are compared with bullet, whichever is measured; all drive over relief,
    kerbs, roots, stems and plants. Bullet and mujoco are left out where they are not installed.

    Examples:
        andabata bench vehicle
        andabata bench vehicle --plant wheels
        andabata bench vehicle --plant mujoco --json
        andabata bench vehicle --robot husky --picture husky.png
        andabata bench vehicle --robot jackal --json
    """
    from andabata.app.console import table_of
    from andabata.app.driven_plant import announce_plant
    from andabata.bench.vehicle import bench_vehicle, vehicle_tables
    from andabata.configuration.usage import one_word
    from andabata.machine.robot import RobotModel
    from andabata.report.plots.axes import png
    from andabata.report.plots.bench import vehicle_figure
    from andabata.runs import atomic_io

    console, model = output.console(), RobotModel.load(robot)
    name = cast(Plant, one_word(plant, get_args(Plant), "--plant"))
    announce_plant(name, console)
    with console.progress("parts", 6) as step:
        measurements = bench_vehicle(model, seed, step, name)
    data = {"robot": robot, "plant": name, **measurements}
    if picture is not None:
        atomic_io.write(picture, png(vehicle_figure(data)))
    console.result(data, *(table_of(rows, title) for title, rows in vehicle_tables(data)))


@app.command()
@command
def chain(
    *,
    world: Annotated[str, typer.Option(help="World preset.")] = "natural",
    controller: Annotated[
        str, typer.Option(help="policy+planner, policy, planner, reactive or another.")
    ] = "policy+planner",
    plants: Annotated[
        str, typer.Option(help="Plants: kinematic, wheels, bullet, mujoco.")
    ] = ",".join(name for name in reversed(available_plants()) if name != "mujoco"),
    beams: Annotated[str, typer.Option(help="Beams of a sweep: 1081, 541, 271.")] = "1081,541",
    robots: Annotated[str, typer.Option(help="Numbers of robots in the world: 1, 4, 16.")] = "1",
    steps: Annotated[int, typer.Option(min=10, help="Number of control steps of a run.")] = 300,
    runs: Annotated[int, typer.Option(min=1, help="Number of runs; medians are shown.")] = 3,
    settings: SettingsOptions,
    seed: EvaluationSeed = DEVELOPMENT_SEED,
    output: ConsoleOptions,
) -> None:
    """Measure where the time of a control step goes, from plant to policy.

    Examples:
        andabata bench chain
        andabata bench chain --plants kinematic --beams 541 --runs 5
        andabata bench chain --controller reactive --world maze --json
        andabata bench chain --set localizer=truth
    """
    from andabata.app.console import table_of
    from andabata.assembly.controllers import MAPLESS_CONTROLLERS
    from andabata.assembly.simulated_robot import SimulatedRobotConfig
    from andabata.bench.chain import bench_chains, stage_table
    from andabata.configuration.settings import resolve
    from andabata.configuration.usage import words

    (name,) = words(controller, MAPLESS_CONTROLLERS, "--controller", takes_own=True)[:1]
    given = settings.settings or []
    configs = [
        resolve(
            SimulatedRobotConfig,
            settings.config,
            [f"plant={plant}", f"sensing.lidar.beams={count}", *given],
        )
        for plant in words(plants, get_args(Plant), "--plants")
        for count in words(beams, ("1081", "541", "271"), "--beams")
    ]
    console = output.console()
    for config in configs:
        check_plant(config.plant)
    crowds = [int(count) for count in words(robots, ("1", "4", "16"), "--robots")]
    with console.progress("runs", runs * len(configs) * len(crowds)) as step:
        rows = bench_chains(configs, crowds, world, seed, steps, runs, name, step)
    table = table_of(stage_table(rows), "us of a control step of 0.1 s, one core")
    console.result({"rows": rows}, table)
