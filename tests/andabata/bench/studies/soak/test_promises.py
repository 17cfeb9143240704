"""Promises: each has a check that exists; numbers of trials follow the time."""

from importlib import import_module

import pytest

from andabata.bench.studies.soak import promise
from andabata.bench.studies.soak.promises import PROMISES, promise_of
from andabata.bench.studies.soak.worlds import floor_of


def test_every_promise_has_a_check():
    """Named by module and function; names are unique, the full version is no shorter."""
    for each in PROMISES:
        module, _, function = each.check.partition(":")
        assert callable(getattr(import_module(f"{promise.__package__}.{module}"), function))
        assert 0 < each.short <= each.full
    assert len({each.name for each in PROMISES}) == len(PROMISES)


def test_no_check_is_so_short_that_it_cannot_fail():
    """One process is compared with none, and a few worlds have a floor of no goals."""
    assert promise_of("same-bytes").count(0.01) >= 2
    assert min(floor_of(promise_of("worlds").count(0.01))) > 0


def test_a_promise_is_found_by_its_name():
    """An unknown name is an error that gives the known ones."""
    assert promise_of("gate").check == "filter_laws:gate_rejects_its_share"
    with pytest.raises(ValueError, match=r"one of bad-measurements, .* got 'x'"):
        promise_of("x")
