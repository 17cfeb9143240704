"""``andabata policy``: description and export of a policy."""

from pathlib import Path
from typing import Annotated

import typer

from andabata.app.command import command
from andabata.app.options import ConsoleOptions, PolicyOptions

app = typer.Typer(no_args_is_help=True, help="Describe a policy, or export it.")


@app.command()
@command
def show(policy: PolicyOptions, output: ConsoleOptions) -> None:
    """Describe a policy: its input, its output and its training.

    Examples:
        andabata policy show
        andabata policy show --policy data/runs/train/policy.safetensors
        andabata policy show --json
    """
    from andabata.app.tables import policy_text

    loaded = policy.load()
    data = {
        "architecture": loaded.architecture,
        "parameters": sum(array.size for array in loaded.tensors().values()),
        "observations": [term.model_dump() for term in loaded.observations.terms],
        "actions": loaded.actions.model_dump(),
        "info": loaded.info,
    }
    output.console().result(data, policy_text(data))


@app.command()
@command
def export(
    out: Annotated[Path, typer.Option(help="ONNX file to write.")],
    policy: PolicyOptions,
    output: ConsoleOptions,
) -> None:
    """Write a policy as ONNX: states in, or points of any number, and commands out.

    Examples:
        andabata policy export --out policy.onnx
        andabata policy export --policy my_policy.safetensors --out mine.onnx
    """
    from andabata.records import atomic_io
    from rl.export import policy_to_onnx

    data = policy_to_onnx(policy.load())
    atomic_io.write(out, data)
    output.console().result({"out": str(out), "bytes": len(data)}, f"{out}: {len(data)} bytes")
