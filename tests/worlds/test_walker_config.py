"""Settings of what moves: bounds, refusals by name, and what rises with difficulty."""

import pytest
from pydantic import ValidationError

from worlds.walker_config import (
    AnimalConfig,
    PeopleConfig,
    VehicleConfig,
    WalkerConfig,
    number_at,
    pace_at,
)

NAN = float("nan")


def test_numbers_and_speeds_rise_with_difficulty():
    """They are as given at 0.5, half as many at 0 and half as many again at 1."""
    assert [number_at(10, level) for level in (0.0, 0.5, 1.0)] == [5, 10, 15]
    assert [pace_at(level) for level in (0.0, 0.5, 1.0)] == [0.8, 1.0, pytest.approx(1.2)]
    config = WalkerConfig(
        count=3,
        people=PeopleConfig(alone=10, groups=2),
        animals=AnimalConfig(count=4),
        vehicles=VehicleConfig(count=2),
    )
    assert [config.most_at(level) for level in (0.0, 0.5, 1.0)] == [15, 27, 39]


@pytest.mark.parametrize(
    ("config", "given", "words"),
    [
        (WalkerConfig, {"passing": 1.1}, "passing"),
        (WalkerConfig, {"radius": (0.3, 0.2)}, "expected the smaller bound first, got 0.3, 0.2"),
        (WalkerConfig, {"speed": (0.1, NAN)}, "speed"),
        (WalkerConfig, {"height": (NAN, 1.0)}, "height"),
        (WalkerConfig, {"count": 501}, "less than or equal to 500"),
        (WalkerConfig, {"walls": 1}, "walls"),
        (PeopleConfig, {"yielding": -0.1}, "yielding"),
        (PeopleConfig, {"radius": (NAN, 0.3)}, "radius"),
        (AnimalConfig, {"speed": (1.0, NAN)}, "speed"),
        (VehicleConfig, {"track": 1.0}, "track"),
    ],
)
def test_what_is_no_setting_is_refused(config, given, words):
    """Shares are from 0 to 1, bounds finite and in order, numbers at most 500."""
    with pytest.raises(ValidationError, match=words):
        config(**given)


@pytest.mark.parametrize(
    ("config", "speed", "most"),
    [(PeopleConfig, 1.3, "1.33"), (AnimalConfig, 2.5, "2.5"), (VehicleConfig, 5.0, "6.67")],
)
def test_a_mover_is_no_faster_than_its_radius_in_a_control_step(config, speed, most):
    """The bound is that of the smallest at the largest difficulty, and the error names it."""
    config(speed=(0.5, speed))
    if float(most) < 5.0:
        with pytest.raises(ValidationError, match=f"speed: expected at most {most} m/s"):
            config(speed=(0.5, 1.1 * float(most)))


def test_the_whole_number_is_bounded():
    """Groups count as four, each kind as at difficulty 1: 490 and 10 pass, 490 and 11 do not."""
    animals = AnimalConfig(count=2)
    people = PeopleConfig(groups=1, alone=1)
    WalkerConfig(count=487, animals=animals, people=people)
    with pytest.raises(ValidationError, match="at most 500 walkers at difficulty 1, got up to 501"):
        WalkerConfig(count=488, animals=animals, people=people)


def test_a_smaller_square_has_its_share():
    """Numbers go with the area; all else stays."""
    config = WalkerConfig(
        count=8,
        people=PeopleConfig(alone=12, groups=4, yielding=0.3),
        animals=AnimalConfig(count=4),
        vehicles=VehicleConfig(count=4, track=9.0),
    )
    assert config.scaled(0.25) == WalkerConfig(
        count=2,
        people=PeopleConfig(alone=3, groups=1, yielding=0.3),
        animals=AnimalConfig(count=1),
        vehicles=VehicleConfig(count=1, track=9.0),
    )
    assert config.scaled(0.0).is_empty
    assert not config.is_empty
    assert WalkerConfig().is_empty
