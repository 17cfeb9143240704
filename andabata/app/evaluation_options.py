"""Groups of options of ``andabata evaluate`` and ``andabata lidar-study``; see ``options``."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from andabata.app.options import ClassifierOptions
from andabata.app.usage import UsageError
from worlds.splits import EVALUATIONS

if TYPE_CHECKING:
    from andabata.assembly.simulated_robot import SimulatedRobotConfig
    from andabata.evaluation.evaluate import EvaluationConfig
    from andabata.evaluation.rooms import RoomEvaluationConfig
    from andabata.models import Models
    from andabata.tasks.room_tasks import RoomTaskConfig
    from rl.policy import Policy

_OFFROAD = "Off-road (--task offroad)"
_ROOMS = "Rooms (--task spn or td3)"

Rooms = Annotated[
    str | None,
    typer.Option(
        metavar="NAMES",
        help="Rooms, comma-separated; by default those that judge the task. spn: env0 to env7, "
        "crowded, sudden; td3: env1 to env4, corridor, bend, gates, wall; random-K, clutter-K, "
        "clutter-movers-K.",
        rich_help_panel=_ROOMS,
    ),
]
Pairs = Annotated[
    int,
    typer.Option(
        min=0,
        help="Number of random starts and goals in each room; 0 takes its fixed tasks.",
        rich_help_panel=_ROOMS,
    ),
]
Policies = Annotated[
    list[str] | None,
    typer.Option(
        "--policy",
        metavar="FILE",
        help="Policy instead of the shipped one. In rooms also `shipped`, and laws that see no "
        "obstacle: `proportional`, `heading`, `random`, `away`; may be repeated there.",
        rich_help_panel="Models",
    ),
]


@dataclass(frozen=True)
class OffroadEvaluationOptions:
    """Off-road evaluation.

    Options: ``--world``, ``--controllers``, ``--trials``, ``--goals``, ``--suite``.
    """

    world: Annotated[str, typer.Option(help="World preset.", rich_help_panel=_OFFROAD)] = (
        "natural-test"
    )
    controllers: Annotated[
        str,
        typer.Option(
            help="Some of policy, actor-critic, reactive, straight, without a map; "
            "policy+planner, reactive+planner, planner, with the local planner; oracle; "
            "random+planner, away+planner, null controllers; comma-separated.",
            rich_help_panel=_OFFROAD,
        ),
    ] = "policy+planner,reactive"
    trials: Annotated[
        int,
        typer.Option(
            min=1,
            max=EVALUATIONS,
            help="Number of trials of each controller.",
            rich_help_panel=_OFFROAD,
        ),
    ] = 20
    goals: Annotated[
        int,
        typer.Option(min=1, max=10, help="Number of goals in a row.", rich_help_panel=_OFFROAD),
    ] = 3
    suite: Annotated[
        str | None,
        typer.Option(
            help="generalisation (160 worlds) or development (24), instead of --world, --trials.",
            rich_help_panel=_OFFROAD,
        ),
    ] = None

    def base(self, robot: "SimulatedRobotConfig", seed: int) -> "EvaluationConfig":
        """Return the evaluation of a robot.

        Raises:
            UnknownWorldError: If there is no such world.
            UsageError: If there is no such controller.
        """
        from andabata.app.usage import words
        from andabata.assembly.controllers import CONTROLLERS, RENAMED_CONTROLLERS
        from andabata.evaluation.evaluate import EvaluationConfig
        from worlds.catalogue import UnknownWorldError, preset_names

        if self.world not in preset_names():
            known = ", ".join(preset_names())
            raise UnknownWorldError(f"--world: expected one of {known}, got {self.world!r}")
        return EvaluationConfig(
            suite=self.suite,
            world=self.world,
            controllers=words(self.controllers, CONTROLLERS, "--controllers", RENAMED_CONTROLLERS),
            trials=self.trials,
            goals=self.goals,
            seed=seed,
            simulated_robot=robot,
        )


@dataclass(frozen=True)
class RoomEvaluationOptions:
    """Evaluation in rooms: ``--rooms``, ``--lidars``, ``--memory``, ``--pairs``."""

    rooms: Rooms = None
    lidars: Annotated[
        str | None,
        typer.Option(
            metavar="NAMES",
            help="trained, that of each policy (td3's default), all (spn's), or some of "
            "full-fine, hokuyo-270, wide-270, front-220, front-180, ten-beams, ten-beams-forward, "
            "or labels as 180|20|10|0.05, in degrees and metres: field of view, resolution, range, "
            "x, y, yaw; comma-separated.",
            rich_help_panel=_ROOMS,
        ),
    ] = None
    memory: Annotated[
        str,
        typer.Option(
            help="reactive, as in the paper, map, which gives the policy sub-goals, or both.",
            rich_help_panel=_ROOMS,
        ),
    ] = "both"
    pairs: Pairs = 100

    def base(self, task: str, seed: int) -> "RoomEvaluationConfig":
        """Return the evaluation of a task in rooms.

        Raises:
            UsageError: If there is no such room, laser or memory.
        """
        from andabata.app.room_words import lidar_words, memory_words, room_words
        from andabata.evaluation.rooms import RoomEvaluationConfig, judged_task

        data: dict[str, Any] = {"task": judged_task(task), "pairs": self.pairs, "seed": seed}
        data["memories"] = memory_words(self.memory)
        if self.rooms is not None:
            data["rooms"] = room_words(self.rooms, task)
        if self.lidars is not None:
            data["lidars"] = lidar_words(self.lidars)
        return RoomEvaluationConfig(**data)


@dataclass(frozen=True)
class RoomPolicyOptions:
    """Policies in rooms: ``--policy``, which may be repeated."""

    policy: Policies = None

    def load_policies(self, task: "RoomTaskConfig") -> "dict[str, Policy]":
        """Return the policies by name, the shipped one of the task by default.

        Raises:
            UsageError: If one is given twice.
            ValueError: If a file is no policy, or one that cannot drive in rooms.
            OSError: If a file cannot be read.
        """
        from andabata.app.room_words import load_policies

        return load_policies(self.policy or ["shipped"], task)


@dataclass(frozen=True)
class EvaluationModelOptions(RoomPolicyOptions, ClassifierOptions):
    """All models, with several policies: ``--forest``, ``--ground-classifier``, ``--policy``."""

    def load(self) -> "Models":
        """Return the models of an off-road evaluation, the shipped ones by default.

        Raises:
            UsageError: If there are several policies.
        """
        from andabata.models import Models

        given = self.policy or ["shipped"]
        if len(given) > 1:
            raise UsageError(
                f"--policy: expected one off-road, got {len(given)}; several go with --task spn "
                "or td3"
            )
        file = None if given == ["shipped"] else Path(given[0])
        return Models.load(self.forest, self.ground_classifier, file)
