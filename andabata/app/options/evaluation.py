"""Groups of options of ``andabata evaluate`` and ``andabata lidar-study``; see ``options``."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args

import typer

from andabata.app.options.faults import FAULT_METAVAR, read_faults
from andabata.app.options.models import ClassifierOptions
from andabata.app.options.shared import RealityLevel, RobotOptions
from andabata.configuration.usage import UsageError
from worlds.splits import EVALUATIONS

if TYPE_CHECKING:
    from andabata.assembly.simulated_robot import SimulatedRobotConfig
    from andabata.evaluation.barn import BarnEvaluationConfig
    from andabata.evaluation.offroad import EvaluationConfig
    from andabata.evaluation.rooms import RoomEvaluationConfig
    from andabata.models import Models
    from andabata.tasks.rooms.catalogue import RoomTaskConfig
    from rl.policy import Policy

_OFFROAD = "Off-road (--task offroad)"
_ROOMS = "Rooms (--task spn or td3)"
_BARN = "Fields of cylinders (--task barn)"
_BOTH = "Off-road and fields of cylinders"

_OFFROAD_TRIALS = 20
"""Default of ``--trials`` off-road."""

_PAIRS = 100
"""Default of ``--pairs``."""

_PAIRS_HELP = "Number of random starts and goals in each room; 0 takes its fixed tasks."

Rooms = Annotated[
    str | None,
    typer.Option(
        metavar="NAMES",
        help="Rooms, comma-separated; by default those that judge the task. spn: env0 to env7, "
        "crowded, sudden; td3: env1 to env4, corridor, bend, gates, wall; random-K, clutter-K, "
        "clutter-movers-K, crowd-10-K, barn-K; .toml files.",
        rich_help_panel=_ROOMS,
    ),
]
Pairs = Annotated[
    int,
    typer.Option(
        min=0,
        help=_PAIRS_HELP,
        rich_help_panel=_ROOMS,
    ),
]
Policies = Annotated[
    list[str] | None,
    typer.Option(
        "--policy",
        metavar="FILE",
        help="Policy instead of the shipped one. In rooms also `shipped`, the law that sees, "
        "`sees`, laws that see no obstacle, `proportional`, `heading`, `random`, `ahead`, `away`, "
        "and `nulls`, the null controllers: random, ahead, away, heading, sees. They stand beside "
        "the shipped policy where none is named, and with --release; may be repeated in rooms. "
        "With --task barn that of distilled.",
        rich_help_panel="Models",
    ),
]


@dataclass(frozen=True)
class TrialOptions:
    """What drives, and how often: ``--controllers``, ``--trials``."""

    controllers: Annotated[
        str | None,
        typer.Option(
            metavar="NAMES",
            help="Comma-separated. Off-road some of policy, actor-critic, reactive, straight, "
            "without a map; imitation, which sees the map; policy+planner, imitation+planner, "
            "reactive+planner, planner, with the local planner; "
            "oracle; random+planner, away+planner, null controllers. With --task barn some of "
            "arcs, dwa, dwa-goal, gap, mpc, mpc-told, mpc-movers, mpc-true-movers, distilled, "
            "distilled+shield, td3, spn, heading with the map of dwa, td3-goal, spn-goal without, "
            "straight, random. "
            "The default is planner,reactive off-road, beside --policy policy+planner, too, and "
            "all with --task barn.",
            rich_help_panel=_BOTH,
        ),
    ] = None
    trials: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=EVALUATIONS,
            help="Number of trials of each controller, with --task barn in each world; 20, and 10 "
            "with --task barn.",
            rich_help_panel=_BOTH,
        ),
    ] = None


@dataclass(frozen=True)
class JudgedRobotOptions(RobotOptions):
    """Simulated robot that is judged off-road: ``--sensor``, ``--robot``, ``--reality``."""

    reality: RealityLevel = "field"


@dataclass(frozen=True)
class OffroadEvaluationOptions:
    """Off-road evaluation: ``--world``, ``--goals``, ``--suite``, ``--perturb``, ``--faults``."""

    world: Annotated[str, typer.Option(help="World preset.", rich_help_panel=_OFFROAD)] = (
        "natural-test"
    )
    goals: Annotated[
        int,
        typer.Option(min=1, max=10, help="Number of goals in a row.", rich_help_panel=_OFFROAD),
    ] = 3
    suite: Annotated[
        str | None,
        typer.Option(
            help="generalisation (160 worlds), development (24) or walkers (those 24 with people, "
            "animals and a vehicle), instead of --world, --trials.",
            rich_help_panel=_OFFROAD,
        ),
    ] = None
    perturb: Annotated[
        str | None,
        typer.Option(
            metavar="NAME=NUMBER,...",
            help="Disturbances by their names in simulated_robot.reality, such as "
            "latency=0.2,range_noise=0.05, or field or harsh for all of a level. Each is driven "
            "alone beside the robot as it is: what does it cost?",
            rich_help_panel=_OFFROAD,
        ),
    ] = None
    faults: Annotated[
        str | None,
        typer.Option(
            metavar=FAULT_METAVAR,
            help="Faults of senses, such as gnss:stuck@20,laser:off@20+10, or a .toml file; "
            "`faults --list` explains them. Each is driven alone beside the robot as it is: is it "
            "noticed, and what does it cost?",
            rich_help_panel=_OFFROAD,
        ),
    ] = None

    def base(
        self,
        robot: "SimulatedRobotConfig",
        seed: int,
        driven: TrialOptions,
        release: str | None = None,
    ) -> "EvaluationConfig":
        """Return the evaluation of a robot.

        Args:
            robot: Robot.
            seed: Seed of an evaluation that develops.
            driven: Controllers and trials.
            release: Release that is judged on its own seeds, with its own trials and beside null
                controllers; None to develop.

        Raises:
            UnknownWorldError: If there is no such world.
            UsageError: If there is no such controller, disturbance or fault.
        """
        from andabata.app.options.disturbances import read_disturbances
        from andabata.assembly.controllers import CONTROLLERS
        from andabata.configuration.usage import words
        from andabata.evaluation.judging import (
            JUDGED_WORLDS,
            beside,
            judged_trials,
            judging_seed,
            with_those,
        )
        from andabata.evaluation.offroad import EvaluationConfig
        from worlds.catalogue import UnknownWorldError, preset_names
        from worlds.world_files import SUFFIX, is_world_file

        if self.world not in preset_names() and not is_world_file(self.world):
            known = ", ".join(preset_names())
            raise UnknownWorldError(
                f"--world: expected one of {known} or a {SUFFIX} file, got {self.world!r}"
            )
        default = EvaluationConfig().controllers
        text = ",".join(default) if driven.controllers is None else driven.controllers
        controllers = words(text, CONTROLLERS, "--controllers", takes_own=True)
        trials = _OFFROAD_TRIALS if driven.trials is None else driven.trials
        goals = self.goals
        if release is not None:
            if self.world not in JUDGED_WORLDS:
                raise UsageError(
                    f"--world: expected {', '.join(JUDGED_WORLDS)} beside --release, got "
                    f"{self.world}; name one of them, or develop without --release"
                )
            goals = JUDGED_WORLDS[self.world].goals
            controllers = with_those(controllers, beside(robot.reality.name, robot.plant))
            trials = judged_trials(release, driven.trials, "--trials", self.world)
        return EvaluationConfig(
            suite=self.suite,
            world=self.world,
            controllers=controllers,
            trials=trials,
            goals=goals,
            seed=seed if release is None else judging_seed(release),
            release=release,
            simulated_robot=robot,
            perturb=read_disturbances(self.perturb, robot.reality),
            faults=read_faults(self.faults),
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
    pairs: Annotated[
        int | None,
        typer.Option(
            min=0,
            help=f"{_PAIRS_HELP} {_PAIRS} by default.",
            rich_help_panel=_ROOMS,
        ),
    ] = None

    def base(self, task: str, seed: int, release: str | None = None) -> "RoomEvaluationConfig":
        """Return the evaluation of a task in rooms.

        Args:
            task: Name of the task.
            seed: Seed of starts and goals that develop.
            release: Release that is judged in the task's rooms, on starts and goals of its own;
                None to develop.

        Raises:
            UsageError: If there is no such room, laser or memory, or too few pairs judge.
        """
        from andabata.app.options.room_words import lidar_words, memory_words, room_words
        from andabata.evaluation.judging import judged_trials, judging_seed
        from andabata.evaluation.rooms import RoomEvaluationConfig, judged_task

        data: dict[str, Any] = {"task": judged_task(task, release), "release": release}
        data["pairs"] = _PAIRS if self.pairs is None else self.pairs
        data["seed"] = seed
        if release is not None:
            data["pairs"] = judged_trials(release, self.pairs, "--pairs")
            data["seed"] = judging_seed(release)
        data["memories"] = memory_words(self.memory)
        if self.rooms is not None:
            data["rooms"] = room_words(self.rooms, task)
        if self.lidars is not None:
            data["lidars"] = lidar_words(self.lidars)
        return RoomEvaluationConfig(**data)


@dataclass(frozen=True)
class BarnEvaluationOptions:
    """Evaluation in fields of cylinders.

    Options: ``--worlds``, ``--official``, ``--fields``, ``--vehicle``, ``--told``.
    """

    worlds: Annotated[
        str,
        typer.Option(
            metavar="DIR",
            help="Folder with world_N.world, packed by gzip or not, and path_N.npy; or generated.",
            rich_help_panel=_BARN,
        ),
    ] = "generated"
    official: Annotated[
        bool,
        typer.Option(
            "--official",
            help="The benchmark's own runs: ten in each world, every sixth of all 300, its robot.",
            rich_help_panel=_BARN,
        ),
    ] = False
    fields: Annotated[
        str,
        typer.Option(
            help="Rules of generated worlds: published; narrow, whose widest way is 0.60 m; or "
            "moving-easy, moving-medium, moving-hard: cylinders that move, as in DynaBARN; or "
            "crowd-5, crowd-10, crowd-20: people who avoid each other.",
            rich_help_panel=_BARN,
        ),
    ] = "published"
    vehicle: Annotated[
        str,
        typer.Option(
            help="barn, barn-hull with the wheels' outline, barn-slow, barn-drawn with dynamics "
            "drawn for each run, or barn-skid, a skid-steered base.",
            rich_help_panel=_BARN,
        ),
    ] = "barn"
    told: Annotated[
        bool,
        typer.Option(
            "--told",
            help="Tell controllers the dynamics of --vehicle; without, they take it for barn.",
            rich_help_panel=_BARN,
        ),
    ] = False

    def base(
        self, seed: int, driven: TrialOptions, policies: Sequence[str] | None = None
    ) -> "BarnEvaluationConfig":
        """Return the evaluation.

        Args:
            seed: Seed of all noise.
            driven: Controllers and trials.
            policies: Values of ``--policy``, one at most.

        Raises:
            UsageError: If there is no such controller, vehicle or kind of fields, an option
                contradicts ``--official``, or there are several policies.
        """
        from andabata.configuration.usage import one_word, words
        from andabata.evaluation.barn import (
            GENERATED,
            OFFICIAL_TRIALS,
            BarnEvaluationConfig,
            Fields,
        )
        from andabata.evaluation.barn_navigators import BARN_NAVIGATORS
        from andabata.machine.planar.vehicle import PLANAR_VEHICLES

        if policies is not None and len(policies) > 1:
            raise UsageError(f"--policy: expected one with --task barn, got {len(policies)}")
        file = next((name for name in policies or () if name != "shipped"), None)
        # None is no choice: off-road and fields have defaults of their own.
        names, every = driven.controllers, BARN_NAVIGATORS
        trials = OFFICIAL_TRIALS if driven.trials is None else driven.trials
        vehicle = one_word(self.vehicle, tuple(PLANAR_VEHICLES), "--vehicle")
        fields = one_word(self.fields, get_args(Fields), "--fields")
        # Published scores are those of the benchmark's own worlds, robot and number of runs: a
        # figure of anything else must not be taken for one (docs/results/barn.md).
        own = self.worlds != GENERATED and vehicle == "barn" and trials == OFFICIAL_TRIALS
        if self.official and not own:
            raise UsageError(
                "--official: expected a folder of worlds, the robot barn and ten trials, got other "
                "options; leave out --official, or --vehicle and --trials"
            )
        return BarnEvaluationConfig.model_validate(
            {
                "worlds": self.worlds,
                "fields": fields,
                "controllers": every
                if names is None
                else words(names, every, "--controllers", takes_own=True),
                "trials": trials,
                "official": self.official,
                "vehicle": PLANAR_VEHICLES[vehicle],
                # Who is not told drives by the model of the nominal robot.
                "believed": None if self.told else PLANAR_VEHICLES["barn"],
                "policy": file,
                "seed": seed,
            }
        )


@dataclass(frozen=True)
class RoomPolicyOptions:
    """Policies in rooms: ``--policy``, which may be repeated."""

    policy: Policies = None

    def load_policies(
        self, task: "RoomTaskConfig", beside: Sequence[str] = ()
    ) -> "dict[str, Policy]":
        """Return the policies by name, the shipped one of the task by default.

        Args:
            task: Task that they drive.
            beside: Names of policies that stand beside those that were asked for.

        Raises:
            UsageError: If one is given twice.
            ValueError: If a file is no policy, or one that cannot drive in rooms.
            OSError: If a file cannot be read.
        """
        from andabata.app.options.room_words import load_policies

        asked = self.policy or ["shipped"]
        return load_policies([*asked, *(name for name in beside if name not in asked)], task)


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
