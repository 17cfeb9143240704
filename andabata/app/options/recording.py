"""Group of options of commands that replay a recording of any robot."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from andabata.app.options.sensors import SensorOptions, TopicOptions

if TYPE_CHECKING:
    from andabata.assembly.simulated_robot import SimulatedRobotConfig
    from andabata.machine.faults import Fault
    from andabata.models import Models
    from andabata.replay.options import ReplayOptions

RecordedRobot = Annotated[
    str | None,
    typer.Option(help="Body instead of the recorded one: andabata, husky or jackal."),
]


@dataclass(frozen=True)
class RecordingOptions(TopicOptions, SensorOptions):
    """Recorded robot with its names, units, stamps, sensors and settings.

    Options: those of ``TopicOptions`` and ``SensorOptions``.
    """

    def replay(
        self,
        models: "Models | None" = None,
        controller: str | None = None,
        robot: str | None = None,
        faults: "Sequence[Fault]" = (),
    ) -> "ReplayOptions":
        """Return the user's choices for a replay.

        Args:
            models: Classifiers and policy; None for the shipped ones.
            controller: Name of the controller; None for the recorded one.
            robot: Name of a body; None for the recorded one.
            faults: Faults that are added to the recorded readings.

        Raises:
            UsageError: If an option's value is not one.
        """
        from andabata.machine.robot import RobotModel
        from andabata.replay.options import ReplayOptions

        def configure(recorded: "SimulatedRobotConfig") -> "SimulatedRobotConfig":
            body: dict[str, Any] = {"robot": RobotModel.load(robot)} if robot else {}
            return self.configure(recorded.model_copy(update=body | {"faults": tuple(faults)}))

        return ReplayOptions(
            controller=controller,
            models=models,
            cloud=self.cloud,
            configure=configure,
            topics=self.names(),
            mountings=self.mountings(),
            units=self.units(),
            sources=self.sources(),
            time_offsets=self.time_offsets(),
        )
