"""Player of moments: in their order, from where the slider is put, to the last one."""

import math
from types import SimpleNamespace

import pytest

from andabata.viewer.pace import Pace
from andabata.viewer.player import Player


class Slider:
    """Slider that keeps its value and calls back as viser does."""

    def __init__(self):
        self.max, self._value, self._changed = 1, 0, None

    def on_update(self, changed):
        self._changed = changed

    @property
    def value(self):
        return self._value

    @value.setter
    def value(self, value):
        self._value = value
        self._changed(SimpleNamespace(client_id=None))

    def put(self, value):
        """Move it by hand."""
        self._value = value
        self._changed(SimpleNamespace(client_id=3))


@pytest.fixture
def slider():
    """Return a slider."""
    return Slider()


@pytest.fixture
def player(slider):
    """Return a player that waits for nothing."""
    return Player(SimpleNamespace(add_slider=lambda *a, **k: slider), Pace(math.inf))


def test_moments_come_in_their_order_and_the_last_one_stays(player, slider):
    """The slider shows where the player is."""
    drawn = []
    player.load(4)
    player.play(0.1, drawn.append, lambda: len(drawn) == 4)
    assert drawn == [0, 1, 2, 3]
    assert slider.max == 3
    assert slider.value == 3


def test_a_slider_that_is_moved_by_hand_leads_the_player(player, slider):
    """It goes on from there, backwards as well."""
    drawn = []

    def draw(number):
        drawn.append(number)
        if drawn == [0, 1, 2]:
            slider.put(1)

    player.load(4)
    player.play(0.1, draw, lambda: len(drawn) == 6)
    assert drawn == [0, 1, 2, 1, 2, 3]


def test_the_moment_that_is_shown_can_be_drawn_again(player):
    """As when a layer is hidden at the end."""
    drawn = []
    player.load(1)
    player.play(0.1, drawn.append, lambda: len(drawn) == 1)
    player.again()
    player.play(0.1, drawn.append, lambda: len(drawn) == 2)
    assert drawn == [0, 0]
