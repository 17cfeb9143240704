"""Folder of an evaluation in rooms: policies, drives, journal and results."""

import hashlib
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

from andabata.evaluation.room_drives import RoomAttempt, drives_from_bytes
from andabata.evaluation.room_table import Cell
from andabata.evaluation.rooms import DRIVES, RoomComparison, RoomEvaluationConfig, cells_of
from andabata.report.folder import (
    ABOUT,
    check_keys,
    read_about,
    read_result,
    settings_of,
)
from rl.policy import Policy, load_policy

RESULT = "evaluation.json"


class RoomFolder:
    """Reads the files of an evaluation in rooms.

    ``cells.jsonl`` is the journal, ``drives/K.npz`` holds the drives of cell K in the order of
    ``cells_of``, ``policies/K.safetensors`` policy K; ``evaluation.json`` is the result and
    ``run.json`` says how it was made.

    Attributes:
        path: Path of the folder.
    """

    def __init__(self, path: Path) -> None:
        """Take a folder, which need not exist yet."""
        self.path = path

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

    @property
    def journal(self) -> Path:
        """Path of the journal of finished cells."""
        return self.path / RoomComparison.journal

    def drives(self, cell: Cell) -> list[RoomAttempt]:
        """Return the drives of a cell.

        Raises:
            ValueError: If there is no such cell, or its file is damaged.
        """
        number = cells_of(self.config, self._names).index(cell)
        path = self.path / DRIVES / f"{number}.npz"
        return drives_from_bytes(path.read_bytes(), str(path))

    @property
    def _names(self) -> tuple[str, ...]:
        """Names of the policies in the order of their files."""
        if "policy_names" in self.about:
            return tuple(self.about["policy_names"])
        # Folders of earlier versions: results are in that order.
        found = self.result.get("policies") or [row["policy"] for row in self.result["rows"]]
        return tuple(dict.fromkeys(found))

    def _policy(self, number: int) -> Path:
        """Return the path of a policy."""
        return self.path / _policy_name(number)


def policy_files(policies: Mapping[str, Policy]) -> dict[str, bytes]:
    """Return the bytes of policies by the paths of their files in a folder."""
    return {_policy_name(k): policy.to_bytes() for k, policy in enumerate(policies.values())}


def about_policies(config: RoomEvaluationConfig, policies: Mapping[str, Policy]) -> dict[str, Any]:
    """Return what ``run.json`` says of cells and policies, ready for JSON."""
    return {
        "task": config.task.task,
        "cells": config.model_dump(mode="json"),
        "policies": {
            name: hashlib.sha256(policy.to_bytes()).hexdigest() for name, policy in policies.items()
        },
        # JSON's keys are sorted when they are written: the order of the files stands in a list.
        "policy_names": list(policies),
    }


def _policy_name(number: int) -> str:
    """Return the path of a policy's file in a folder."""
    return f"policies/{number}.safetensors"
