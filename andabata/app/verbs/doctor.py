"""``andabata doctor``: check of the installation."""

import typer

from andabata.app.command import command
from andabata.app.options import ConsoleOptions


@command
def doctor(output: ConsoleOptions) -> None:
    """Check the installation: versions, system libraries, package origins.

    Examples:
        andabata doctor
        andabata doctor --json
    """
    from andabata.app.installation import check_installation, installation_text

    found = check_installation()
    output.console().result(found, installation_text(found))
    if not found["ok"]:
        raise typer.Exit(1)
