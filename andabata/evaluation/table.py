"""Tables of attempts: rows with intervals, and differences of what drove the same.

A table says by which keys attempts become rows, what is counted, and by which columns. Attempts of
a cluster are alike, such as runs of one world, or policies on one task: intervals are those of the
same contenders in other clusters of the kind. Statistics are those of ``statistics`` alone.
"""

from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.evaluation.attempt import Attempt
from andabata.evaluation.statistics import (
    Difference,
    clustered_interval,
    clustered_mean,
    mcnemar,
    paired_bootstrap,
    paired_difference,
)
from andabata.machine.planar.mover_contact import Contact
from andabata.tasks.terminations import Outcome

Row = dict[str, Any]
Key = Callable[[Attempt[Any]], Hashable]
Measure = Callable[[Attempt[Any]], float | None]
"""Measure of an attempt; None where it has none."""

Test = Callable[[Attempt[Any]], bool]


class Design(NamedTuple):
    """What is counted.

    Attributes:
        cluster: Key of attempts that are alike, such as those in one world: what an interval's
            other worlds would be.
        repeat: Key that tells attempts of a cluster apart, such as the number of a run, or the
            policy of several seeds.
    """

    cluster: Key
    repeat: Key


def by_scenario(attempt: Attempt[Any]) -> Hashable:
    """Return the key of attempts in one world or room."""
    return attempt.scenario


def by_task(attempt: Attempt[Any]) -> Hashable:
    """Return the key of attempts at one task of a room."""
    return attempt.scenario, attempt.repetition


def by_repetition(attempt: Attempt[Any]) -> Hashable:
    """Return the key of attempts of one number."""
    return attempt.repetition


def by_contender(attempt: Attempt[Any]) -> Hashable:
    """Return the key of attempts of one contender."""
    return attempt.contender


def is_success(attempt: Attempt[Any]) -> bool:
    """Return True for an attempt that reached its goal."""
    return attempt.is_success


@dataclass(frozen=True)
class Sample:
    """Attempts of one row.

    Attributes:
        attempts: Attempts in their order.
        design: Design of the evaluation: its clusters and repeats.
        of: Attempts whose clusters count, where they are more than those of ``attempts``: a trial
            that failed before its second goal has not reached it.
    """

    attempts: Sequence[Attempt[Any]]
    design: Design
    of: Sequence[Attempt[Any]] | None = None

    @cached_property
    def clusters(self) -> tuple[Hashable, ...]:
        """Clusters in the order of their first attempts."""
        return tuple(dict.fromkeys(map(self.design.cluster, self.of or self.attempts)))

    @cached_property
    def repeats(self) -> tuple[Hashable, ...]:
        """Repeats in the order of their first attempts."""
        return tuple(dict.fromkeys(map(self.design.repeat, self.of or self.attempts)))

    def grid(
        self, measure: Measure, clusters: Sequence[Hashable] | None = None
    ) -> NDArray[np.float64]:
        """Return a measure, shape (repeats, clusters); 0 where nothing was driven.

        Of several attempts of a cluster and a repeat the last one counts.

        Args:
            measure: Measure of an attempt.
            clusters: Clusters in the order of the columns; None for those of this sample.
        """
        rows = {key: k for k, key in enumerate(self.repeats)}
        columns = {key: k for k, key in enumerate(clusters or self.clusters)}
        values = np.zeros((len(rows), len(columns)))
        for attempt in self.attempts:
            # Attempts of a trial are goals in a row: its last one says how far it came.
            place = rows[self.design.repeat(attempt)], columns[self.design.cluster(attempt)]
            values[place] = measure(attempt) or 0.0
        return values

    def count(self, test: Test) -> int:
        """Return the number of attempts that pass a test."""
        return sum(map(test, self.attempts))

    def values(self, measure: Measure, where: Test | None = None) -> list[float]:
        """Return a measure of the attempts that have it and pass a test."""
        chosen = self.attempts if where is None else filter(where, self.attempts)
        return [value for value in map(measure, chosen) if value is not None]


Column = Callable[[Sample], Row]
"""Function that gives some columns of a row."""

Comparator = Callable[[Sample, Sample], Row]
"""Function that gives some columns of the difference of a second sample from a first one."""


def counts(**outcomes: Outcome) -> Column:
    """Return columns with the number of attempts that ended so, by their names."""

    def column(sample: Sample) -> Row:
        ends = [attempt.outcome for attempt in sample.attempts]
        return {name: ends.count(outcome) for name, outcome in outcomes.items()}

    return column


def hit_counts(sample: Sample) -> Row:
    """Return the collisions with movers, by who drove into whom; see ``Contact``.

    They are those of the robot's own motion, and those that a mover caused, while the robot drove
    and while it stood.
    """
    contacts = [a.contact for a in sample.attempts if a.outcome is Outcome.COLLISION]
    return {
        "hit_mover": contacts.count(Contact.MOVER),
        "hit_by_mover": contacts.count(Contact.HIT),
        "hit_at_rest": contacts.count(Contact.HIT_AT_REST),
    }


def share(test: Test = is_success, name: str = "success_rate", ends: str = "success") -> Column:
    """Return columns of a share of all attempts, with Wilson's interval over the clusters.

    Args:
        test: Condition of an attempt that counts.
        name: Name of the share.
        ends: Names of the ends of the interval, before ``_low`` and ``_high``.
    """

    def column(sample: Sample) -> Row:
        # Over clusters, not attempts: trials of one world are alike, and intervals that take them
        # for independent are too narrow.
        passed = sample.grid(test) > 0
        low, high = clustered_interval(passed)
        return {name: int(passed.sum()) / passed.size, f"{ends}_low": low, f"{ends}_high": high}

    return column


