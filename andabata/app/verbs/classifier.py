"""``andabata classifier``: classifiers of polar cells and of ground cells."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from andabata.app.command import command
from andabata.app.options.models import ForestOptions
from andabata.app.options.recording import RecordedRobot, RecordingOptions
from andabata.app.options.shared import ConsoleOptions, Seed, SettingsOptions

app = typer.Typer(
    help="The classifiers: train, adapt, evaluate, ground, export.", no_args_is_help=True
)


class SplitName(StrEnum):
    """Splits of a data set."""

    TRAIN = "train"
    VALIDATION = "validation"


class Recipe(StrEnum):
    """Ready-made settings of the training."""

    BEST = "best"
    PAPER = "paper"


Clouds = Annotated[Path, typer.Option("--clouds", help="Folder of `clouds generate`.")]
AdaptationFile = Annotated[
    Path | None,
    typer.Option(help="TOML file with settings of labels, correction and held-out part."),
]
More = Annotated[
    list[Path] | None,
    typer.Option("--and", help="Train on this folder's clouds, too; may be repeated."),
]


@app.command()
@command
def train(
    *,
    clouds: Clouds,
    out: Annotated[Path, typer.Option(help="Folder for forest.npz and the scores.")],
    recipe: Annotated[
        Recipe,
        typer.Option(help="All features and boosted trees, or the paper's five and random forest."),
    ] = Recipe.BEST,
    more: More = None,
    add: Annotated[
        Path | None, typer.Option(help="TOML manifest of foreign labelled clouds to learn from.")
    ] = None,
    settings: SettingsOptions,
    seed: Seed = 0,
    output: ConsoleOptions,
) -> None:
    """Train a forest on the training clouds and evaluate it on the validation clouds.

    Examples:
        andabata classifier train --clouds data/clouds --out data/forest
        andabata classifier train --clouds data/clouds --and more --out f --seed 1
        andabata classifier train --clouds data/clouds --out p --recipe paper
        andabata classifier train --clouds data/clouds --out f --set trees=200
        andabata classifier train --clouds data/clouds --out f --add mine.toml
    """
    from andabata.app.jobs.classifier_training import train_cell_classifier
    from andabata.evaluation.classifier import tables
    from andabata.runs.lock import locked_folder
    from traversability.forest_training import PAPER_GRID, PAPER_RECIPE, ForestConfig
    from traversability.grid import PolarGrid

    base, grid = (PAPER_RECIPE, PAPER_GRID) if recipe is Recipe.PAPER else (None, PolarGrid())
    config, console = settings.resolve(ForestConfig, base), output.console()
    folders = (clouds, *(more or ()))
    with locked_folder(out):
        data, samples = train_cell_classifier(folders, out, config, grid, seed, console, add)
    console.result(data, tables(data, samples))


@app.command()
@command
def adapt(
    *,
    bags: Annotated[
        list[Path], typer.Argument(help="Recordings: .bag, .mcap, .db3 or ROS 2 folders.")
    ],
    clouds: Clouds,
    out: Annotated[Path, typer.Option(help="File of the adapted forest, for --forest.")],
    more: More = None,
    adaptation: AdaptationFile = None,
    robot: RecordedRobot = None,
    recording: RecordingOptions,
    seed: Seed = 0,
    forest: ForestOptions,
    output: ConsoleOptions,
) -> None:
    """Adapt a forest to one's own ground, from recorded drives over it.

    Cells that the robot crossed without trouble are free; where it stopped under a command, slipped
    or tilted they are blocked. The last part of each recording is held out for the scores. No
    forest is written, and the exit code is 1, when recall is lost on it or on the validation
    clouds.

    Examples:
        andabata classifier adapt drive.mcap --clouds data/clouds --out mine.npz
        andabata classifier adapt a.bag b.bag --clouds c --out mine.npz --json
        andabata classifier adapt drive.bag --clouds c --out m.npz --robot husky
    """
    from andabata.app.jobs.classifier_adaptation import adapt_cell_classifier, write_adapted
    from andabata.configuration.settings import resolve
    from andabata.runs.lock import locked_file
    from andabata.training.forest_adaptation import (
        OWN,
        DriveAdaptationConfig,
        adaptation_text,
    )

    config, console = resolve(DriveAdaptationConfig, adaptation), output.console()
    options = recording.replay(robot=robot)
    folders = (clouds, *(more or ()))
    with locked_file(out):
        result, data = adapt_cell_classifier(
            bags, folders, forest.load(), options, config, seed, console
        )
        # Before the file is written or refused: the scores are the reason.
        console.result(data, adaptation_text(data))
        if data[OWN]["before"]["recall"] is None:
            console.status("no blocked cell in the held-out part: its recall is unknown")
        write_adapted(out, result, config)
    console.status(f"{out}: give it to --forest")


@app.command()
@command
def evaluate(
    *,
    clouds: Clouds,
    split: Annotated[SplitName, typer.Option(help="Split of the clouds.")] = SplitName.VALIDATION,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the scores, for `andabata report`.")
    ] = None,
    forest: ForestOptions,
    output: ConsoleOptions,
) -> None:
    """Evaluate a forest on the clouds of a folder.

    Examples:
        andabata classifier evaluate --clouds data/clouds
        andabata classifier evaluate --clouds data/clouds --split train --json
        andabata classifier evaluate --clouds data/clouds --forest f/forest.npz
        andabata classifier evaluate --clouds data/clouds --out data/scores
    """
    from andabata.app.jobs.classifier_training import write_scores
    from andabata.evaluation.classifier import score_forest, tables
    from andabata.runs.folder import describe, make_folder
    from traversability.dataset import read_manifest

    loaded, manifest = forest.load(), read_manifest(clouds)
    scores = score_forest(loaded, clouds, manifest, split.value)
    data = {**scores, "thresholds": loaded.thresholds.model_dump(), "split": split.value}
    if out is not None:
        # With its hash: other clouds may be made in the same folder.
        settings = {"clouds": str(clouds), "clouds_sha256": manifest.config_sha256, "split": split}
        about = describe("classifier evaluate", settings, manifest.seed)
        write_scores(make_folder(out), data, about)
    output.console().result(data, tables(data))


@app.command()
@command
def ground(
    *,
    clouds: Clouds,
    out: Annotated[Path, typer.Option(help="Folder for ground_classifier.npz and the scores.")],
    more: More = None,
    settings: SettingsOptions,
    seed: Seed = 0,
    output: ConsoleOptions,
) -> None:
    """Train the classifier of the local map's ground cells on the same clouds.

    Examples:
        andabata classifier ground --clouds data/clouds --out data/ground
        andabata classifier ground --clouds data/clouds --out g --set trees=200
    """
    from andabata.app.jobs.classifier_training import train_ground
    from andabata.evaluation.classifier import ground_classifier_table
    from andabata.runs.lock import locked_folder
    from traversability.cartesian.classifier import GroundClassifierConfig

    config, console = settings.resolve(GroundClassifierConfig), output.console()
    with locked_folder(out):
        data = train_ground((clouds, *(more or ())), out, config, seed, console)
    console.result(data, ground_classifier_table(data))


@app.command()
@command
def export(
    *,
    out: Annotated[Path, typer.Option(help="ONNX file to write.")],
    forest: ForestOptions,
    output: ConsoleOptions,
) -> None:
    """Write a forest as ONNX: features of cells in, probability of a blocked cell out.

    Examples:
        andabata classifier export --out forest.onnx
        andabata classifier export --forest f/forest.npz --out mine.onnx
    """
    from andabata.runs import atomic_io
    from traversability.export import forest_to_onnx

    data = forest_to_onnx(forest.load())
    atomic_io.write(out, data)
    output.console().result({"out": str(out), "bytes": len(data)}, f"{out}: {len(data)} bytes")
