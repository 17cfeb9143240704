"""Evaluations by the rules of the BARN benchmark with their progress, and their folder."""

from pathlib import Path
from typing import Any

from andabata.app.console import Console
from andabata.engine import Engine
from andabata.evaluation.barn import BarnEvaluationConfig, evaluate_barn, world_names
from andabata.evaluation.barn_table import barn_differences, barn_failures, barn_rows
from andabata.report.run_folders import write_evaluation
from andabata.runs.folder import make_folder

_ABOUT = "light simulator: no place in a competition"


def run_barn_evaluation(
    config: BarnEvaluationConfig, engine: Engine, folder: Path | None, console: Console
) -> dict[str, Any]:
    """Evaluate navigators and return the tables and the settings, ready for JSON.

    Args:
        config: Worlds, controllers and trials.
        engine: Engine that does the work.
        folder: Folder for the journal and the results, or None. An evaluation that was killed goes
            on from the journal.
        console: Console that shows the progress.

    Raises:
        ValueError: If a folder or file is not as the benchmark has it, or the journal is that of
            another evaluation.
    """
    names = world_names(config)
    made = make_folder(folder) if folder else None
    with console.progress("worlds", len(names)) as step:
        runs = evaluate_barn(
            config,
            engine,
            made / "worlds.jsonl" if made else None,
            lambda name, _: step(1, name),
        )
    data = {
        "rows": barn_rows(runs),
        "differences": barn_differences(runs),
        "failures": barn_failures(runs),
        "worlds": config.worlds,
        "about": _ABOUT,
        "official": config.official,
        "config": config.model_dump(mode="json"),
        "seed": config.seed,
    }
    if made:
        write_evaluation(made, data, "barn")
    return data
