"""The whole chain once, small: clouds, forest, a short curriculum, a drive, a judgement."""

import time
from pathlib import Path
from typing import Any

from andabata.app.classifying import judge_forest
from andabata.app.console import Voice
from andabata.app.datasets import generate_dataset
from andabata.app.driving import Driven, drive_once
from andabata.app.evaluation import EvaluationConfig, Models, evaluate, summarise
from andabata.app.learning import HISTORY, LearningConfig, learn, read_history
from andabata.app.pictures import (
    confusion_picture,
    drive_picture,
    learning_picture,
    scan_picture,
    world_picture,
)
from andabata.app.report import Report
from andabata.app.runs import make_folder, write_json
from andabata.app.scanning import ScanConfig, scan_cloud
from andabata.models import shipped_forest
from andabata.records.storage import write_atomically
from andabata.tasks.clouds import CloudsConfig
from andabata.tasks.rig import RigConfig
from traversability.dataset import Split, read_manifest, split_samples
from traversability.forest import Forest
from traversability.grid import PolarGrid
from traversability.growing import ForestConfig, grow_forest

_WORLD = "natural-test"
_EPISODES = 64
_TRIALS = 2


def demonstrate(folder: Path, seed: int, workers: int, voice: Voice) -> dict[str, Any]:
    """Run the demo and return its figures and where its report lies.

    Args:
        folder: Where everything goes; an earlier demo there is replaced.
        seed: Of everything.
        workers: Processes.
        voice: Tells people what happens.
    """
    began = time.perf_counter()
    make_folder(folder)
    report = Report("andabata: from nothing to a driven path")
    figures: dict[str, Any] = {}
    forest = _classifier(folder, seed, workers, voice, report, figures)
    _learning(folder, seed, workers, voice, report, figures)
    driven = _drive(folder, seed, voice, report, figures)
    _look(driven, forest, report)
    _judgement(seed, workers, voice, report, figures)
    figures["wall_s"] = time.perf_counter() - began
    path = folder / "report.html"
    write_atomically(path, report.to_bytes())
    write_json(folder / "demo.json", figures)
    return {**figures, "report": str(path)}


def _classifier(
    folder: Path, seed: int, workers: int, voice: Voice, report: Report, figures: dict[str, Any]
) -> Forest:
    """Make labelled clouds and grow a forest on them."""
    clouds = folder / "clouds"
    counts: dict[Split, int] = {"train": 140, "validation": 42}
    with voice.progress("labelled clouds", sum(counts.values())) as step:
        generate_dataset(clouds, CloudsConfig(), counts, seed, workers, step)
    manifest = read_manifest(clouds)
    samples = split_samples(clouds, manifest, "train", PolarGrid())
    forest = grow_forest(samples, PolarGrid(), ForestConfig(), seed)
    scores = judge_forest(forest, clouds, manifest, "validation")
    figures["classifier"] = scores
    voice.say(f"classifier: balanced accuracy {scores['balanced_accuracy']:.3f} on unseen worlds")
    report.section(
        "A classifier of cells",
        f"{counts['train']} labelled clouds for training and {counts['validation']} for judging, "
        f"from other worlds; {len(samples.red)} training cells.",
    )
    report.table([{k: v for k, v in scores.items() if isinstance(v, float)}])
    report.picture(confusion_picture(scores), "Judged cells of the validation clouds")
    return forest


def _learning(
    folder: Path, seed: int, workers: int, voice: Voice, report: Report, figures: dict[str, Any]
) -> None:
    """Begin the curriculum: enough to see it learn, not enough to drive."""
    run = folder / "run"
    for file in run.glob("*"):
        file.unlink()
    config = LearningConfig(episodes=(_EPISODES, 1, 1))
    with voice.progress("episodes in the maze", _EPISODES) as step:
        result = learn(run, config, range(1), seed, workers, on_generation=lambda g: step(g.played))
    figures["learning"] = result
    report.section(
        "Learning to steer",
        f"The first {_EPISODES} episodes of stage 1, {result['steps']} control steps at "
        f"{result['steps_per_s']:.0f} a second. The shipped policy comes from the full budget.",
    )
    report.picture(learning_picture(read_history(run / HISTORY)), "Goals reached while exploring")


def _drive(
    folder: Path, seed: int, voice: Voice, report: Report, figures: dict[str, Any]
) -> Driven:
    """Drive the shipped policy through a natural world that nothing was trained on."""
    config = RigConfig()
    with voice.progress("simulated seconds", None) as step:
        driven = drive_once(_WORLD, seed, "learned", config, on_second=step)
    oracle = drive_once(_WORLD, seed, "oracle", config)
    others = {"oracle": oracle.path}
    figures["drive"] = {k: v for k, v in driven.as_dict().items() if k != "path"}
    voice.say(driven.title)
    report.section("A drive", driven.title + ", in bullet, with the shipped forest and policy.")
    picture = drive_picture(driven.world, driven.path, driven.task.goals, driven.title, others)
    write_atomically(folder / "drive.png", picture)
    report.picture(picture, "The driven path and the oracle's, on the true map")
    report.table(figures["drive"]["legs"])
    report.picture(world_picture(driven.world), "The world")
    return driven


def _look(driven: Driven, forest: Forest, report: Report) -> None:
    """Show the last cloud of the drive with its cells, judged by the shipped forest."""
    if driven.cloud is None:
        return
    scanned = scan_cloud(driven.cloud, ScanConfig(), shipped_forest())
    report.section("What the robot saw", "The last cloud of the drive, its cells and virtual scan.")
    report.picture(scan_picture(scanned, "last cloud"), "Points, cells, ranges")


def _judgement(
    seed: int, workers: int, voice: Voice, report: Report, figures: dict[str, Any]
) -> None:
    """Judge the four controllers in a few trials."""
    config = EvaluationConfig(world=_WORLD, trials=_TRIALS, seed=seed)
    with voice.progress("trials of four controllers", _TRIALS) as step:
        rows = evaluate(config, Models(), workers=workers, on_trial=lambda trial, rows: step())
    table = summarise(rows, config)
    figures["evaluation"] = table
    report.section(
        "Four controllers side by side",
        f"{_TRIALS} trials show the form of the table, not the truth: see the Wilson intervals.",
    )
    report.table(table)
