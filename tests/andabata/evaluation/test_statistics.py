"""Intervals of success rates, and of differences of pairs."""

import numpy as np
import pytest

from andabata.evaluation.statistics import (
    clustered_interval,
    clustered_mean,
    group_difference,
    mcnemar,
    paired_bootstrap,
    paired_difference,
    wilson_interval,
)


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    [
        (49, 50, 0.8950, 0.9965),
        (10, 20, 0.2993, 0.7007),
        (0, 20, 0.0, 0.1611),
        (20, 20, 0.8389, 1.0),
    ],
)
def test_known_intervals(successes, trials, low, high):
    """The 95 % intervals are those of the literature, closed at 0 and at 1."""
    assert wilson_interval(successes, trials) == pytest.approx((low, high), abs=1e-4)


@pytest.mark.parametrize(("successes", "trials"), [(2, 1), (-1, 3), (0, 0)])
def test_impossible_counts_are_refused(successes, trials):
    """More successes than trials, negative counts and no trials are errors."""
    with pytest.raises(ValueError, match="expected 0 <= successes <= trials"):
        wilson_interval(successes, trials)


def test_failures_mirror_successes():
    """The interval of the failures is that of the successes, mirrored at one half."""
    for successes in range(21):
        low, high = wilson_interval(successes, 20)
        assert wilson_interval(20 - successes, 20) == pytest.approx((1 - high, 1 - low))


def test_a_smaller_quantile_gives_a_narrower_interval():
    """The 68 % interval lies within the 95 % interval."""
    low, high = wilson_interval(7, 20)
    inner_low, inner_high = wilson_interval(7, 20, z=1.0)
    assert low < inner_low < 7 / 20 < inner_high < high


def test_copies_of_a_policy_add_nothing():
    """Policies that do the same on every task have the interval of one of them."""
    one = np.arange(100) < 80
    alone = wilson_interval(80, 100)
    assert clustered_interval(one[None]) == pytest.approx(alone, abs=1e-12)
    assert clustered_interval(np.tile(one, (5, 1))) == pytest.approx(alone, abs=2e-3)


def test_independent_policies_count_as_trials_of_their_own():
    """Policies that fail on tasks of their own have nearly the interval of all trials."""
    rng = np.random.default_rng(0)
    several = rng.random((5, 400)) < 0.9
    low, high = clustered_interval(several)
    all_low, all_high = wilson_interval(int(several.sum()), several.size)
    assert high - low == pytest.approx(all_high - all_low, rel=0.1)
    # Never narrower than with every trial on its own, never wider than with one a task.
    assert high - low >= all_high - all_low - 1e-12


def test_tasks_that_all_end_alike_count_once():
    """All successes of several policies have the interval of one policy's."""
    assert clustered_interval(np.ones((5, 20), dtype=bool)) == wilson_interval(20, 20)
    assert clustered_interval(np.zeros((5, 20), dtype=bool)) == wilson_interval(0, 20)


def test_known_means_of_tasks():
    """Trials of a task count as one: Student's interval of three tasks, and none of one."""
    found = clustered_mean(np.array([[0.0, 1.5, 3.0], [2.0, 2.5, 3.0]]))
    reach = 4.302653 * 1.0 / np.sqrt(3)  # The quantile of two degrees of freedom.
    assert found == pytest.approx((2.0, 2.0 - reach, 2.0 + reach), abs=1e-6)
    two = clustered_mean(np.array([[1.0, 3.0]]))
    assert two == pytest.approx((2.0, 2.0 - 12.706205, 2.0 + 12.706205), abs=1e-5)
    narrow = clustered_mean(np.array([[1.0, 2.0, 3.0]]), level=0.9)
    assert narrow.high - 2.0 == pytest.approx(2.919986 / np.sqrt(3), abs=1e-6)
    assert clustered_mean(np.array([[1.0], [2.0]])) == (1.5, None, None)
    with pytest.raises(ValueError, match=r"expected trials x tasks, got shape \(0, 3\)"):
        clustered_mean(np.empty((0, 3)))


def test_known_paired_differences():
    """Ten tasks lost and thirty gained of a hundred: the adjusted interval by hand."""
    first, second = np.zeros(100, dtype=bool), np.zeros(100, dtype=bool)
    first[:10], second[10:40] = True, True
    found = paired_difference(first, second)
    middle, variance = 20 / 102, 41 / 102 - (20 / 102) ** 2
    reach = 1.959964 * (variance / 102) ** 0.5
    assert found == pytest.approx((0.2, middle - reach, middle + reach))
    assert found.low > 0
    back = paired_difference(second, first)
    assert back == pytest.approx((-0.2, -found.high, -found.low))


def test_the_interval_of_no_difference_is_not_empty():
    """Where no task differs the interval still has a width, which falls with the tasks."""
    few, many = (
        paired_difference(np.ones(n, dtype=bool), np.ones(n, dtype=bool)) for n in (10, 1000)
    )
    assert few.mean == many.mean == 0
    assert few.low == -few.high
    assert few.high > 0.15 > 0.01 > many.high > 0


def test_pairs_are_clustered_by_task():
    """A policy beside its copy gives the difference of one alone; others narrow the interval."""
    rng = np.random.default_rng(1)
    first, second = rng.random((4, 300)) < 0.7, rng.random((4, 300)) < 0.75
    alone = paired_difference(first[0], second[0])
    copied = paired_difference(first[[0, 0]], second[[0, 0]])
    assert copied == pytest.approx(alone)
    together = paired_difference(first, second)
    assert together.mean == pytest.approx(second.mean() - first.mean())
    assert together.high - together.low < 0.7 * (alone.high - alone.low)


