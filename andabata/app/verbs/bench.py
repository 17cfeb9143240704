"""``andabata bench``: accuracy and speed, ours and the peers that are installed, in one run."""

from pathlib import Path
from typing import Annotated, Any

import typer

from andabata.app.options import (
    ConfigFile,
    EvaluationSeed,
    ForestFile,
    Json,
    Quiet,
    Robot,
    Seed,
    Set,
    Workers,
)
from worlds.splits import EVALUATIONS

app = typer.Typer(help="Accuracy and speed, ours and the peers'.", invoke_without_command=True)


@app.callback()
def speed(
    context: typer.Context,
    world: Annotated[str, typer.Option(help="Preset of the world.")] = "natural",
    runs: Annotated[int, typer.Option(min=1, help="Turns, whose median counts.")] = 5,
    seconds: Annotated[
        float, typer.Option(min=0, help="Seconds that a turn takes at least.")
    ] = 0.3,
    only: Annotated[str, typer.Option(help="Kinds of work whose name holds this.")] = "",
    out: Annotated[Path | None, typer.Option(help="Picture to write, PNG.")] = None,
    seed: EvaluationSeed = 0,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Compare speed with every peer that is installed: one scene, in turns, in one run.

    Without a command. Peers come with `make peers`; those that are missing are named and left out.
    """
    if context.invoked_subcommand is not None:
        return
    from andabata.app.console import Console, table_of
    from andabata.app.plots.bench import speed_picture
    from andabata.bench.speed import race, races
    from andabata.records import atomic_io

    console = Console(quiet, as_json)
    rows: list[dict[str, Any]] = []
    names = []
    for contest in races(world, seed):
        names.append(contest.name)
        if only in contest.name:
            console.status(contest.name)
            rows += race(contest, runs, seconds, console.status)
    if not rows:
        raise ValueError(f"only: expected part of one of {', '.join(names)}, got {only!r}")
    if out is not None:
        atomic_io.write(out, speed_picture(rows))
    table = [
        {
            "work": row["name"],
            "who": row["subject"],
            "speed": f"{row['value']:.4g} {row['unit']}",
            "of ours": f"{row['ratio_to_ours']:.3g}",
            "least to most": f"{row['low']:.4g} to {row['high']:.4g}",
        }
        for row in rows
    ]
    console.result({"rows": rows}, table_of(table, f"medians of {runs} turns"))


@app.command()
def perception(
    clouds: Annotated[Path, typer.Option(help="Data set whose validation split judges.")],
    tune_on: Annotated[
        Path | None,
        typer.Option(help="Data set on whose validation split the peers are tuned."),
    ] = None,
    forest: ForestFile = None,
    points: Annotated[
        int, typer.Option(min=0, help="Training clouds of the point classifier; 0 leaves it out.")
    ] = 300,
    tuning: Annotated[int, typer.Option(min=1, help="Clouds that the peers are tuned on.")] = 42,
    sides: Annotated[
        int, typer.Option(min=0, help="Sides that hazards are seen from; 0 leaves them out.")
    ] = 4,
    seed: Seed = 0,
    workers: Workers = 2,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Compare the cell classifier with its peers on the same clouds, and show it hazards.

    Without `--tune-on` the judging clouds' own training split tunes. Peers that are not installed
    (extra `peers`) are named and left out.
    """
    from andabata.app.console import Console
    from andabata.bench.perception import OURS, Bench, compare, judge_hazards, tune
    from andabata.bench.perception import train_point_classifier as train_points
    from andabata.bench.perception_peers import PEERS
    from andabata.datasets.hazard_suite import hazard_cases
    from andabata.models import shipped_forest
    from traversability.dataset import DatasetError, read_clouds, read_manifest
    from traversability.forest import Forest

    console = Console(quiet, as_json)
    loaded = Forest.load(forest) if forest else shipped_forest()
    manifest = read_manifest(clouds)
    source, split = (tune_on, "validation") if tune_on else (clouds, "train")
    source_manifest = read_manifest(source)
    tuned: list[tuple[str, tuple[tuple[str, Any], ...]]] = []
    tuning_clouds = list(read_clouds(source, source_manifest, split))  # type: ignore[arg-type]
    if not tuning_clouds:
        raise DatasetError(
            f"{source}: expected clouds of the {split} split to tune on, got none; see --tune-on"
        )
    tuning_clouds = tuning_clouds[:: max(1, len(tuning_clouds) // tuning)][:tuning]
    for peer in PEERS:
        try:
            settings = tune(peer, tuning_clouds, loaded.grid)
        except ImportError as error:
            console.status(f"{peer.name}: left out, {error.name} is not installed (extra `peers`)")
            continue
        console.status(f"{peer.name}: {settings}")
        tuned.append((peer.name, tuple(settings.items())))
    trained = None
    if points:
        console.status(f"growing the point classifier on {points} clouds")
        trained = train_points(source, source_manifest, loaded.grid, points, seed)
    bench = Bench(loaded.to_bytes(), trained, tuple(tuned))
    total = len(manifest.of("validation"))
    with console.progress("clouds", total) as step:
        scores = compare(bench, clouds, manifest, workers, step)
    hazards = []
    if sides:
        with console.progress("hazards", len(list(hazard_cases(sides)))) as step:
            hazards = judge_hazards(bench.forest, sides, 0, workers, step)
    rows = _rows(scores, scores[OURS])
    data = {
        "rows": rows,
        "subjects": scores,
        "hazards": hazards,
        "settings": {name: dict(settings) for name, settings in tuned},
        "clouds": total,
    }
    console.result(data, _tables(scores, hazards))


@app.command()
def localization(
    world: Annotated[str, typer.Option(help="World preset of the drives.")] = "natural-test",
    drives: Annotated[
        int, typer.Option(min=1, max=EVALUATIONS, help="Drives, each in a world of its own.")
    ] = 20,
    rides: Annotated[
        int, typer.Option(min=0, help="Rides of each row of the error-against-speed curve.")
    ] = 4,
    seed: EvaluationSeed = 0,
    workers: Workers = 2,
    config: ConfigFile = None,
    settings: Set = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Judge the filter on whole drives, and what motion does to clouds and virtual scans."""
    from andabata.app.console import Console
    from andabata.app.settings import resolve
    from andabata.assembly.simulated_robot import SimulatedRobotConfig
    from andabata.bench.localization import summarise_tracks, track_drives
    from andabata.bench.motion import GROUNDS, SPEEDS, TURNS, ride_clouds

    console = Console(quiet, as_json)
    resolved = resolve(SimulatedRobotConfig, config, settings or ())
    with console.progress("drives", drives) as step:
        tracked = track_drives(world, drives, seed, resolved, workers, step)
    figures = summarise_tracks(tracked)
    rows: list[dict[str, Any]] = []
    if rides:
        total = rides * len(GROUNDS) * len(SPEEDS) * len(TURNS)
        with console.progress("rides", total) as step:
            rows = ride_clouds(resolved, rides, seed, workers, step)
    units = {"m": "m", "deg": "deg"}
    data = {
        "rows": [
            {
                "name": name,
                "subject": "andabata" if "alone" not in name else name.split("_", 1)[0],
                "value": value,
                "unit": units.get(name.rsplit("_", 1)[-1], "1"),
                "ratio_to_ours": None,
                "runs": drives,
            }
            for name, value in figures.items()
            if isinstance(value, float)
        ],
        "localization": figures,
        "motion": rows,
    }
    console.result(data, _localization_text(figures, rows))


def _localization_text(figures: dict[str, Any], rows: list[dict[str, Any]]) -> str:
    """Return the tables as text."""
    low, high = figures["nees_band"]
    lines = [
        f"{figures['drives']} drives, {figures['goals']} goals reached by the oracle",
        f"position  rms {figures['position_rms_m']:.2f} m, 95 % within "
        f"{figures['position_95_m']:.2f} m (GNSS alone: rms {figures['gnss_alone_rms_m']:.2f} m)",
        f"heading   rms {figures['heading_rms_deg']:.2f} deg (compass alone: "
        f"{figures['compass_alone_rms_deg']:.2f} deg)",
    ]
    if figures["nees_mean"] is not None:
        lines.append(
            f"NEES      {figures['nees_mean']:.2f} (band {low:.2f} to {high:.2f}; inside at "
            f"{figures['nees_inside']:.0%} of the instants)"
        )
    if rows:
        lines += [
            "",
            "ground         turn  speed  points' error, median and 95 %   scans that agree",
        ]
    for row in rows:
        if not row["clouds"]:
            continue
        lines.append(
            f"{row['ground']:13} {row['turn']:5.1f} {row['speed']:6.1f}"
            f"  {row['error_median_m']:.3f} {row['error_95_m']:.3f} m"
            f" (skewed {row['skewed_median_m']:.3f} {row['skewed_95_m']:.3f})"
            f"   {row['scan_agrees']:.3f} (skewed {row['skewed_scan_agrees']:.3f}, true pose "
            f"{row['true_scan_agrees']:.3f}, standing twice {row['standing_scan_agrees']:.3f})"
        )
    return "\n".join(lines)


@app.command()
def vehicle(
    robot: Robot = "andabata",
    seed: Seed = 0,
    picture: Annotated[
        Path | None, typer.Option(help="PNG file with the turning and the slopes.")
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Measure a body in the reference plant: turning, slopes, obstacles, tipping over."""
    from rich.console import Group

    from andabata.app.console import Console, table_of
    from andabata.app.plots.bench import vehicle_picture
    from andabata.bench.vehicle import obstacles, plants, slopes, tipping, turning
    from andabata.machine.robot import RobotModel
    from andabata.records import atomic_io

    console, model = Console(quiet, as_json), RobotModel.load(robot)
    found: dict[str, Any] = {"robot": robot}
    with console.progress("parts", 5) as step:
        for name, part in (
            ("turning", turning),
            ("slopes", slopes),
            ("obstacles", obstacles),
            ("tipping", tipping),
        ):
            found[name] = part(model)
            step()
        found["plants"] = plants(model, seed)
        step()
    if picture is not None:
        atomic_io.write(picture, vehicle_picture(found))
    tables = [
        table_of(found["turning"], f"{robot}: yaw rate achieved over commanded"),
        table_of(found["slopes"], "slopes"),
        table_of(found["obstacles"], "10 s towards something 1.5 m ahead"),
        table_of([found["tipping"] | found["plants"]], "tipping over, and the two plants apart"),
    ]
    console.result(found, Group(*tables))


@app.command()
def chain(
    world: Annotated[str, typer.Option(help="World preset.")] = "natural",
    controller: Annotated[str, typer.Option(help="learned, reactive or straight.")] = "learned",
    plants: Annotated[str, typer.Option(help="kinematic, bullet or both.")] = "kinematic,bullet",
    beams: Annotated[str, typer.Option(help="Beams of a sweep.")] = "1081,541",
    steps: Annotated[int, typer.Option(min=10, help="Control steps of a run.")] = 300,
    runs: Annotated[int, typer.Option(min=1, help="Runs, whose median counts.")] = 3,
    seed: EvaluationSeed = 0,
    config: ConfigFile = None,
    settings: Set = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Say where the time of a control step goes, from plant to policy."""
    from andabata.app.console import Console, table_of
    from andabata.app.settings import resolve
    from andabata.app.usage import words
    from andabata.assembly.controllers import BLIND_CONTROLLERS
    from andabata.assembly.simulated_robot import SimulatedRobotConfig
    from andabata.bench.chain import bench_chain

    (name,) = words(controller, BLIND_CONTROLLERS, "--controller")[:1]
    console = Console(quiet, as_json)
    chosen = [
        (plant, count)
        for plant in words(plants, ("kinematic", "bullet"), "--plants")
        for count in words(beams, ("1081", "541", "271"), "--beams")
    ]
    rows: list[dict[str, Any]] = []
    with console.progress("runs", runs * len(chosen)) as step:
        for plant, count in chosen:
            overrides = [f"plant={plant}", f"sensing.lidar.beams={count}", *(settings or ())]
            resolved = resolve(SimulatedRobotConfig, config, overrides)
            rows += bench_chain(resolved, world, seed, steps, runs, name, lambda: step(1))
    names = list(dict.fromkeys(row["name"] for row in rows))
    values = {(row["name"], row["subject"]): row["value"] for row in rows}
    subjects = list(dict.fromkeys(row["subject"] for row in rows))
    table = [{"stage": n} | {s: f"{values[n, s]:.0f}" for s in subjects} for n in names]
    console.result({"rows": rows}, table_of(table, "us of a control step of 0.1 s, one core"))


_FIGURES = ("balanced_accuracy", "f1_red", "recall", "f1_points", "ms")


def _rows(scores: dict[str, Any], ours: dict[str, Any]) -> list[dict[str, Any]]:
    """Return one row for each figure of each subject."""
    return [
        {
            "name": name,
            "subject": subject,
            "value": found[name],
            "unit": "ms" if name == "ms" else "1",
            "ratio_to_ours": found[name] / ours[name] if name in ours else None,
            "runs": sum(found["confusion"].values()),
        }
        for subject, found in scores.items()
        for name in _FIGURES
        if name in found
    ]


def _tables(scores: dict[str, Any], hazards: list[dict[str, Any]]) -> str:
    """Return the tables as text."""
    kinds = sorted(next(iter(scores.values()))["worlds"])
    lines = ["subject            bal.acc  F1 red  recall  points      ms  " + "  ".join(kinds)]
    for subject, found in scores.items():
        points = f"{found['f1_points']:7.3f}" if "f1_points" in found else "      -"
        worlds = "  ".join(f"{found['worlds'][kind]:{len(kind)}.3f}" for kind in kinds)
        lines.append(
            f"{subject:18} {found['balanced_accuracy']:7.3f} {found['f1_red']:7.3f} "
            f"{found['recall']:7.3f} {points} {found['ms']:7.2f}  {worlds}"
        )
    if hazards:
        lines += [
            "",
            "hazard, within 4 m          clouds  red cells  recall   clear  stopped  alarms",
        ]
    for row in hazards:
        figures = [row[name] for name in ("recall", "recall_clear", "stopped", "false_alarms")]
        shown = "  ".join("     -" if figure is None else f"{figure:6.3f}" for figure in figures)
        lines.append(f"{row['hazard']:26} {row['clouds']:7d} {row['red_cells']:10d}  {shown}")
    return "\n".join(lines)
