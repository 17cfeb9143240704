"""Options of the reports of several runs."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass

from andabata.models import Models


@dataclass(frozen=True)
class ReportOptions:
    """What the report of off-road training drives, and with what.

    Attributes:
        models: Function that loads the classifiers of off-road runs.
        tests: Number of drives of each off-road stage's policy, each to another goal.
        workers: Number of processes.
        progress: Function that shows the progress of a work by its name and its number of steps.
    """

    models: Callable[[], Models]
    tests: int
    workers: int
    progress: Callable[[str, int], AbstractContextManager[Callable[[int], None]]]
