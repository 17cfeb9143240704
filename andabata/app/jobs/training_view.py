"""Live table of a training run in a terminal, with warnings that name their cause."""

import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from rich.box import SIMPLE_HEAD
from rich.console import Group
from rich.table import Table
from rich.text import Text

from rl.curriculum import TrainingIteration
from rl.curriculum_config import Stage

EPISODES = 50
"""Number of the latest episodes of a stage that success and warnings count."""

_MANY_CIRCLE = 0.2
"""Share of circling episodes from which there is a warning."""

_MANY_LATE = 0.6
"""Share of episodes that run out of time, or get stuck, from which there is a warning."""

_LATE = ("timeout", "stuck")
"""Ends of episodes in which the robot neither arrived nor hit anything."""

_SPEEDS = 20
"""Number of iterations that the speed is taken over."""


@dataclass
class StageProgress:
    """Latest iterations of a stage.

    Attributes:
        latest: Iterations that hold the last ``EPISODES`` episodes, the oldest first.
        validation: Latest validation of the stage, None before.
    """

    latest: deque[TrainingIteration] = field(default_factory=deque)
    validation: float | None = None

    def add(self, update: TrainingIteration) -> None:
        """Add an iteration and drop those that the last episodes do not reach."""
        self.latest.append(update)
        while self.episodes - self.latest[0].played >= EPISODES:
            self.latest.popleft()
        self.validation = update.validation.get(update.name, self.validation)

    @property
    def episodes(self) -> int:
        """Number of episodes of the iterations."""
        return sum(one.played for one in self.latest)

    @property
    def success(self) -> float:
        """Share of these episodes that reached their goals."""
        return self._mean(lambda one: one.success_rate)

    @property
    def circling(self) -> float:
        """Share of these episodes in which the robot circled."""
        return self._mean(lambda one: one.circling)

    @property
    def late(self) -> float:
        """Share of these episodes that ran out of time or got stuck."""
        ends = sum(one.outcomes.get(end, 0) for one in self.latest for end in _LATE)
        return ends / self.episodes

    @property
    def rewards(self) -> dict[str, float]:
        """Mean reward of a control step, whole and by term."""
        steps = sum(one.mean_steps * one.played for one in self.latest)
        names = dict.fromkeys(name for one in self.latest for name in one.terms)
        means = {
            name: sum(one.terms.get(name, 0.0) * one.played for one in self.latest) / steps
            for name in names
        }
        return {"whole": sum(o.mean_return * o.played for o in self.latest) / steps} | means

    def _mean(self, figure: Callable[[TrainingIteration], float]) -> float:
        """Return the mean of a figure over the episodes."""
        return sum(figure(one) * one.played for one in self.latest) / self.episodes


