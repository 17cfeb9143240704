"""A benchmark of three worlds and one controller: a comparison, and what a registry needs of it."""

from dataclasses import dataclass

from pydantic import BaseModel

from andabata.app.console import table_of
from andabata.app.jobs.evaluation import Evaluation
from andabata.evaluation.attempt import Attempt
from andabata.evaluation.comparison import DrivenCell
from andabata.evaluation.table import (
    Design,
    Table,
    by_contender,
    by_scenario,
    mean_difference,
    share,
    share_difference,
)
from andabata.machine.planar.mover_contact import Contact
from andabata.report.blocks import Table as Rows
from andabata.report.folder import read_result
from andabata.report.page import Page, Section
from andabata.tasks.terminations import Outcome

WORLDS = ("plain", "hill", "moor")
"""Worlds of the benchmark; the moor is too wet to cross."""

TOY_TABLE = Table(
    by=by_contender,
    design=Design(cluster=by_scenario, repeat=lambda attempt: attempt.repetition),
    columns=(lambda sample: {"controller": sample.attempts[0].contender}, share()),
    comparators=(share_difference("gain"), mean_difference("distance", lambda run: run.distance)),
)


@dataclass(frozen=True)
class ToyComparison:
    """Controllers in the worlds of the benchmark; a cell is a world.

    Attributes:
        controllers: Names of the controllers.
        seed: Seed of nothing.
    """

    unit = "worlds"
    journal = "toy.jsonl"

    controllers: tuple[str, ...] = ("walker",)
    seed: int = 0

    @property
    def about(self):
        """Heading of the journal."""
        return {"controllers": list(self.controllers), "seed": self.seed}

    def cells(self):
        """Return the worlds."""
        return WORLDS

    def label(self, cell):
        """Return the name of a world."""
        return f"the {cell}"

    def drive(self, cell):
        """Drive every controller through a world."""
        attempts = tuple(_attempt(name, cell, len(cell)) for name in self.controllers)
        return DrivenCell(attempts, {f"maps/{cell}.txt": cell.encode()})

    def encode(self, cell, attempts):
        """Return the entry of a world."""
        return {"world": cell, "distances": {each.contender: each.distance for each in attempts}}

    def decode(self, entry):
        """Return the world of an entry and its attempts."""
        driven = entry["distances"].items()
        return entry["world"], tuple(_attempt(name, entry["world"], far) for name, far in driven)


def _attempt(name, world, distance):
    """Return the attempt of a controller that never goes astray."""
    outcome = Outcome.STUCK if world == "moor" else Outcome.GOAL
    return Attempt(name, world, 0, outcome, Contact.NONE, 1.0, float(distance), 3.0, None)


class ToyConfig(BaseModel):
    """Settings of the benchmark."""

    controllers: tuple[str, ...] = ("walker",)
    seed: int = 0


def toy_evaluation(request):
    """Return the evaluation of a request."""
    config = request.settings.resolve(ToyConfig, ToyConfig(seed=request.seed))
    comparison = ToyComparison(config.controllers, config.seed)

    def tabulate(attempts, _):
        return {"rows": TOY_TABLE.rows(attempts), "differences": TOY_TABLE.differences(attempts)}

    return Evaluation("evaluate", config, config.seed, comparison, tabulate, {"task": "toy"})


def toy_table(data):
    """Return the table for people."""
    return table_of(data["rows"])


def report_toy(folder):
    """Return a page about an evaluation, and its figures."""
    data = read_result(folder, "evaluation.json", ("rows",))
    success = Section("Success", "Of all controllers.", Rows(data["rows"]))
    return Page("Toy", "Three worlds.", sections=[success]), {"rows": data["rows"]}
