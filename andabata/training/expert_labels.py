"""Labels of the sampling MPC: its command in each state of drives by turns of it and a policy."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.kinematics import Twist
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.readings import PlanarReadings
from andabata.machine.planar.vehicle import PLANAR_VEHICLES
from andabata.navigation.planar.distilled_navigator import DistilledObserver
from andabata.navigation.planar.distilled_observation import ACTIONS, command_of
from andabata.navigation.planar.mpc_navigator import MpcNavigator
from andabata.tasks.rooms.planar_drive import (
    BARN_LIDAR,
    DriveRules,
    SimulatedPlanarRobot,
    drive_to_goal,
)
from andabata.tasks.terminations import Outcome
from rl.policy import Policy, policy_from_bytes
from worlds.rooms.barn import NARROW, PUBLISHED, barn_world


class LabelledDriveConfig(BaseModel):
    """Settings of the drives that are labelled.

    Attributes:
        first_seed: Seed of the first generated field; each drive has the next one.
        switch_time: Mean time for which one of the two drives [s].
        drawn_share: Share of the drives whose dynamics are drawn.
        narrow_share: Share of the drives in narrow fields.
        time_limit: Longest drive [s].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    first_seed: int = Field(default=300_000, ge=0)
    switch_time: float = Field(default=1.0, gt=0)
    drawn_share: float = Field(default=0.5, ge=0, le=1)
    narrow_share: float = Field(default=0.0, ge=0, le=1)
    time_limit: float = Field(default=20.0, gt=0)


class Labels(NamedTuple):
    """Observations with the expert's actions.

    Attributes:
        observations: Observations, float32, shape (n, n_observations).
        shares: Actions as shares from -1 to 1, float32, shape (n, 2).
    """

    observations: NDArray[np.float32]
    shares: NDArray[np.float32]


class Mixture:
    """Drives by turns of the expert and of a policy, and keeps what the expert would command.

    Attributes:
        observations: Observation of each period, float32.
        commands: Command of the expert in each period.
    """

    def __init__(
        self,
        expert: MpcNavigator,
        policy: Policy | None,
        share: float,
        switch_periods: float,
        rng: np.random.Generator,
    ) -> None:
        """Prepare a drive.

        Args:
            expert: Expert.
            policy: Policy, None while there is none.
            share: Share of the time that the expert drives.
            switch_periods: Mean number of periods for which one of the two drives.
            rng: Source of randomness.
        """
        self._expert, self._policy, self._share = expert, policy, share
        self._switch_periods, self._rng = switch_periods, rng
        self._vehicle = PLANAR_VEHICLES["barn"]
        self._observer = DistilledObserver(self._vehicle.period)
        self.observations: list[NDArray[np.float32]] = []
        self.commands: list[Twist] = []

    def reset(self, lidar: PlanarLidarConfig, goal: tuple[float, float]) -> None:
        """Begin a drive; see ``PlanarNavigator``."""
        self._expert.reset(lidar, goal)
        self._observer.reset(lidar, goal)
        self._is_expert = self._rng.random() < self._share

    def act(self, readings: PlanarReadings) -> Twist:
        """Return the command of whoever drives in this period."""
        seen, command = self._observer.observe(readings), self._expert.act(readings)
        self.observations.append(seen)
        self.commands.append(command)
        if self._rng.random() < 1.0 / self._switch_periods:
            self._is_expert = self._rng.random() < self._share
        if self._policy is not None and not self._is_expert:
            command = self._vehicle.limited(command_of(self._policy.act(seen)))
            # The expert identifies the dynamics from what was commanded: it has to know of
            # commands that were not its own.
            self._expert.took(command)
        self._observer.took(command)
        return command


class LabelledDrive(NamedTuple):
    """One drive, for any process.

    Attributes:
        number: Number of the drive, from which its field and its noise are drawn.
        share: Share of the time that the expert drives.
    """

    number: int
    share: float


def drive_and_label(
    config: LabelledDriveConfig, seed: int, policy: bytes | None, drive: LabelledDrive
) -> tuple[Labels, bool]:
    """Return the labels of one drive, and whether it reached its goal.

    Args:
        config: Settings.
        seed: Seed of the distillation.
        policy: File of the policy that drives, None while there is none.
        drive: Drive.
    """
    rng = np.random.default_rng([seed, drive.number])
    # The policy reads delay, lag and accelerations, and could not learn from one robot's alone what
    # they mean.
    vehicle = PLANAR_VEHICLES["barn-drawn" if rng.random() < config.drawn_share else "barn"]
    fields = NARROW if rng.random() < config.narrow_share else PUBLISHED
    world = barn_world(config.first_seed + drive.number, fields)
    (task,) = world.room.tasks
    # Generators of their own: a policy that draws more or less changes no noise of the robot.
    robot_rng, expert_rng, turns = rng.spawn(3)
    robot = SimulatedPlanarRobot(world.room, task, vehicle, BARN_LIDAR, robot_rng)
    driver = Mixture(
        # Whatever is driven, the expert takes it for this robot and identifies the rest, as in an
        # evaluation.
        MpcNavigator(PLANAR_VEHICLES["barn"], expert_rng),
        None if policy is None else policy_from_bytes(policy),
        drive.share,
        config.switch_time / vehicle.period,
        turns,
    )
    result = drive_to_goal(driver, robot, task, DriveRules(time_limit=config.time_limit))
    shares = [_shares(command) for command in driver.commands]
    labels = Labels(np.array(driver.observations), np.array(shares, dtype=np.float32))
    return labels, result.outcome == Outcome.GOAL


def _shares(command: Twist) -> tuple[float, ...]:
    """Return a command as shares of the actions' bounds."""
    bounds = zip((command.linear, command.angular), ACTIONS.low, ACTIONS.high, strict=True)
    return tuple((2 * value - low - high) / (high - low) for value, low, high in bounds)
