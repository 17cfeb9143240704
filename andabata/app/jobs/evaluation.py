"""An evaluation with its progress on the console, and its folder."""

from pathlib import Path
from typing import Any

from andabata.app.console import Console
from andabata.engine import Engine
from andabata.evaluation.evaluate import EvaluationConfig, evaluate, failure_causes, summarise
from andabata.models import Models
from andabata.report.plots.drives import failure_picture
from andabata.report.run_folders import write_evaluation
from andabata.runs.folder import make_folder


def run_evaluation(
    config: EvaluationConfig,
    models: Models,
    engine: Engine,
    folder: Path | None,
    seed: int,
    console: Console,
) -> dict[str, Any]:
    """Evaluate controllers and return the table, the failures and the settings, ready for JSON.

    Args:
        config: Worlds, trials and controllers.
        models: Classifiers and policy.
        engine: Engine that does the work.
        folder: Folder for the journal, the pictures of failures and the results, or None. An
            evaluation that was killed goes on from the journal.
        seed: Seed of the command.
        console: Console that shows the progress.
    """
    made = make_folder(folder) if folder else None

    with console.progress("trials", len(config.scenarios)) as step:
        rows = evaluate(
            config,
            models,
            engine=engine,
            journal=made / "trials.jsonl" if made else None,
            pictures=make_folder(made / "failures") if made else None,
            draw_failure=failure_picture,
            on_trial=lambda _, rows: step(1, f"world {rows[0]['world_seed']}"),
        )
    data = {
        "rows": summarise(rows, config),
        "failures": failure_causes(rows),
        "config": config.model_dump(mode="json"),
        "seed": seed,
    }
    if made:
        write_evaluation(made, data, "offroad")
    return data
