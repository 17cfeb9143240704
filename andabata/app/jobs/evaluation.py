"""Evaluations of every kind with their progress on the console, and their folders."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from andabata.app.console import Console
from andabata.app.driven_plant import announce_plant
from andabata.app.options.release import ReleaseOptions
from andabata.configuration.usage import UsageError
from andabata.engine import Engine
from andabata.evaluation.attempt import Attempt
from andabata.evaluation.comparison import Comparison, run_comparison
from andabata.evaluation.ledger import JudgingRun
from andabata.machine.plants import Plant
from andabata.report.run_folders import EVALUATION
from andabata.runs import atomic_io
from andabata.runs.folder import describe, make_folder, write_json

Row = dict[str, Any]

Tabulate = Callable[[Sequence[Attempt[Any]], Engine], Row]
"""Function that gives the tables of attempts, ready for JSON."""


@dataclass(frozen=True)
class Evaluation:
    """A comparison that a command runs.

    Attributes:
        verb: Command.
        config: Settings of the command.
        seed: Seed of the command.
        comparison: Comparison that is driven.
        tabulate: Function that gives the tables.
        about: Entries of ``run.json`` beside the settings, ready for JSON.
        files: Bytes of files that the folder keeps beside the result, by their paths in it.
        judging: Place in the ledger of a table that judges a release, None for one that develops.
        plant: Plant of the robots, None where they have another kind of vehicle.
    """

    verb: str
    config: BaseModel
    seed: int
    comparison: Comparison[Any]
    tabulate: Tabulate
    about: Mapping[str, Any]
    files: Mapping[str, bytes] = field(default_factory=dict)
    judging: JudgingRun | None = None
    plant: Plant | None = None


def judged(options: ReleaseOptions, table: str, seeds: str, has_folder: bool) -> JudgingRun | None:
    """Return the place of an evaluation in the ledger, None for one that develops.

    Args:
        options: Release and ledger.
        table: Name of the table.
        seeds: Judging seeds, in words.
        has_folder: True if the run has a folder.

    Raises:
        UsageError: If there is a release and no folder, or the code is of no commit.
        LedgerError: If there is no ledger.
    """
    if options.named() is not None and not has_folder:
        raise UsageError(
            "--release: expected --out beside it, got none; name a folder: a run that is "
            "interrupted has to go on there"
        )
    return options.run(table, seeds)


def run_evaluation(
    evaluation: Evaluation, engine: Engine, folder: Path | None, console: Console
) -> Row:
    """Run an evaluation and return its tables and settings, ready for JSON.

    Args:
        evaluation: Evaluation to run.
        engine: Engine that does the work.
        folder: Folder for the journal, the files of the drives and the results, or None. An
            evaluation that was killed goes on from the journal.
        console: Console that shows the progress.

    Raises:
        PlantError: If the robots' plant is not installed.
        ValueError: If the journal is that of another evaluation, or a drive is refused.
        LedgerError: If the table has judged this release already.
    """
    if evaluation.plant is not None:
        announce_plant(evaluation.plant, console)
    made, comparison = make_folder(folder) if folder else None, evaluation.comparison
    # In the ledger before the first drive: what was looked at cannot be looked at afresh.
    judging = None if evaluation.judging is None else evaluation.judging.begin(made)
    with console.progress(comparison.unit, len(comparison.cells())) as step:
        attempts = run_comparison(
            comparison,
            engine=engine,
            folder=made,
            on_cell=lambda cell: step(1, comparison.label(cell)),
        )
    data = evaluation.tabulate(attempts, engine)
    data |= {"config": evaluation.config.model_dump(mode="json"), "seed": evaluation.seed}
    if judging is not None:
        data["ledger"] = judging.finish().model_dump(mode="json")
        console.status(f"ledger: {judging.ledger} has this table now; commit it")
    if made:
        _write(evaluation, made, data)
    return data


def _write(evaluation: Evaluation, folder: Path, data: Row) -> None:
    """Write the files, the result and the settings of an evaluation into its folder."""
    for name, content in evaluation.files.items():
        make_folder((folder / name).parent)
        atomic_io.write(folder / name, content)
    write_json(folder / EVALUATION, data)
    about = describe(evaluation.verb, data["config"], evaluation.seed)
    write_json(folder / "run.json", about | dict(evaluation.about))
