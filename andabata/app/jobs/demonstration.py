"""Demonstration of the whole chain: clouds, forest, short training, a drive, an evaluation."""

import time
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from andabata.app.console import Console
from andabata.app.driven_plant import announce_plant
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.configuration.settings import resolve, with_parts
from andabata.datasets.generate import generate_dataset
from andabata.datasets.labelled_cloud import CloudsConfig
from andabata.engine_processes import ProcessEngine
from andabata.evaluation.classifier import score_forest
from andabata.evaluation.comparison import run_comparison
from andabata.evaluation.drive import Driven, drive_once
from andabata.evaluation.offroad import EvaluationConfig, OffroadComparison
from andabata.evaluation.offroad_table import summarise
from andabata.models import Models, shipped_forest
from andabata.report.about import about_section
from andabata.report.blocks import Block, Plot, Table
from andabata.report.classifier import SCORE_COLUMNS
from andabata.report.columns import several
from andabata.report.drive import ATTEMPT_COLUMNS
from andabata.report.evaluation import goals_table
from andabata.report.page import Page, Section
from andabata.report.plots.axes import png
from andabata.report.plots.drives import drive_figure, world_figure
from andabata.report.plots.perception import confusions_figure, scan_figure
from andabata.report.plots.training import learning_figure
from andabata.report.run_folders import without_paths
from andabata.runs import atomic_io
from andabata.runs.folder import describe, write_json
from andabata.runs.lock import locked_folder
from andabata.scanning.scan import ScanConfig, scan_cloud
from andabata.tasks.episode_monitor import TerminationConfig
from andabata.training.plans import TrainingPlan, load_plan
from andabata.training.run import HISTORY, learn, read_history
from traversability.dataset import Split, read_manifest, split_samples
from traversability.forest_training import ForestConfig, train_forest
from traversability.grid import PolarGrid
from traversability.scores import PAPER
from worlds.splits import EVALUATIONS

_WORLD = "natural-test"