class TrainingView:
    """Table of a run's stages that rich shows and refreshes; called after each iteration."""

    def __init__(
        self,
        stages: Mapping[str, Stage],
        title: str,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Begin a table.

        Args:
            stages: Stages of the run in order, by name.
            title: Title of the table.
            clock: Time [s] from any zero.
        """
        self._stages, self._title, self._clock = stages, title, clock
        self._progress: dict[str, StageProgress] = {}
        self._last: TrainingIteration | None = None
        self._begin: tuple[float, float] | None = None
        self._speeds: deque[tuple[float, int]] = deque(maxlen=_SPEEDS)

    def __call__(self, update: TrainingIteration) -> None:
        """Take the figures of an iteration."""
        now = self._clock()
        self._progress.setdefault(update.name, StageProgress()).add(update)
        self._last = update
        self._speeds.append((now, update.steps))
        # The first iteration holds the start of the processes: the remaining time goes by the rest.
        self._begin = self._begin or (now, self._done())

    def __rich__(self) -> Group:
        """Return the table, the speed, and the warnings of the present stage."""
        parts: list[Table | Text] = [self._table(), Text(self._speed())]
        if self._last is not None:
            progress = self._progress[self._last.name]
            parts += [Text(f"warning: {one}", style="yellow") for one in warnings_of(progress)]
        return Group(*parts)

    def _table(self) -> Table:
        """Return a row for each stage."""
        table = Table(
            title=self._title, title_justify="left", box=SIMPLE_HEAD, padding=(0, 1, 0, 0)
        )
        table.add_column("stage")
        for heading in ("episode", f"last {EPISODES}", "validation", "reward a step"):
            table.add_column(heading, justify="right")
        table.add_column("terms")
        for name, stage in self._stages.items():
            table.add_row(name, *self._cells(name, stage))
        return table

    def _cells(self, name: str, stage: Stage) -> list[str]:
        """Return the cells of a stage."""
        progress = self._progress.get(name)
        if progress is None:
            return ["", "", "", "", ""]
        last = progress.latest[-1]
        rewards = progress.rewards
        terms = ", ".join(f"{k} {v:+.2f}" for k, v in rewards.items() if k != "whole")
        level = "" if last.difficulty is None else f" at {last.difficulty:.1f}"
        validation = "" if progress.validation is None else f"{progress.validation:.2f}"
        return [
            f"{last.episodes}" if stage.steps else f"{last.episodes}/{stage.episodes}",
            f"{progress.success:.0%}{level}",
            validation,
            f"{rewards['whole']:+.2f}",
            terms,
        ]

    def _speed(self) -> str:
        """Return steps, steps a second and the remaining time."""
        if self._last is None:
            return "starting"
        (began, first), (now, steps) = self._speeds[0], self._speeds[-1]
        rate = f"{(steps - first) / (now - began):,.0f} steps a second" if now > began else ""
        done = f"{steps:,} steps ({self._done():.0%} of the budget)"
        return ", ".join(part for part in (done, rate, self._remaining()) if part)

    def _remaining(self) -> str:
        """Return the remaining time if the rest goes as the part so far; empty at first."""
        if self._begin is None:
            return ""
        began, before = self._begin
        now, done = self._speeds[-1][0], self._done()
        if done <= before:
            return ""
        seconds = round((1 - done) * (now - began) / (done - before))
        return f"ETA {seconds // 3600}:{seconds // 60 % 60:02}:{seconds % 60:02}"

    def _done(self) -> float:
        """Return the spent share of the budget: steps if every stage has some, else episodes."""
        budgets = list(self._stages.values())
        by_steps = all(stage.steps is not None for stage in budgets)
        total = spent = 0.0
        over = True
        for name, stage in self._stages.items():
            budget = float(stage.steps or 0) if by_steps else float(stage.episodes)
            total += budget
            if self._last is not None and name == self._last.name:
                used = self._last.stage_steps if by_steps else self._last.episodes
                spent += budget if self._last.is_last else min(float(used), budget)
                over = False
            elif over:
                spent += budget
        return spent / total


def warnings_of(progress: StageProgress) -> list[str]:
    """Return what goes wrong in the latest episodes, with its cause in the rewards.

    Args:
        progress: Latest iterations of a stage.
    """
    if progress.episodes < EPISODES:
        return []
    if progress.circling >= _MANY_CIRCLE:
        return [f"{progress.circling:.0%} of the last episodes circle: {_cause(progress)}"]
    if progress.late >= _MANY_LATE:
        return [
            f"{progress.late:.0%} of the last episodes stand or run out of time: {_cause(progress)}"
        ]
    return []


def _cause(progress: StageProgress) -> str:
    """Return why a policy may neither arrive nor collide, from the terms of its reward."""
    terms = {name: value for name, value in progress.rewards.items() if name != "whole"}
    if terms:
        best, worst = max(terms, key=terms.__getitem__), min(terms, key=terms.__getitem__)
        if terms[worst] < 0 and -terms[worst] > max(terms[best], 0.0):
            return (
                f"{worst} costs {-terms[worst]:.2f} a step, more than {best} earns "
                f"({terms[best]:+.2f}); lower its weight, or begin with easier worlds"
            )
    return "a time-out costs next to nothing; give steps a cost, or weigh progress more"
