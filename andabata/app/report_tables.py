"""Figures of reports as tables for people."""

from collections.abc import Mapping
from typing import Any

from rich.table import Table

from andabata.app.console import table_of
from andabata.report.columns import spoken
from andabata.report.room_training import group_table
from andabata.report.success import success_table

Data = Mapping[str, Any]

_ATTEMPT = ("drive", "goal", "outcome", "time_s", "distance_m", "spl")
"""Columns of an attempt that a terminal has room for."""


def splits_table(data: Data) -> Table:
    """Return the table of the splits of labelled clouds."""
    return table_of([spoken(row) for row in data["splits"]])


def goals_table(data: Data) -> Table:
    """Return the table of the attempts of drives."""
    return table_of([spoken(row, _ATTEMPT) for row in data["goals"]])


def drives_table(data: Data) -> Table:
    """Return the table of the test drives of training off-road."""
    return table_of([spoken(row) for row in data["tests"]])


def actors_table(data: Data) -> Table:
    """Return the table of the actors that were trained in rooms."""
    return table_of(group_table(data["groups"]))


def plans_table(data: Data) -> Table:
    """Return the table of the plans whose success is drawn against episodes."""
    return table_of(success_table(data["groups"]))
