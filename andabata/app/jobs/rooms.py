"""Evaluation in rooms, and the study of a laser, as commands run them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from andabata.app.jobs.evaluation import Evaluation, judged
from andabata.app.options.evaluation import RoomEvaluationOptions, RoomPolicyOptions
from andabata.app.options.release import ReleaseOptions, refuse_beside_release
from andabata.app.run_kinds import EvaluationRequest
from andabata.engine import Engine
from andabata.evaluation.lidar_study import LidarStudyConfig, tabulate_study
from andabata.evaluation.room_drives import RoomAttempt
from andabata.evaluation.rooms import RoomComparison, RoomEvaluationConfig, tabulate
from andabata.report.room_folder import about_policies, policy_files
from rl.laws import NULL_LAWS
from rl.policy import Policy


def room_evaluation(request: EvaluationRequest) -> Evaluation:
    """Return the evaluation of policies in rooms.

    Args:
        request: Rooms, lasers, memories, pairs and policies.

    Raises:
        UsageError: If a value of an option is none.
        ValueError: If a policy cannot drive in rooms.
    """
    options = request.given(ReleaseOptions)
    release = options.named()
    refuse_beside_release(release, request.typed, "seed", "rooms")
    base = request.given(RoomEvaluationOptions).base(request.task, request.seed, release)
    config = request.settings.resolve(RoomEvaluationConfig, base)
    asked = request.given(RoomPolicyOptions)
    # Whoever names policies to develop names what to compare them with, too.
    is_free = release is None and asked.policy is not None
    policies = asked.load_policies(config.task, () if is_free else NULL_LAWS)
    seeds = f"starts and goals of seed {config.seed}, {config.pairs} in each room"
    shield = "" if config.task.shield is None else ", with the shield"
    judging = judged(options, f"evaluate {config.task.task}{shield}", seeds, request.has_folder)
    return replace(policy_evaluation(config, policies), judging=judging)


def policy_evaluation(config: RoomEvaluationConfig, policies: Mapping[str, Policy]) -> Evaluation:
    """Return the evaluation of policies in rooms.

    Args:
        config: Rooms, lasers, memories and pairs.
        policies: Policies by name.
    """
    comparison = RoomComparison.of(config, policies)

    def tables(attempts: Sequence[RoomAttempt], engine: Engine) -> dict[str, Any]:
        return tabulate(comparison, policies, attempts, engine)._asdict()

    about, files = about_policies(config, policies), policy_files(policies)
    return Evaluation("evaluate", config, config.seed, comparison, tables, about, files)


def lidar_study(config: LidarStudyConfig, policies: Mapping[str, Policy]) -> Evaluation:
    """Return the study of a laser.

    Args:
        config: Laser, changes, rooms and pairs.
        policies: Policies by name, such as several seeds.
    """

    def tables(attempts: Sequence[RoomAttempt], _: Engine) -> dict[str, Any]:
        study = tabulate_study(config, attempts)
        return {"rows": study.rows, "advice": study.advice, "policies": list(policies)}

    comparison = RoomComparison.of(config.cells, policies)
    about, files = about_policies(config.cells, policies), policy_files(policies)
    return Evaluation("lidar-study", config, config.seed, comparison, tables, about, files)
