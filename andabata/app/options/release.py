"""Options of a table that judges a release: ``--release``, ``--ledger``."""

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from andabata.configuration.usage import UsageError
from worlds.splits import judging_world

if TYPE_CHECKING:
    from andabata.evaluation.ledger import JudgingRun

_JUDGING = "Judging a release"


@dataclass(frozen=True)
class ReleaseOptions:
    """Judging of a release, once: ``--release``, ``--ledger``."""

    release: Annotated[
        str | None,
        typer.Option(
            metavar="X.Y.Z",
            help="Judge this release, once, on seeds that nothing else may look at; the ledger "
            "says who did.",
            rich_help_panel=_JUDGING,
        ),
    ] = None
    ledger: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Ledger of the judging seeds; that of the checkout by default.",
            rich_help_panel=_JUDGING,
        ),
    ] = None

    def named(self) -> str | None:
        """Return the release, None for none.

        Raises:
            UsageError: If it is no version, or there is a ledger without a release.
        """
        if self.release is None:
            if self.ledger is not None:
                raise UsageError("--ledger: expected --release beside it, got none")
            return None
        try:
            judging_world(self.release, 0)
        except ValueError as error:
            raise UsageError(f"--{error}") from error
        return self.release

    def run(self, table: str, seeds: str) -> "JudgingRun | None":
        """Return the place of a table in the ledger, None without a release.

        Args:
            table: Name of the table.
            seeds: Judging seeds, in words.

        Raises:
            LedgerError: If there is no ledger.
            UsageError: If the release is no version, or the code is of no commit.
        """
        from andabata.evaluation.ledger import JudgingRun, find_ledger

        release = self.named()
        if release is None:
            return None
        return JudgingRun.of(table, release, seeds, find_ledger(self.ledger))


def refuse_beside_release(release: str | None, typed: Collection[str], *names: str) -> None:
    """Refuse options that a judging table does not leave open.

    Args:
        release: Release that is judged; None refuses nothing.
        typed: Names of the options that were typed, without dashes.
        names: Names of those that are refused.

    Raises:
        UsageError: If one of them was typed.
    """
    both = [f"--{name}" for name in names if release is not None and name in typed]
    if both:
        raise UsageError(
            f"--release: expected no {', '.join(both)} beside it, since the release chooses it, "
            f"got both; leave out {', '.join(both)}, or develop without --release"
        )
