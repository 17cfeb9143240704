"""``andabata doctor``: check of the installation."""

from typing import Annotated

import typer

from andabata.app.command import command
from andabata.app.options.shared import ConsoleOptions


@command
def doctor(
    *,
    self_test: Annotated[
        bool,
        typer.Option(
            "--self-test",
            help="Solve small problems with known answers, too: rays, filter, classifier, policy, "
            "recordings, cache. Seconds; a minute at the first start, which compiles.",
        ),
    ] = False,
    compile_kernels: Annotated[
        bool,
        typer.Option(
            "--compile",
            help="First compile all that a drive needs, on all cores; `make install` does so.",
        ),
    ] = False,
    output: ConsoleOptions,
) -> None:
    """Check the installation: versions, system libraries, package origins, optional packages.

    The exit code is 1 when something is broken or a check of the self-test fails.

    Examples:
        andabata doctor
        andabata doctor --json
        andabata doctor --self-test
        andabata doctor --compile --quiet
    """
    from andabata.app.doctor.installation import check_installation, installation_text

    console, compilation = output.console(), None
    if compile_kernels:
        from andabata.app.doctor import kernels

        with console.progress("parts", len(kernels.PARTS) + 1) as step:
            compilation = kernels.compile_kernels(on_part=lambda name: step(1))
    installation = check_installation()
    if compilation is not None:
        installation["compilation"] = compilation
    text = installation_text(installation)
    if self_test:
        from andabata.app.doctor.self_test import self_test as run
        from andabata.app.doctor.self_test import self_test_text

        with console.progress("checks", None) as step:
            installation["self_test"] = run(lambda name: step(1))
        installation["ok"] = installation["ok"] and installation["self_test"]["ok"]
        text = f"{text}\n\n{self_test_text(installation['self_test'])}"
    console.result(installation, text)
    if not installation["ok"]:
        raise typer.Exit(1)
