"""Folder of an evaluation in rooms: policies, drives, journal and results."""

import hashlib
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

from andabata.evaluation.room_drives import RoomDrive, drives_from_bytes, drives_to_bytes
from andabata.evaluation.room_table import Cell
from andabata.evaluation.rooms import RoomEvaluationConfig, cells_of
from andabata.report.folder import (
    ABOUT,
    check_keys,
    read_about,
    read_result,
    settings_of,
)
from andabata.runs import atomic_io
from andabata.runs.folder import describe, make_folder, write_json
from rl.policy import Policy, load_policy

RESULT = "evaluation.json"
_DRIVES, _POLICIES = "drives", "policies"


class RoomFolder:
    """Reads and writes the files of an evaluation in rooms.

    ``cells.jsonl`` is the journal, ``drives/K.npz`` holds the drives of cell K in the order of
    ``cells_of``, ``policies/K.safetensors`` policy K; ``evaluation.json`` is the result and
    ``run.json`` says how it was made.

    Attributes:
        path: Path of the folder.
    """

    def __init__(self, path: Path) -> None:
        """Take a folder, which need not exist yet."""
        self.path = path

    @property
    def journal(self) -> Path:
        """Path of the journal of finished cells."""
        return self.path / "cells.jsonl"

    def begin(self) -> None:
        """Make the folder."""
        make_folder(self.path / _DRIVES)
        make_folder(self.path / _POLICIES)

    def keep_drives(self, number: int, drives: Sequence[RoomDrive]) -> None:
        """Write the drives of a cell."""
        atomic_io.write(self._drives(number), drives_to_bytes(drives))

    def finish(
        self,
        verb: str,
        config: RoomEvaluationConfig,
        policies: Mapping[str, Policy],
        data: Mapping[str, Any],
    ) -> None:
        """Write policies, result and settings.

        Args:
            verb: Command that was run.
            config: Settings of the cells.
            policies: Policies by name.
            data: Result of the command, ready for JSON.
        """
        for number, policy in enumerate(policies.values()):
            atomic_io.write(self._policy(number), policy.to_bytes())
        write_json(self.path / RESULT, data)
        about: dict[str, Any] = {"task": config.task.task, "cells": config.model_dump(mode="json")}
        # JSON's keys are sorted when they are written: the order of the files stands in a list.
        about["policies"] = policy_hashes(policies)
        about["policy_names"] = list(policies)
        write_json(self.path / "run.json", describe(verb, data["config"], config.seed) | about)

    @cached_property
    def about(self) -> dict[str, Any]:
        """How the evaluation was made.

        Raises:
            RunFolderError: If there is no finished evaluation.
        """
        found = read_about(self.path)
        check_keys(found, ("cells", "policies"), self.path / ABOUT, self.path)
        return found

    @cached_property
    def result(self) -> dict[str, Any]:
        """Result of the command.

        Raises:
            RunFolderError: If there is no finished evaluation.
        """
        return read_result(self.path, RESULT, ("rows",))

    @cached_property
    def config(self) -> RoomEvaluationConfig:
        """Settings of the cells."""
        return settings_of(RoomEvaluationConfig, self.about["cells"], self.path)

    @cached_property
    def policies(self) -> dict[str, Policy]:
        """Policies by name.

        Raises:
            PolicyFileError: If a file is no policy.
        """
        return {name: load_policy(self._policy(number)) for number, name in enumerate(self._names)}

    def drives(self, cell: Cell) -> list[RoomDrive]:
        """Return the drives of a cell.

        Raises:
            ValueError: If there is no such cell, or its file is damaged.
        """
        path = self._drives(cells_of(self.config, self._names).index(cell))
        return drives_from_bytes(path.read_bytes(), str(path))

    @property
    def _names(self) -> tuple[str, ...]:
        """Names of the policies in the order of their files."""
        if "policy_names" in self.about:
            return tuple(self.about["policy_names"])
        # Folders of earlier versions: results are in that order.
        found = self.result.get("policies") or [row["policy"] for row in self.result["rows"]]
        return tuple(dict.fromkeys(found))

    def _drives(self, number: int) -> Path:
        """Return the path of the drives of a cell."""
        return self.path / _DRIVES / f"{number}.npz"

    def _policy(self, number: int) -> Path:
        """Return the path of a policy."""
        return self.path / _POLICIES / f"{number}.safetensors"


def policy_hashes(policies: Mapping[str, Policy]) -> dict[str, str]:
    """Return the SHA-256 of policies' files by name."""
    return {
        name: hashlib.sha256(policy.to_bytes()).hexdigest() for name, policy in policies.items()
    }