def average(name: str, measure: Measure, where: Test | None = None) -> Column:
    """Return a column of the mean over attempts that have a measure; None without any."""

    def column(sample: Sample) -> Row:
        values = sample.values(measure, where)
        return {name: float(np.mean(values)) if values else None}

    return column


def mean(name: str, measure: Measure, most: float = np.inf) -> Column:
    """Return columns of a mean with Student's interval over the clusters.

    Args:
        name: Name of the measure.
        measure: Measure from 0 to ``most``; Student's interval knows no bounds, the measure does.
        most: Largest value.
    """

    def column(sample: Sample) -> Row:
        estimate = clustered_mean(sample.grid(measure))
        # Student's interval of few worlds can go beyond what a score can be.
        low = None if estimate.low is None else max(estimate.low, 0.0)
        high = None if estimate.high is None else min(estimate.high, most)
        return {name: estimate.mean, f"{name}_low": low, f"{name}_high": high}

    return column


Method = Callable[[NDArray[np.bool_], NDArray[np.bool_]], Difference]
"""Function that gives the difference of two grids of successes; see ``statistics``."""


def pair(base: Sample, other: Sample, measure: Measure) -> tuple[Any, Any]:
    """Return a measure of two samples with the same clusters, shapes (repeats, clusters).

    Raises:
        ValueError: If one has clusters that the other lacks.
    """
    # A difference over different worlds would be that of the worlds.
    if set(base.clusters) != set(other.clusters):
        lacks = set(base.clusters) ^ set(other.clusters)
        raise ValueError(f"pairs: expected the same scenarios of both, got {len(lacks)} of one")
    return base.grid(measure), other.grid(measure, base.clusters)


def share_difference(
    name: str, test: Test = is_success, method: Method = paired_difference
) -> Comparator:
    """Return columns of the difference of two shares on the same clusters."""

    def comparator(base: Sample, other: Sample) -> Row:
        first, second = pair(base, other, test)
        return _columns(name, method(first > 0, second > 0))

    return comparator


def mean_difference(name: str, measure: Measure) -> Comparator:
    """Return columns of the difference of two means with Student's interval over the clusters."""

    def comparator(base: Sample, other: Sample) -> Row:
        first, second = pair(base, other, measure)
        estimate = clustered_mean(second - first)
        return {name: estimate.mean, f"{name}_low": estimate.low, f"{name}_high": estimate.high}

    return comparator


def bootstrap_difference(name: str, measure: Measure, seed: int = 0) -> Comparator:
    """Return columns of the difference of two means with an interval of resampled clusters."""

    def comparator(base: Sample, other: Sample) -> Row:
        first, second = pair(base, other, measure)
        return _columns(name, paired_bootstrap(first, second, np.random.default_rng(seed)))

    return comparator


def mcnemar_test(name: str, test: Test = is_success) -> Comparator:
    """Return columns of McNemar's exact test: pairs that one alone passes, and the p value."""

    def comparator(base: Sample, other: Sample) -> Row:
        first, second = pair(base, other, test)
        result = mcnemar(first > 0, second > 0)
        wins = {f"{name}_gained": result.gained, f"{name}_lost": result.lost}
        return {**wins, f"{name}_p": result.p_value}

    return comparator


def _columns(name: str, difference: Difference) -> Row:
    """Return the columns of a difference."""
    return {name: difference.mean, f"{name}_low": difference.low, f"{name}_high": difference.high}


def row_of(columns: Iterable[Column], sample: Sample) -> Row:
    """Return the row of a sample."""
    return {name: value for column in columns for name, value in column(sample).items()}


@dataclass(frozen=True)
class Table:
    """Table of attempts.

    Attributes:
        by: Key of a row.
        design: Design of the evaluation: its clusters and repeats.
        columns: Columns of a row, in their order.
        comparators: Columns of a difference from the first row, in their order.
        within: Key of the rows whose differences are taken: each from the first with the same key.
    """

    by: Key
    design: Design
    columns: Sequence[Column]
    comparators: Sequence[Comparator] = ()
    within: Key = lambda _: None

    def samples(self, attempts: Iterable[Attempt[Any]]) -> list[Sample]:
        """Return the samples of the rows, in the order of their first attempts."""
        groups: dict[Hashable, list[Attempt[Any]]] = {}
        for attempt in attempts:
            groups.setdefault(self.by(attempt), []).append(attempt)
        return [Sample(tuple(some), self.design) for some in groups.values()]

    def rows(self, attempts: Iterable[Attempt[Any]]) -> list[Row]:
        """Return a row of each key, in the order of their first attempts."""
        return [row_of(self.columns, sample) for sample in self.samples(attempts)]

    def pairs(self, attempts: Iterable[Attempt[Any]]) -> list[tuple[Sample, Sample]]:
        """Return the first sample of each ``within`` with each of its others."""
        groups: dict[Hashable, list[Sample]] = {}
        for sample in self.samples(attempts):
            groups.setdefault(self.within(sample.attempts[0]), []).append(sample)
        return [(base, other) for base, *others in groups.values() for other in others]

    def differences(self, attempts: Iterable[Attempt[Any]]) -> list[Row]:
        """Return a row of the difference of each sample from the first one of its ``within``.

        Raises:
            ValueError: If two that are compared did not drive the same.
        """
        return [
            {key: value for column in self.comparators for key, value in column(*two).items()}
            for two in self.pairs(attempts)
        ]
