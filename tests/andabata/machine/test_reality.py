"""Reality: levels, draws around the believed constants, and the same draws at every level."""

from dataclasses import asdict, replace

import numpy as np
import pytest
from pydantic import ValidationError

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.configuration.settings import SettingsError, resolve
from andabata.machine.reality import AS_BELIEVED, LEVELS, Reality, TrueConstants, level

DRAWN = [
    "antenna",
    "soft_iron",
    "motor_field",
    "imu_tilt",
    "wheel_radius",
    "effective_track",
    "slope_slip",
    "range_scale",
    "laser_clock",
    "laser_tilt",
    "laser_height",
    "latency",
    "lag",
]
"""Constants that a level scales."""


def draw(reality, seed=0):
    """Return the draw of a seed."""
    return reality.draw(np.random.default_rng(seed))


def draws(count=2000, **strengths):
    """Return the draws of many seeds, one array for each constant."""
    rng, reality = np.random.default_rng(0), Reality.alone(**strengths)
    found = [asdict(reality.draw(rng)) for _ in range(count)]
    return {name: np.array([one[name] for one in found]) for name in DRAWN} | {
        "ratio": np.array([one["gnss_sigma_ratio"] for one in found])
    }


def test_ideal_is_what_the_navigator_believes():
    """At ``ideal`` nothing differs, whatever is drawn."""
    constants = draw(Reality())
    assert replace(constants, seed=0) == AS_BELIEVED
    assert constants.is_ideal
    assert LEVELS["ideal"] == Reality()


@pytest.mark.parametrize("name", sorted(set(Reality.model_fields) - {"gnss_drift_time"}))
def test_each_disturbance_is_none_at_ideal_and_one_alone(name):
    """A strength alone makes a robot that is not ideal, and changes one constant only."""
    value = 1.5 if name == "gnss_sigma_ratio" else 0.1
    alone = draw(Reality.alone(**{name: value}))
    assert not alone.is_ideal
    changed = [key for key, found in asdict(alone).items() if found != asdict(AS_BELIEVED)[key]]
    assert sorted(changed) == sorted(["seed", name.removesuffix("_deg")])


def test_a_draw_is_a_function_of_its_generator():
    """The same seed gives the same robot, another one another."""
    assert draw(LEVELS["field"], 3) == draw(LEVELS["field"], 3)
    assert draw(LEVELS["field"], 3) != draw(LEVELS["field"], 4)


def test_a_level_scales_the_same_unit_numbers():
    """At twice the strength a drive's robot differs twice as much, in the same direction."""
    weak, strong = asdict(draw(LEVELS["field"], 5)), asdict(draw(LEVELS["harsh"], 5))
    assert weak["seed"] == strong["seed"]
    for name in DRAWN:
        np.testing.assert_allclose(strong[name], 2 * np.array(weak[name]), err_msg=name)


def test_a_disturbance_alone_is_the_one_of_the_level():
    """What is drawn of one constant does not depend on the strengths of the others."""
    harsh = LEVELS["harsh"]
    for name in ("soft_iron", "latency", "lag", "laser_tilt_deg", "gnss_sigma_ratio"):
        alone = draw(Reality.alone(**{name: getattr(harsh, name)}), 7)
        key = name.removesuffix("_deg")
        assert getattr(alone, key) == getattr(draw(harsh, 7), key)


def test_spreads_are_standard_deviations_around_the_believed_value():
    """Normal constants have mean zero and their spread, each element on its own."""
    found = draws(
        antenna=0.04,
        soft_iron=0.06,
        imu_tilt_deg=0.5,
        wheel_radius=0.03,
        effective_track=0.1,
        range_scale=0.002,
        laser_tilt_deg=0.5,
        laser_height=0.02,
    )
    half_degree = np.deg2rad(0.5)
    for name, spread in (
        ("antenna", 0.04),
        ("soft_iron", 0.06),
        ("imu_tilt", half_degree),
        ("wheel_radius", 0.03),
        ("effective_track", 0.1),
        ("range_scale", 0.002),
        ("laser_tilt", half_degree),
        ("laser_height", 0.02),
    ):
        np.testing.assert_allclose(found[name].std(axis=0), spread, rtol=0.07, err_msg=name)
        assert np.abs(found[name].mean(axis=0)).max() < 0.1 * spread, name
    columns = np.column_stack([found[name].reshape(len(found[name]), -1) for name in DRAWN])
    varied = columns[:, columns.std(axis=0) > 0]
    assert varied.shape[1] == 3 + 9 + 3 + 1 + 1 + 1 + 2 + 1
    correlations = np.corrcoef(varied.T) - np.eye(varied.shape[1])
    assert np.abs(correlations).max() < 0.12


