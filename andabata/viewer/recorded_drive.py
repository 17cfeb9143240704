"""View of a drive's run folder: the path that was driven, in its world."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.machine.clock import CONTROL_PERIOD
from andabata.machine.kinematics import SkidSteer, Twist
from andabata.machine.pose import Pose
from andabata.report.drive_frames import DriveFrame
from andabata.report.folder import RunFolderError
from andabata.viewer.controls import PlayControls
from andabata.viewer.export import EXPORT_PERIOD, EXPORT_POINTS, PageWriter
from andabata.viewer.offroad_scene import OffroadScene
from andabata.viewer.options import ViewConfig
from andabata.viewer.pace import Pace
from andabata.viewer.player import Player
from andabata.viewer.server import ViewServer
from worlds.catalogue import make_world
from worlds.world import World


@dataclass(frozen=True)
class RecordedPath:
    """What the folder of a drive has kept.

    Attributes:
        world: World.
        config: Robot.
        positions: Positions, one a control step [m], float64, shape (k, 3).
        goals: Goal at each position [m], shape (k, 2).
        title: One line about the drive.
    """

    world: World
    config: SimulatedRobotConfig
    positions: NDArray[np.float64]
    goals: NDArray[np.float64]
    title: str

    @classmethod
    def read(cls, folder: Path) -> "RecordedPath":
        """Read the folder of a drive.

        Raises:
            RunFolderError: If it is incomplete, or of another version.
        """
        try:
            data = json.loads((folder / "drive.json").read_text(encoding="utf-8"))
            about = json.loads((folder / "run.json").read_text(encoding="utf-8"))
            config = SimulatedRobotConfig.model_validate(about["config"])
            world = make_world(data["world"], int(data["world_seed"]))
            positions = np.array(data["path"], dtype=np.float64).reshape(-1, 3)
            goals = _goals(data, len(positions))
            reached = sum(each["outcome"] == "goal" for each in data["attempts"])
        except OSError as error:
            raise RunFolderError(
                f"{folder}: expected drive.json and run.json of `andabata drive`, got "
                f"{error.strerror or error}: {error.filename}"
            ) from error
        except (ValueError, KeyError, TypeError) as error:
            text = " ".join(str(error).split())
            raise RunFolderError(
                f"{folder}: expected a drive of this version, got one without {text}; drive it "
                "again, or view its recording"
            ) from error
        if not len(positions):
            raise RunFolderError(f"{folder}: expected a path, got one without positions")
        ends = f"{reached} of {len(data['goals'])} goals"
        title = f"{data['controller']} in {data['world']} {data['world_seed']}: {ends}"
        return cls(world, config, positions, goals, title)

    def frames(self) -> list[DriveFrame]:
        """Return a frame for each position: the robot looks along its path, on the ground."""
        steps = np.gradient(self.positions, axis=0) if len(self.positions) > 1 else np.zeros((1, 3))
        yaws = _headings(steps)
        speeds = np.hypot(steps[:, 0], steps[:, 1]) / CONTROL_PERIOD
        rates = np.gradient(np.unwrap(yaws)) / CONTROL_PERIOD if len(yaws) > 1 else np.zeros(1)
        kinematics, frames = SkidSteer(self.config.robot), []
        for k, (position, yaw) in enumerate(zip(self.positions, yaws.tolist(), strict=True)):
            pose = resting_pose(self.world, position, yaw)
            twist = Twist(float(speeds[k]), float(rates[k]))
            frames.append(
                DriveFrame(
                    pose=pose,
                    n_positions=k + 1,
                    stamp=k * CONTROL_PERIOD,
                    odometry=pose,
                    estimate=pose,
                    goal=self.goals[k],
                    twist=twist,
                    wheels=kinematics.wheel_speeds(twist.linear, twist.angular),
                )
            )
        return frames


def _goals(data: dict[str, Any], count: int) -> NDArray[np.float64]:
    """Return the goal at each position of a drive [m], shape (k, 2)."""
    steps = [round(each["time_s"] / CONTROL_PERIOD) + 1 for each in data["attempts"]]
    numbers = np.repeat([each["goal"] - 1 for each in data["attempts"]], steps)
    numbers = np.resize(numbers, count) if len(numbers) else np.zeros(count, dtype=int)
    return np.array(data["goals"], dtype=np.float64)[numbers]


def _headings(steps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the heading of each step [rad], that of the last one where the robot stands."""
    yaws, moves = np.arctan2(steps[:, 1], steps[:, 0]), np.hypot(steps[:, 0], steps[:, 1]) > 1e-3
    places = np.maximum.accumulate(np.where(moves, np.arange(len(steps)), 0))
    return np.asarray(yaws[places])


def resting_pose(world: World, position: NDArray[np.float64], yaw: float) -> Pose:
    """Return the pose of a body at a position [m] and a heading [rad] that lies on the ground."""
    c, s, reach = np.cos(yaw), np.sin(yaw), 0.25
    x = position[0] + reach * np.array([c, -c, -s, s])
    y = position[1] + reach * np.array([s, -s, c, -c])
    front, back, left, right = world.ground.height_at(x, y)
    pitch = -float(np.arctan2(front - back, 2 * reach))
    roll = float(np.arctan2(left - right, 2 * reach))
    return Pose.from_euler(position, roll, pitch, yaw)


class RecordedDriveView:
    """Plays the path of a drive.

    Attributes:
        server: Page.
    """

    def __init__(
        self, recorded: RecordedPath, config: ViewConfig, status: Callable[[str], None]
    ) -> None:
        """Draw the world and begin to serve.

        Args:
            recorded: Drive.
            config: Choices of who watches.
            status: Function that prints a line for the user.

        Raises:
            ViewerError: If viser is not installed.
        """
        self._status, self._is_closed = status, False
        self.server = ViewServer("andabata view", config.port)
        gui, self._pace = self.server.viser.gui, Pace(config.speed, config.is_paused)
        gui.add_markdown(
            f"**{recorded.title}**  \nA run folder keeps the path; record the drive "
            "to see clouds and cells as well."
        )
        PlayControls(gui, self._pace)
        self._player = Player(gui, self._pace)
        self._scene = OffroadScene(
            self.server.viser, recorded.config, recorded.world, EXPORT_POINTS
        )
        for layer in ("cloud", "sweep", "cells", "ranges", "plan", "estimate"):
            self._scene.show(layer, False)
        follow = gui.add_checkbox("Follow", True)
        follow.on_update(lambda event: setattr(self._scene, "follows", follow.value))
        self._frames = recorded.frames()
        self._positions: Sequence[NDArray[np.float64]] = list(recorded.positions)

    def __enter__(self) -> "RecordedDriveView":
        """Return the view."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close the page."""
        self.close()

    def run(self) -> None:
        """Play until Ctrl-C, or until the view is closed."""
        self.server.announce(self._status)
        self._player.load(len(self._frames))
        self._player.play(CONTROL_PERIOD, self._draw, lambda: self._is_closed)

    def write(self, path: Path) -> None:
        """Write the drive as a page that plays by itself."""
        every = max(round(EXPORT_PERIOD / CONTROL_PERIOD), 1)
        self._draw(0)
        with PageWriter(self.server.viser, path) as page:
            for number in range(0, len(self._frames), every):
                self._draw(number)
                page.hold(every * CONTROL_PERIOD)

    def close(self) -> None:
        """Close the page."""
        self._is_closed = True
        self._pace.close()
        self.server.close()

    def _draw(self, number: int) -> None:
        """Draw a position."""
        self._scene.draw(self._frames[number], self._positions)
