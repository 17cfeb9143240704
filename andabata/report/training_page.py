"""Page of training runs: one list of sections for every task."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from andabata.report.blocks import Fact
from andabata.report.page import Page, Section

Row = dict[str, Any]


@dataclass(frozen=True)
class TrainingSections:
    """What the runs of a task have to show, in the order of the page.

    Attributes:
        title: Title of the page.
        lead: Sentence below it.
        rows: Figures of the page, as ``--json`` has them.
        learning: Curves of learning.
        results: Table of what came of it, by stage or actor; None if the curves have it.
        runs: Table of the runs; None if the results have it.
        worlds: Worlds of the test drives, and what the robot measured there; none in rooms.
        drives: Drives of the policies.
        facts: Figures that people look for first.
    """

    title: str
    lead: str
    rows: Row
    learning: Section
    drives: Section
    results: Section | None = None
    runs: Section | None = None
    worlds: Sequence[Section] = ()
    facts: Sequence[Fact] = ()

    @property
    def page(self) -> Page:
        """Page of the runs."""
        sections = (self.learning, self.results, self.runs, *self.worlds, self.drives)
        return Page(self.title, self.lead, self.facts, sections)
