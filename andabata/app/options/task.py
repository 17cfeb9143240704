"""Option ``--task`` of training and of evaluation."""

from typing import Annotated

import typer

TaskName = Annotated[
    str,
    typer.Option(
        "--task",
        help="offroad, or navigation in rooms by a planar laser: spn, which reads points, or td3, "
        "the task of the improved TD3 and of GDAE.",
    ),
]
EvaluationTaskName = Annotated[
    str,
    typer.Option(
        "--task",
        help="offroad; spn or td3: navigation in rooms by a planar laser; or barn: the BARN "
        "benchmark.",
    ),
]