def test_single_policies_are_groups_of_one():
    """The difference of two policies is that of their pairs."""
    rng = np.random.default_rng(1)
    first, second = rng.random((1, 300)) < 0.7, rng.random((1, 300)) < 0.75
    assert group_difference(first, second) == pytest.approx(paired_difference(first, second))


def test_the_spread_of_seeds_counts_beside_that_of_tasks():
    """Groups of any size; copies of one seed have no spread, seeds that differ widen it."""
    rng = np.random.default_rng(1)
    first, one = rng.random((1, 300)) < 0.7, rng.random(300) < 0.8
    copies = group_difference(first, np.stack([one] * 3))
    assert copies == pytest.approx(group_difference(first, one[None]))
    worse, better = one.copy(), one.copy()
    worse[:30], better[30:60] = False, True
    spread = group_difference(first, np.stack([worse, one, better]))
    rates = np.mean([worse, one, better], axis=1)
    by_task = np.mean([worse, one, better], axis=0) - first[0]
    tasks = ((by_task**2).sum() + 1) / 302 - (by_task.sum() / 302) ** 2
    reach = 1.959964 * (tasks / 302 + rates.var(ddof=1) / 3) ** 0.5
    assert spread.high - spread.low == pytest.approx(2 * reach)
    back = group_difference(np.stack([worse, one, better]), first)
    assert back == pytest.approx((-spread.mean, -spread.high, -spread.low))


def test_groups_on_other_tasks_are_refused():
    """Groups drive the same tasks."""
    with pytest.raises(ValueError, match=r"expected the same tasks, got \(1, 3\) and \(2, 4\)"):
        group_difference(np.ones((1, 3), dtype=bool), np.ones((2, 4), dtype=bool))


def test_the_interval_holds_the_true_difference_as_often_as_it_says():
    """Of 400 experiments with a true difference of 5 points about 95 % hold it."""
    rng, held = np.random.default_rng(2), 0
    for _ in range(400):
        draws = rng.random((2, 150))
        # Half of the tasks draw once for both ways: pairs are alike.
        draws[1, :75] = draws[0, :75]
        found = paired_difference(draws[0] < 0.85, draws[1] < 0.90)
        held += found.low <= 0.05 <= found.high
    assert 0.92 <= held / 400 <= 0.98


def test_pairs_that_do_not_fit_are_refused():
    """Other tasks in the second way, no tasks, and no policies are errors."""
    with pytest.raises(ValueError, match=r"expected the same policies and tasks, got \(1, 3\)"):
        paired_difference(np.ones(3, dtype=bool), np.ones(4, dtype=bool))
    with pytest.raises(ValueError, match=r"expected policies x tasks, got shape \(1, 0\)"):
        paired_difference(np.ones(0, dtype=bool), np.ones(0, dtype=bool))
    with pytest.raises(ValueError, match="expected policies x tasks"):
        clustered_interval(np.ones(3, dtype=bool))


def wins(gained, lost, alike):
    """Return successes of two ways, shape (1, tasks) each."""
    first = [False] * gained + [True] * lost + [True] * alike
    second = [True] * gained + [False] * lost + [True] * alike
    return np.array([first]), np.array([second])


@pytest.mark.parametrize(
    ("gained", "lost", "p_value"),
    [(0, 0, 1.0), (5, 0, 2 / 32), (6, 2, 2 * 37 / 256), (2, 6, 2 * 37 / 256), (3, 3, 1.0)],
)
def test_mcnemars_test_is_exact(gained, lost, p_value):
    """Twice the binomial tail of the pairs that differ; those that end alike say nothing."""
    for alike in (1, 40):
        found = mcnemar(*wins(gained, lost, alike))
        assert (found.gained, found.lost) == (gained, lost)
        assert found.p_value == pytest.approx(p_value)


def test_trials_of_a_task_are_no_tasks_for_mcnemar():
    """Several trials of each task count as one pair, won by the higher rate."""
    first, second = wins(4, 1, 3)
    assert mcnemar(np.tile(first, (5, 1)), np.tile(second, (3, 1))) == mcnemar(first, second)
    with pytest.raises(ValueError, match="expected the same tasks"):
        mcnemar(first, second[:, 1:])


def test_the_paired_bootstrap_resamples_tasks():
    """The interval is that of the mean over tasks; equal gains have none, pairs take out the rest.

    For many tasks it is the one of the normal distribution.
    """
    rng = np.random.default_rng(1)
    first = rng.normal(0.0, 30.0, (1, 400))
    gains = rng.normal(2.0, 1.0, (1, 400))
    found = paired_bootstrap(first, first + gains, np.random.default_rng(0))
    assert found.mean == pytest.approx(gains.mean())
    reach = 1.96 * gains.std() / 20
    assert found.high - found.mean == pytest.approx(reach, rel=0.1)
    assert found.mean - found.low == pytest.approx(reach, rel=0.1)
    alike = paired_bootstrap(first, first + 2.0, np.random.default_rng(0))
    assert (alike.low, alike.high) == pytest.approx((2.0, 2.0))
    narrow = paired_bootstrap(first, first + gains, np.random.default_rng(0), level=0.5)
    assert narrow.high - narrow.low < 0.5 * (found.high - found.low)
    again = paired_bootstrap(first, first + gains, np.random.default_rng(0))
    assert again == found
    with pytest.raises(ValueError, match="expected the same tasks"):
        paired_bootstrap(first, gains[:, 1:], rng)
