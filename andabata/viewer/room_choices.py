"""Drives of an evaluation in rooms that can be looked at, by what tells them apart."""

from collections.abc import Mapping, Sequence
from typing import Protocol

from andabata.evaluation.barn import BarnEvaluationConfig, world_names
from andabata.evaluation.room_moments import WatchedDrive, watch_barn, watch_cell
from andabata.evaluation.room_table import Cell
from andabata.evaluation.rooms import tasks_of
from andabata.report.room_folder import RoomFolder
from worlds.rooms.catalogue import make_room


class DriveChoices(Protocol):
    """Drives to choose from."""

    @property
    def choices(self) -> Mapping[str, Sequence[str]]:
        """Values to choose from by the name of what is chosen, in their order."""

    def load(self, chosen: Mapping[str, str]) -> WatchedDrive:
        """Return a drive with all its moments.

        Args:
            chosen: A value for each name of ``choices``.
        """

    def remark(self, chosen: Mapping[str, str], drive: WatchedDrive) -> str:
        """Return what there is to say of a drive that was loaded."""


class CellChoices:
    """Drives of an evaluation in rooms: by policy, room, laser and memory."""

    def __init__(self, folder: RoomFolder) -> None:
        """Take the folder of the evaluation."""
        self._folder, config = folder, folder.config
        counts = [len(tasks_of(make_room(room), config)) for room in config.rooms]
        self.choices = {
            "policy": list(folder.about["policies"]),
            "room": list(dict.fromkeys(config.rooms)),
            "laser": list(dict.fromkeys(config.lidars)),
            "memory": list(dict.fromkeys(config.memories)),
            "drive": [str(number) for number in range(max(counts))],
        }

    def load(self, chosen: Mapping[str, str]) -> WatchedDrive:
        """Drive a task again."""
        policy = self._folder.policies[chosen["policy"]]
        return watch_cell(self._folder.config, policy, _cell(chosen), int(chosen["drive"]))

    def remark(self, chosen: Mapping[str, str], drive: WatchedDrive) -> str:
        """Return how the drive ended, and whether that is what the evaluation has kept."""
        kept = self._folder.drives(_cell(chosen))[int(chosen["drive"])]
        steps = len(drive.moments) - 1
        text = f"{drive.outcome} after {steps} steps"
        if (str(kept.outcome), kept.detail.steps) == (drive.outcome, steps):
            return text
        return f"{text}; in the evaluation: {kept.outcome} after {kept.detail.steps}"


class BarnChoices:
    """Runs of a BARN evaluation: by controller, world and trial."""

    def __init__(self, config: BarnEvaluationConfig) -> None:
        """Take the settings of the evaluation."""
        self._config = config
        self.choices = {
            "controller": list(config.controllers),
            "world": list(world_names(config)),
            "trial": [str(number) for number in range(config.trials)],
        }

    def load(self, chosen: Mapping[str, str]) -> WatchedDrive:
        """Drive a run again."""
        names = chosen["world"], chosen["controller"]
        return watch_barn(self._config, *names, int(chosen["trial"]))

    def remark(self, chosen: Mapping[str, str], drive: WatchedDrive) -> str:
        """Return how the run ended."""
        return f"{drive.outcome} after {drive.period * len(drive.moments):.1f} s"


def _cell(chosen: Mapping[str, str]) -> Cell:
    """Return the cell of what was chosen."""
    return Cell(chosen["policy"], chosen["laser"], chosen["room"], chosen["memory"])
