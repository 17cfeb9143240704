"""Evaluation off-road, as a command runs it."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from andabata.app.jobs.evaluation import Evaluation, judged
from andabata.app.options.evaluation import (
    EvaluationModelOptions,
    OffroadEvaluationOptions,
    TrialOptions,
)
from andabata.app.options.release import ReleaseOptions, refuse_beside_release
from andabata.app.options.shared import RobotOptions
from andabata.app.run_kinds import OFFROAD, EvaluationRequest
from andabata.assembly.controllers import default_controller, refuse_unused_policy
from andabata.configuration.usage import UsageError
from andabata.engine import Engine
from andabata.evaluation.fault_table import fault_rows
from andabata.evaluation.judging import judged_table
from andabata.evaluation.offroad import EvaluationConfig, OffroadComparison
from andabata.evaluation.offroad_pairs import controller_differences
from andabata.evaluation.offroad_table import failure_causes, summarise
from andabata.evaluation.perturbation import perturbation_rows
from andabata.evaluation.trial import OffroadAttempt
from andabata.machine.plants import bullet_step, has_bullet
from andabata.report.plots.drives import failure_picture

_CHOSEN = ("seed", "suite", "goals", "perturb", "faults")
"""Options that a release chooses."""


def offroad_evaluation(request: EvaluationRequest) -> Evaluation:
    """Return the evaluation of controllers off-road, with pictures of failures in its folder.

    Args:
        request: Worlds, trials, controllers and models.

    Raises:
        UsageError: If a value of an option is none, or a release is judged without bullet.
    """
    given, options = request.given, request.given(ReleaseOptions)
    release = options.named()
    refuse_beside_release(release, request.typed, *_CHOSEN)
    robot, driven = given(RobotOptions).base(), given(TrialOptions)
    models = given(EvaluationModelOptions).load()
    if driven.controllers is None:
        names = dict.fromkeys((default_controller(models), *EvaluationConfig().controllers))
        driven = replace(driven, controllers=",".join(names))
    if release is not None and not has_bullet():
        raise UsageError(
            "--release: expected pybullet, since judged tables are those of bullet, got none; "
            f"{bullet_step()}"
        )
    evaluation = given(OffroadEvaluationOptions)
    base = evaluation.base(robot, request.seed, driven)
    config = request.settings.resolve(EvaluationConfig, base)
    if release is not None:
        # Which controllers stand beside depends on the robot as the settings have it.
        base = evaluation.base(config.simulated_robot, request.seed, driven, release)
        config = request.settings.resolve(EvaluationConfig, base)
    refuse_unused_policy(config.controllers, models, "--controllers")
    reality = config.simulated_robot.reality.name

    def tabulate(attempts: Sequence[OffroadAttempt], _: Engine) -> dict[str, Any]:
        rows = summarise(attempts, [arm.name for arm in config.arms])
        data: dict[str, Any] = {
            "rows": rows,
            "failures": failure_causes(attempts),
            "reality": reality,
            "differences": controller_differences(attempts, config.controllers),
            "success_within": {
                "radius_m": config.terminations.goal_radius,
                "tolerance_m": config.tolerance,
            },
        }
        if config.perturb:
            data["perturbations"] = perturbation_rows(attempts, config.arms)
        if config.faults:
            data["faults"] = fault_rows(attempts, config.arms)
        return data

    draw = failure_picture if request.has_folder else None
    comparison = OffroadComparison.of(config, models, draw)
    about = {"task": OFFROAD, "reality": reality}
    known = config.scenarios
    seeds = f"{config.world} {known[0].seed} to {known[-1].seed}"
    plant = config.simulated_robot.plant
    table = judged_table(config.world, reality, plant)
    judging = judged(options, table, seeds, request.has_folder)
    return Evaluation(
        "evaluate",
        config,
        config.seed,
        comparison,
        tabulate,
        about,
        judging=judging,
        plant=plant,
    )
