"""Plants that are here: bullet is the default where pybullet is, wheels where not."""

import pytest

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.machine import plants
from andabata.machine.plants import (
    PlantError,
    available_plants,
    bullet_step,
    check_plant,
    default_plant,
    default_remark,
    has_bullet,
    has_mujoco,
    is_published,
)
from andabata.machine.vehicle import make_vehicle


@pytest.fixture(params=[True, False], ids=["bullet", "no bullet"])
def bullet(request, monkeypatch):
    """Return True where pybullet is found, False where it is not."""
    found = {"pybullet": object()} if request.param else {}
    monkeypatch.setattr(plants, "find_spec", found.get)
    return request.param


def test_the_default_is_the_first_that_is_here(bullet):
    """A robot drives in bullet, or in wheels where pybullet is not installed."""
    assert has_bullet() is bullet
    assert available_plants() == (*(("bullet",) * bullet), "wheels", "kinematic")
    assert not has_mujoco()
    assert default_plant() == ("bullet" if bullet else "wheels")
    assert SimulatedRobotConfig().plant == default_plant()
    assert SimulatedRobotConfig(plant="bullet").plant == "bullet"  # As in a recording.


def test_bullet_is_refused_where_it_is_missing(bullet, make_ground):
    """One line says what was expected, what came and what to do; the fast plants need nothing."""
    for plant in available_plants():
        check_plant(plant)
    if not bullet:
        expected = r"plant: expected wheels or kinematic.* got bullet; leave the plant out"
        with pytest.raises(PlantError, match=expected):
            check_plant("bullet")
        with pytest.raises(PlantError, match=expected):
            make_vehicle("bullet", make_ground(size=4.0), None, None)


def test_mujoco_is_refused_where_it_is_missing_and_is_never_the_default(monkeypatch, make_ground):
    """The error has the line that installs it; without pybullet, wheels come before it."""
    monkeypatch.setattr(plants, "find_spec", {"pybullet": object()}.get)
    expected = r"since mujoco is not installed, got mujoco; .* `pip install .*\[mujoco\]"
    with pytest.raises(PlantError, match=expected):
        make_vehicle("mujoco", make_ground(size=4.0), None, None)
    monkeypatch.setattr(plants, "find_spec", {"mujoco": object()}.get)
    assert available_plants() == ("mujoco", "wheels", "kinematic")
    assert default_plant() == "wheels"
    check_plant("mujoco")


def test_what_brings_bullet_depends_on_python(monkeypatch):
    """pip up to Python 3.11, that Python from 3.12 on."""
    assert [is_published((3, minor)) for minor in (11, 12, 13)] == [True, False, False]
    monkeypatch.setattr(plants, "is_published", lambda: True)
    assert bullet_step() == "`pip install pybullet`"
    monkeypatch.setattr(plants, "is_published", lambda: False)
    assert bullet_step().startswith("install andabata with Python 3.11")


def test_a_plant_that_stands_in_for_bullet_is_remarked_on(bullet):
    """Where bullet is, and of another plant that was chosen, nothing is said."""
    remark = default_remark("wheels")
    assert (remark is None) is bullet
    assert remark is None or remark.startswith("plant wheels, since pybullet is not installed")
    assert default_remark("kinematic") is None