def test_the_motors_field_has_its_root_mean_square():
    """2.3 uT are those of the whole vector, whose directions are alike."""
    fields = draws(motor_field=2.3)["motor_field"]
    assert np.sqrt((fields**2).sum(axis=1).mean()) == pytest.approx(2.3, rel=0.05)
    np.testing.assert_allclose(fields.std(axis=0), 2.3 / np.sqrt(3), rtol=0.07)


@pytest.mark.parametrize("name", ["slope_slip", "laser_clock", "latency", "lag"])
def test_one_sided_constants_lie_between_half_and_all_of_their_strength(name):
    """Command latencies up to 0.2 s are those from 0.1 to 0.2 s, uniformly."""
    found = draws(**{name: 0.2})[name]
    assert 0.1 <= found.min() < 0.101
    assert 0.199 < found.max() <= 0.2
    np.testing.assert_allclose(
        np.quantile(found, [0.25, 0.5, 0.75]), [0.125, 0.15, 0.175], atol=4e-3
    )


def test_stated_sigmas_are_wrong_in_both_directions():
    """A ratio of up to 3 is log-uniform from a third to three."""
    found = np.log(draws(gnss_sigma_ratio=3.0)["ratio"]) / np.log(3.0)
    assert np.abs(found).max() <= 1.0
    np.testing.assert_allclose(np.quantile(found, [0.25, 0.5, 0.75]), [-0.5, 0.0, 0.5], atol=0.06)


def test_a_wheel_stays_a_wheel():
    """No draw makes a length zero or negative."""
    reality = Reality.alone(wheel_radius=0.2, effective_track=0.2)
    rng = np.random.default_rng(0)
    lengths = [reality.draw(rng) for _ in range(5000)]
    assert min(one.wheel_radius for one in lengths) == -0.5
    assert min(one.effective_track for one in lengths) >= -0.5


def test_levels_have_names_and_other_numbers_are_custom():
    """A level's name comes back; a changed number makes it ``custom``."""
    for name, known in LEVELS.items():
        assert level(name) == known
        assert known.name == name
    assert LEVELS["field"].model_copy(update={"latency": 0.3}).name == "custom"


def test_a_name_stands_for_a_levels_numbers_in_settings():
    """``reality=field`` sets all numbers, ``reality.latency`` one of them."""
    config = resolve(SimulatedRobotConfig, None, ["reality=field"])
    assert config.reality == LEVELS["field"]
    config = resolve(SimulatedRobotConfig, None, ["reality.latency=0.3"], config)
    assert config.reality == LEVELS["field"].model_copy(update={"latency": 0.3})


def test_an_unknown_level_names_the_known_ones():
    """The error says what was expected, what came and what to do."""
    expected = "expected one of ideal, field, harsh, got 'mud'; choose one of them"
    with pytest.raises(ValueError, match=expected):
        level("mud")
    with pytest.raises(SettingsError, match=f"^reality: level: {expected}[^']*$"):
        resolve(SimulatedRobotConfig, None, ["reality=mud"])


def test_unknown_disturbances_and_numbers_out_of_bounds_are_refused():
    """A wrong name or a negative latency is no reality."""
    with pytest.raises(ValidationError, match="latenzy"):
        Reality.alone(latenzy=0.1)
    with pytest.raises(ValidationError, match="latency"):
        Reality.alone(latency=-0.1)


def test_constants_that_differ_are_not_ideal():
    """A correlation time without an error, or another seed, differs in nothing."""
    assert TrueConstants(seed=9, gnss_drift_time=60.0).is_ideal
    assert not TrueConstants(lag=0.1).is_ideal
