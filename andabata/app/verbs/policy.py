"""``andabata policy``: description, export and distillation of a policy."""

from pathlib import Path
from typing import Annotated

import typer

from andabata.app.command import command
from andabata.app.options.models import PolicyOptions
from andabata.app.options.shared import ConsoleOptions, Seed, SettingsOptions, Workers

app = typer.Typer(
    no_args_is_help=True,
    help="Describe a policy, export it, or teach one: by the sampling MPC, or by the true map.",
)


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
    from andabata.runs import atomic_io
    from rl.export import policy_to_onnx

    data = policy_to_onnx(policy.load())
    atomic_io.write(out, data)
    output.console().result({"out": str(out), "bytes": len(data)}, f"{out}: {len(data)} bytes")


@app.command()
@command
def distill(
    *,
    out: Annotated[Path, typer.Option(help="Folder of the rounds and of the policy.")] = Path(
        "data/runs/distilled"
    ),
    settings: SettingsOptions,
    seed: Seed = 0,
    workers: Workers = 2,
    output: ConsoleOptions,
) -> None:
    """Distill the sampling MPC of flat ground into a policy, for evaluate --task barn.

    A distillation that was killed goes on with its next round if it is called again.

    Examples:
        andabata policy distill --out data/runs/distilled
        andabata policy distill --set drives=[20,20] --set expert_shares=[1.0,0.3]
    """
    from andabata.runs import atomic_io
    from andabata.training.distillation import DistillationConfig, distill_mpc

    config = settings.resolve(DistillationConfig)
    console = output.console()
    with console.progress("drives", sum(config.drives)) as step:
        policy, rounds = distill_mpc(
            config, seed, out, workers, lambda k, count: step(count, f"round {k + 1}")
        )
    file, data = out / "policy.safetensors", policy.to_bytes()
    atomic_io.write(file, data)
    result = {"policy": str(file), "bytes": len(data), "rounds": [one._asdict() for one in rounds]}
    last = rounds[-1]
    text = f"{file}: {len(data)} bytes, from {last.labels} labels, loss {last.loss:.4f}"
    console.result(result, text)


@app.command()
@command
def imitate(
    *,
    out: Annotated[Path, typer.Option(help="Folder of the rounds and of the policy.")] = Path(
        "data/runs/imitated"
    ),
    labels: Annotated[
        Path | None,
        typer.Option(help="Folder of another imitation: fit to its labels, without drives."),
    ] = None,
    settings: SettingsOptions,
    seed: Seed = 0,
    workers: Workers = 2,
    output: ConsoleOptions,
) -> None:
    """Teach a policy that sees the robot's map, by prices of all actions on the true map.

    It drives as controller policy with --policy. An imitation that was killed goes on with its next
    round if it is called again.

    Examples:
        andabata policy imitate --out data/runs/imitated
        andabata policy imitate --set drives=[20,20] --set teacher_shares=[1,0.3]
        andabata policy imitate --labels runs/a --set hidden=[256] --out runs/b
    """
    from andabata.runs import atomic_io
    from andabata.runs.folder import make_folder
    from andabata.training import imitation

    console = output.console()
    if labels is not None:
        base = imitation.labelled_config(labels)
        config = settings.resolve(imitation.ImitationConfig, base)
        make_folder(out)
        policy, fitted = imitation.refit(config, seed, labels)
        rounds = [fitted]
    else:
        config = settings.resolve(imitation.ImitationConfig)
        with console.progress("drives", sum(config.drives)) as step:
            policy, rounds = imitation.imitate(
                config, seed, out, workers, lambda k, count: step(count, f"round {k + 1}")
            )
    file, data = out / "policy.safetensors", policy.to_bytes()
    atomic_io.write(file, data)
    result = {"policy": str(file), "bytes": len(data), "rounds": [one._asdict() for one in rounds]}
    last = rounds[-1]
    text = f"{file}: {len(data)} bytes, from {last.labels} labels, regret {last.regret:.3f} s"
    console.result(result, text)


@app.command()
@command
def decisions(
    folder: Annotated[
        Path, typer.Argument(metavar="FOLDER", help="Folder of `policy imitate`.")
    ] = Path("data/runs/imitated"),
    *,
    out: Annotated[Path, typer.Option(help="PNG file to write.")] = Path("decisions.png"),
    count: Annotated[int, typer.Option(min=1, max=20, help="Number of decisions.")] = 4,
    worst: Annotated[
        bool, typer.Option("--worst/--any", help="The dearest ones, each of another time, or any.")
    ] = True,
    seed: Seed = 0,
    output: ConsoleOptions,
) -> None:
    """Draw decisions of an imitation: what was seen, and all actions' prices.

    They are of the last round's drives, by the policy of the round before, which has not learned
    from them.

    Examples:
        andabata policy decisions data/runs/imitated --out decisions.png
        andabata policy decisions data/runs/imitated --any --count 6 --json
    """
    import numpy as np

    from andabata.report.plots.axes import png
    from andabata.report.plots.decisions import Decision, decisions_figure
    from andabata.runs import atomic_io
    from andabata.training.judged_decisions import dearest, judge_decisions

    judged = judge_decisions(folder)
    labels, total = judged.labels, len(judged.regrets)
    if worst:
        chosen = dearest(judged.regrets, count)
    else:
        chosen = np.random.default_rng(seed).permutation(total)[:count].tolist()
    rows = [
        Decision(labels.observations[k].astype(np.float32), judged.given[k], labels.prices[k])
        for k in chosen
    ]
    figure = decisions_figure(rows, judged.policy.observations, judged.table, judged.clip)
    atomic_io.write(out, png(figure))
    regrets = np.minimum(judged.regrets, judged.clip)
    data = {
        "out": str(out),
        "decisions": total,
        "regret_s": float(regrets.mean()),
        "above_1_s": float((regrets > 1.0).mean()),
        "above_3_s": float((regrets > 3.0).mean()),
        "shown": [{"number": k, "regret_s": float(judged.regrets[k])} for k in chosen],
    }
    text = (
        f"{out}: {len(chosen)} of {total} decisions; mean regret {data['regret_s']:.3f} s, "
        f"{100 * float((regrets > 3.0).mean()):.1f} % cost more than 3 s"
    )
    output.console().result(data, text)