class DemonstrationConfig(BaseModel):
    """Size of each part.

    Attributes:
        train: Number of labelled clouds for training.
        validation: Number of labelled clouds for evaluating the forest.
        trees: Number of trees of the forest, few as the clouds are few.
        episodes: Number of episodes in the maze.
        trials: Number of trials of each controller.
        time_limit: Longest drive to each goal [s].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    train: int = Field(default=140, ge=1)
    validation: int = Field(default=42, ge=1)
    trees: int = Field(default=100, ge=1)
    episodes: int = Field(default=64, ge=1)
    trials: int = Field(default=2, ge=1, le=EVALUATIONS)
    time_limit: float = Field(default=300.0, gt=0)


class Demonstration:
    """Demonstration, each part of which adds to the figures and to the report."""

    def __init__(
        self,
        config: DemonstrationConfig,
        folder: Path,
        seed: int,
        workers: int,
        console: Console,
        sensor: str,
    ) -> None:
        """Prepare a demonstration.

        Args:
            config: Size of each part.
            folder: Folder for all files; an earlier demo in it is replaced.
            seed: Seed of all parts.
            workers: Number of processes.
            console: Console that shows the progress.
            sensor: Name of the laser.
        """
        self._config = config
        self._folder, self._seed, self._workers = folder, seed, workers
        self._console, self._sensor = console, sensor
        self._sections: list[Section] = []
        self._figures: dict[str, Any] = {"sensor": sensor}

    def run(self) -> dict[str, Any]:
        """Run all parts and return the figures and the path of the report.

        Raises:
            RunLockError: If another command writes the folder.
        """
        with locked_folder(self._folder):
            return self._run()

    def _run(self) -> dict[str, Any]:
        """Run all parts in a folder that is there."""
        began = time.perf_counter()
        about = describe("demo", self._config.model_dump(mode="json"), self._seed)
        write_json(self._folder / "run.json", about)
        self._train_classifier()
        self._train_policy()
        self._show_scan(self._drive())
        self._evaluate()
        self._sections.append(about_section([self._folder]))
        self._figures["wall_s"] = time.perf_counter() - began
        path = self._folder / "report.html"
        page = Page("andabata: from nothing to a driven path", sections=self._sections)
        atomic_io.write(path, page.to_bytes())
        write_json(self._folder / "demo.json", self._figures)
        return {**self._figures, "report": str(path)}

    def _engine(self) -> ProcessEngine:
        """Return the engine of a part; its memory is free for the next one."""
        return ProcessEngine(self._workers, self._console.status)

    def _train_classifier(self) -> None:
        """Make labelled clouds and train a forest on them."""
        clouds = self._folder / "clouds"
        counts: dict[Split, int] = {
            "train": self._config.train,
            "validation": self._config.validation,
        }
        config, total = with_parts(CloudsConfig, self._sensor), sum(counts.values())
        with self._engine() as engine, self._console.progress("labelled clouds", total) as step:
            generate_dataset(clouds, config, counts, self._seed, step, engine=engine)
        manifest = read_manifest(clouds)
        samples = split_samples(clouds, manifest, "train", PolarGrid())
        # Each of few trees has to correct more than one of many.
        few = ForestConfig(trees=self._config.trees, learning_rate=0.2)
        forest = train_forest(samples, PolarGrid(), few, self._seed)
        scores = score_forest(forest, clouds, manifest, "validation")
        self._figures["classifier"] = scores
        self._console.status(
            f"classifier: balanced accuracy {scores['balanced_accuracy']:.3f} on unseen worlds"
        )
        confusion = {"ours": scores["confusion"], "the paper's": PAPER.as_dict()["confusion"]}
        caption = "Cells of the validation clouds (Table 1)"
        self._add(
            "A classifier of cells",
            f"{counts['train']} labelled clouds for training and {counts['validation']} for "
            f"validation, from other worlds; {len(samples.blocked)} training cells.",
            Table([scores], SCORE_COLUMNS),
            Plot(confusions_figure(confusion), "confusion", caption),
        )

    def _train_policy(self) -> None:
        """Begin the curriculum: enough for a learning curve, too little for a good policy."""
        run, episodes = self._folder / "run", self._config.episodes
        # A run goes into an empty folder: what an earlier demo left would be refused.
        for file in run.glob("*"):
            file.unlink()
        plan = resolve(
            TrainingPlan,
            overrides=(f"stages.Maze2D.episodes={episodes}", "validation=0"),
            base=load_plan(sensor=self._sensor),
        )
        bar = self._console.progress("episodes in the maze", episodes)
        with self._engine() as engine, bar as step:
            result = learn(
                run,
                plan,
                range(1),
                self._seed,
                engine=engine,
                on_iteration=lambda g: step(g.played),
            )
        self._figures["learning"] = result
        figure = learning_figure(read_history(run / HISTORY))
        self._add(
            "Learning to steer",
            f"The first {episodes} episodes of stage 1, {result['steps']} control steps at "
            f"{result['steps_per_s']:.0f} a second. The shipped policy comes from the full budget.",
            Plot(figure, "learning", "Goals reached while exploring", drawn=True),
        )

    def _drive(self) -> Driven:
        """Drive the shipped policy through a natural world that is used for no training."""
        config, limit = with_parts(SimulatedRobotConfig, self._sensor), self._config.time_limit
        announce_plant(config.plant, self._console)
        with self._console.progress("simulated seconds", None) as step:
            driven = drive_once(
                _WORLD, self._seed, "policy+planner", config, on_second=step, time_limit=limit
            )
        # With the same seed the oracle has the same task: the paths differ by what each knows.
        oracle = drive_once(_WORLD, self._seed, "oracle", config, time_limit=limit)
        others = {"oracle": oracle.path}
        self._figures["drive"] = without_paths(driven.as_dict())
        self._console.status(driven.title)
        figure = drive_figure(driven.world, driven.path, driven.task.goals, driven.title, others)
        atomic_io.write(self._folder / "drive.png", png(figure))
        caption = "The driven path and the oracle's, on the true map"
        self._add(
            "A drive",
            f"{driven.title}, in {config.plant}, with the shipped forest and policy.",
            Plot(figure, "path", caption, drawn=True, light=True),
            Table(self._figures["drive"]["attempts"], ATTEMPT_COLUMNS, every="All columns"),
            Plot(world_figure(driven.world), "world", "The world"),
        )
        return driven

    def _show_scan(self, driven: Driven) -> None:
        """Add the last cloud of the drive with its cells and its virtual scan."""
        if driven.cloud is None:
            return
        scanned = scan_cloud(driven.cloud, ScanConfig(), shipped_forest())
        self._add(
            "The last scan",
            "The last cloud of the drive, its cells and virtual scan.",
            Plot(scan_figure(scanned, "last cloud"), "scan", "Points, cells, ranges"),
        )

    def _evaluate(self) -> None:
        """Evaluate controllers in a few trials."""
        trials = self._config.trials
        config = EvaluationConfig(
            world=_WORLD,
            trials=trials,
            seed=self._seed,
            simulated_robot=with_parts(SimulatedRobotConfig, self._sensor),
            terminations=TerminationConfig(time_limit=self._config.time_limit),
        )
        bar = self._console.progress("trials of the controllers", trials)
        with self._engine() as engine, bar as step:
            comparison = OffroadComparison.of(config, Models())
            attempts = run_comparison(comparison, engine=engine, on_cell=lambda _: step())
        table = summarise(attempts, config.controllers)
        self._figures["evaluation"] = table
        self._add(
            f"{several(len(config.controllers), 'controller')} side by side",
            f"{several(trials, 'trial')} of each show the form of the table; intervals are wide.",
            goals_table(table, "All columns"),
        )

    def _add(self, title: str, text: str, *blocks: Block) -> None:
        """Add a section to the report."""
        self._sections.append(Section(title, text, *blocks))
