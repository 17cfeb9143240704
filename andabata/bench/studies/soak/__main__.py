"""Checks what is promised of reliability, and prints a table of the promises.

``python -m andabata.bench.studies.soak`` takes some hours; ``--minutes 10`` checks each promise
with fewer trials. A run with ``--out`` goes on where it was interrupted, and its table can be
stored by ``python -m andabata.report.results_tables --keep``.
"""

import argparse
import signal
import sys
import tempfile
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from andabata.bench.studies.soak.outcome import Outcome
from andabata.bench.studies.soak.promise import Promise
from andabata.bench.studies.soak.promises import PROMISES
from andabata.bench.studies.soak.runner import run_apart
from andabata.bench.table import markdown_table
from andabata.runs.folder import commit, describe, make_folder, write_json
from andabata.runs.journal import Journal
from andabata.runs.strict_json import dumps

COMMAND = "python -m andabata.bench.studies.soak"


def main(argv: Sequence[str] | None = None) -> int:
    """Run the checks, print their table, and return 1 if a promise was not kept, else 0."""
    words = sys.argv[1:] if argv is None else argv
    options = _options(words)
    chosen = [each for each in PROMISES if not options.only or each.name in options.only]
    # The code that runs is that of now: it may be another when the last check is done.
    about = _description(words)
    with tempfile.TemporaryDirectory() as temporary:
        out = Path(temporary) if options.out is None else make_folder(options.out)
        outcomes = run_all(chosen, options.minutes, out)
        rows = [
            promise.row(outcomes[promise.name], promise.count(options.minutes))
            for promise in chosen
        ]
        write_json(out / "run.json", about)
        write_json(out / "evaluation.json", {"rows": rows})
    failures = {name: outcome for name, outcome in outcomes.items() if outcome.failed}
    sys.stdout.write(dumps({"rows": rows}) + "\n" if options.json else markdown_table(rows))
    for name, outcome in failures.items():
        sys.stderr.write(f"error: {name}: {outcome.failed} failures\n")
        sys.stderr.writelines(f"error: {name}: {text}\n" for text in outcome.failures)
    if (now := commit()) != about["commit"]:
        sys.stderr.write(
            f"error: commit: expected {about['commit']} until the end, got {now}; files of a run "
            "name their commit, run it again in a checkout that nobody changes\n"
        )
        return 1
    return 1 if failures else 0


def run_all(promises: Sequence[Promise], minutes: float | None, out: Path) -> dict[str, Outcome]:
    """Run checks one after the other, and go on with a run in the same folder.

    Args:
        promises: Promises.
        minutes: Time of the shorter version [minutes]; None for the full version.
        out: Folder of the run.

    Returns:
        Outcomes by the promises' names.
    """
    journal = Journal(out / "soak.jsonl", {"minutes": minutes, "commit": commit()})
    done = {each["name"]: Outcome.model_validate(each["outcome"]) for each in journal.entries}
    for number, promise in enumerate(promises, start=1):
        if promise.name in done:
            continue
        count = promise.count(minutes)
        sys.stderr.write(f"{number} of {len(promises)}: {promise.name}, {count:,} trials ... ")
        sys.stderr.flush()
        folder = out / "files" / promise.name
        outcome = run_apart(promise, count, folder, promise.time_limit(minutes))
        sys.stderr.write(f"kept: {outcome.verdict}; {outcome.figure}\n")
        journal.append({"name": promise.name, "outcome": outcome.model_dump(mode="json")})
        done[promise.name] = outcome
    return done


def _options(argv: Sequence[str]) -> argparse.Namespace:
    """Return the options of the command line."""
    parser = argparse.ArgumentParser(prog=COMMAND, description=__doc__)
    parser.add_argument(
        "--minutes", type=float, help="Time of a shorter version [minutes]; none for the full one."
    )
    names = [promise.name for promise in PROMISES]
    parser.add_argument("--only", nargs="+", choices=names, help="Names of promises to check.")
    parser.add_argument("--out", type=Path, help="Folder of the run.")
    parser.add_argument("--json", action="store_true", help="Print the rows as JSON.")
    return parser.parse_args(argv)


def _description(argv: Sequence[str]) -> dict[str, Any]:
    """Return command, commit and date of a run, as a results page takes them."""
    date = datetime.now(UTC).date().isoformat()
    words = " ".join([COMMAND, *_without_out(argv)])
    return describe("soak", {}, 0) | {"command": words, "date": date}


def _without_out(argv: Sequence[str]) -> list[str]:
    """Return the words of a command without the name of its folder."""
    words = list(argv)
    if "--out" in words:
        place = words.index("--out")
        del words[place : place + 2]
    return words


if __name__ == "__main__":
    # As Ctrl-C: the check that runs, in a session of its own, is ended, too.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    sys.exit(main())
