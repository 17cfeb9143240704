"""The command line: commands, errors on one line, exit codes."""

import sys
import traceback
from collections.abc import Sequence
from typing import Any

import typer
from typer.core import TyperGroup

from andabata.app.closed_pipes import drop_unread_output
from andabata.app.verbs import (
    bag,
    bench,
    classifier,
    clouds,
    demo,
    doctor,
    drive,
    evaluate,
    faults,
    lidar_study,
    policy,
    report,
    ros,
    ros2,
    scan,
    train,
    view,
    world,
)
from andabata.interrupts import INTERRUPTED, TEXT, handle_interrupts
from andabata.printable import printable

OK, FAILED, USAGE = 0, 1, 2

FLOW = (
    "doctor",
    "world",
    "clouds",
    "classifier",
    "scan",
    "train",
    "report",
    "policy",
    "drive",
    "view",
    "evaluate",
    "faults",
    "lidar-study",
    "bag",
    "ros",
    "ros2",
    "bench",
    "demo",
)
"""Verbs from a fresh installation to a robot that drives: the help is a tour of them."""

# Exception of typer for a wrong command line: click's, or its own copy in later versions.
_USAGE_ERROR: Any = typer.BadParameter.__mro__[2]


class FlowOrder(TyperGroup):
    """Group that lists its verbs in the order in which they are first needed.

    typer lists single commands before groups of commands.
    """

    def list_commands(self, ctx: Any) -> list[str]:  # noqa: ANN401 - click's, or typer's own copy.
        """Return the names of the verbs, those outside the flow at the end."""
        return sorted(super().list_commands(ctx), key=_place)


def _place(name: str) -> int:
    """Return the place of a verb in the flow."""
    return FLOW.index(name) if name in FLOW else len(FLOW)


app = typer.Typer(
    name="andabata",
    cls=FlowOrder,
    help="Off-road navigation for a skid-steer robot with a rotating 2D laser.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
app.command()(doctor.doctor)
app.add_typer(world.app, name="world")
app.add_typer(clouds.app, name="clouds")
app.add_typer(classifier.app, name="classifier")
app.command()(scan.scan)
app.command()(train.train)
app.command()(report.report)
app.add_typer(policy.app, name="policy")
app.command()(drive.drive)
app.command()(view.view)
app.command()(evaluate.evaluate)
app.command()(faults.faults)
app.command("lidar-study")(lidar_study.lidar_study)
app.add_typer(bag.app, name="bag")
app.add_typer(ros.app, name="ros")
app.add_typer(ros2.app, name="ros2")
app.add_typer(bench.app, name="bench")
app.command()(demo.demo)


@app.callback()
def _options(
    debug: bool = typer.Option(False, "--debug", help="Show the traceback of an error."),
) -> None:
    """Off-road navigation for a skid-steer robot with a rotating 2D laser."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code: 0 ok, 1 failed, 2 usage, 130 interrupted.

    Args:
        argv: Words after the program's name; None for the process's own. ``--debug`` is accepted
            at any place.
    """
    words = list(sys.argv[1:] if argv is None else argv)
    debug = "--debug" in words
    # At any place: who sees an error types the same line again, with a word behind it.
    words = [word for word in words if word != "--debug"]
    try:
        code = app(words, prog_name="andabata", standalone_mode=False)
    except (KeyboardInterrupt, typer.Abort):
        code = INTERRUPTED  # Later versions of typer return this code.
    except _USAGE_ERROR as error:
        return _fail(error.format_message(), USAGE)
    # Every error ends on one line: a traceback hides the line that says what to do next.
    except Exception as error:
        if debug:
            traceback.print_exc()
        return _fail(_one_line(_of_own_code(error)), _code(error))
    if code == INTERRUPTED:
        sys.stderr.write(TEXT)
    return code if isinstance(code, int) else OK


def _code(error: Exception) -> int:
    """Return 2 for an error in what the user typed, 1 for all others."""
    # Imported only when something failed: the help has to answer at once.
    from andabata.configuration.settings import SettingsError
    from andabata.configuration.usage import UsageError
    from andabata.machine.lidar_models import UnknownSensorError
    from andabata.machine.plants import PlantError
    from worlds.catalogue import UnknownWorldError
    from worlds.goals import GoalError
    from worlds.rooms.catalogue import UnknownRoomError
    from worlds.splits import JudgingSeedError

    usage = SettingsError | UsageError | GoalError | JudgingSeedError | PlantError
    unknown = UnknownWorldError | UnknownRoomError | UnknownSensorError
    return USAGE if isinstance(error, usage | unknown) else FAILED


def _of_own_code(error: Exception) -> Exception:
    """Return the error that names the line of a user's own code; others as they are."""
    from andabata.own_code import own_error

    return own_error(error) or error


def _one_line(error: Exception) -> str:
    """Return an error's text on one line."""
    if isinstance(error, OSError) and error.filename is not None:
        text = f"{error.filename}: {error.strerror or error}"
    else:
        text = " ".join(str(error).split())
    if isinstance(error, ValueError | OSError):
        return text
    return (
        f"{type(error).__name__}: {text}; this is a defect, please report it (--debug shows where)"
    )


def _fail(text: str, code: int) -> int:
    """Print an error and return its code; no text means that typer has shown the help instead."""
    if text:
        sys.stderr.write(f"error: {printable(' '.join(text.split()))}\n")
    return code


def run() -> None:
    """Run the console script and exit with its code."""
    # Before anything is printed: a reader such as `head` may leave at the first line.
    handle_interrupts()
    drop_unread_output()
    sys.exit(main())
