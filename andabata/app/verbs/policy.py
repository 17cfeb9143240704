"""``andabata policy``: what a policy is, and the same for other runtimes."""

from pathlib import Path
from typing import Annotated

import typer

from andabata.app.options import Json, PolicyFile, Quiet

app = typer.Typer(no_args_is_help=True, help="Look at a policy, or export it.")


@app.command()
def show(policy: PolicyFile = None, as_json: Json = False) -> None:
    """Say how a policy was trained and what it takes."""
    from andabata.app.console import Console
    from andabata.models import shipped_policy
    from rl.policy import Policy

    loaded = Policy.load(policy) if policy else shipped_policy()
    data = {
        "layers": [list(weights.shape) for weights, _ in loaded.layers],
        "sectors": loaded.layout.n_sectors,
        "max_range_m": loaded.max_range,
        "limit_rad_s": loaded.limit,
        "dead_zone_rad_s": loaded.dead_zone,
        "info": loaded.info,
    }
    info = loaded.info
    text = (
        f"{data['sectors']} sectors to {loaded.max_range} m, two yaw rates and a heading error in; "
        f"up to {loaded.limit} rad/s out, none under {loaded.dead_zone} rad/s\n"
        f"trained to stage {info.get('stage')} with seed {info.get('seed')} at commit "
        f"{info.get('commit')}; --json has every setting"
    )
    Console(as_json=as_json).result(data, text)


@app.command()
def export(
    out: Annotated[Path, typer.Option(help="ONNX file to write.")],
    policy: PolicyFile = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write a policy as ONNX: states in, yaw rates out."""
    from andabata.app.console import Console
    from andabata.models import shipped_policy
    from andabata.records import atomic_io
    from rl.export import policy_to_onnx
    from rl.policy import Policy

    data = policy_to_onnx(Policy.load(policy) if policy else shipped_policy())
    atomic_io.write(out, data)
    Console(quiet, as_json).result(
        {"out": str(out), "bytes": len(data)}, f"{out}: {len(data)} bytes"
    )
