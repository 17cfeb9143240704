"""``andabata bench``: accuracy and speed, ours and the peers that are installed, in one run."""

from pathlib import Path
from typing import Annotated, Any

import typer

from andabata.app.options import ForestFile, Json, Quiet, Seed, Workers

app = typer.Typer(help="Accuracy and speed, ours and the peers'.", no_args_is_help=True)


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
    from andabata.app.console import Voice
    from andabata.app.peers import PEERS
    from andabata.app.perception_bench import OURS, Bench, compare, judge_hazards, tune
    from andabata.app.perception_bench import train_point_classifier as train_points
    from andabata.models import shipped_forest
    from andabata.tasks.hazards import hazard_cases
    from traversability.dataset import DatasetError, read_clouds, read_manifest
    from traversability.forest import Forest

    voice = Voice(quiet, as_json)
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
            voice.say(f"{peer.name}: left out, {error.name} is not installed (extra `peers`)")
            continue
        voice.say(f"{peer.name}: {settings}")
        tuned.append((peer.name, tuple(settings.items())))
    trained = None
    if points:
        voice.say(f"growing the point classifier on {points} clouds")
        trained = train_points(source, source_manifest, loaded.grid, points, seed)
    bench = Bench(loaded.to_bytes(), trained, tuple(tuned))
    total = sum(entry.split == "validation" for entry in manifest.clouds)
    with voice.progress("clouds", total) as step:
        scores = compare(bench, clouds, manifest, workers, step)
    hazards = []
    if sides:
        with voice.progress("hazards", len(list(hazard_cases(sides)))) as step:
            hazards = judge_hazards(bench.forest, sides, 0, workers, step)
    rows = _rows(scores, scores[OURS])
    data = {
        "rows": rows,
        "subjects": scores,
        "hazards": hazards,
        "settings": {name: dict(settings) for name, settings in tuned},
        "clouds": total,
    }
    voice.result(data, _tables(scores, hazards))


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
