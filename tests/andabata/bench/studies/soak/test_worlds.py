"""The soak: floors of goals, and what it says below them."""

import pytest

from andabata.bench.studies import soak
from andabata.bench.studies.privileged import Drive
from andabata.bench.studies.soak import FLOOR, WORLDS, floor_of, shortfalls


def drives(*reached):
    return [Drive((1.0,) * count, "stuck") for count in reached]


def test_the_floor_of_all_worlds_is_the_stated_one():
    """Fewer worlds allow as many misses as all of them do."""
    assert floor_of(WORLDS) == FLOOR == (22, 22, 20)
    assert floor_of(10) == (8, 8, 6)
    assert floor_of(1) == (0, 0, 0)


def test_only_goals_below_the_floor_are_named():
    """At the floor nothing is wrong; one drive fewer is."""
    assert shortfalls(FLOOR, WORLDS) == []
    assert shortfalls((22, 21, 20), WORLDS) == ["goal 2: expected at least 22 of 24 drives, got 21"]
    assert len(shortfalls((0, 0, 0), WORLDS)) == 3


@pytest.mark.parametrize(("third", "code"), [(20, 0), (19, 1)])
def test_the_exit_code_is_one_below_the_floor(third, code, capsys, monkeypatch):
    """The table is printed either way, the shortfall on standard error."""
    ended = drives(*[3] * third, *[2] * (WORLDS - third))
    monkeypatch.setattr(soak, "soak", lambda *_: ended)
    assert soak.main([]) == code
    found = capsys.readouterr()
    assert f"| {third} [" in found.out
    assert ("goal 3" in found.err) == bool(code)
