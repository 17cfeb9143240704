"""Micro-relief: its size, its waves, and that no peak stands out."""

import numpy as np
import pytest

from terrain.relief import roughness, rut


def test_roughness_has_its_size_and_limited_peaks():
    """Mean 0, standard deviation 1, the same from the same seed, and no peak of four of them."""
    field = roughness((400, 300), 0.1, np.random.default_rng(0))
    assert field.shape == (400, 300)
    assert field.mean() == pytest.approx(0.0, abs=1e-9)
    assert field.std() == pytest.approx(1.0, abs=1e-9)
    assert 2.0 < np.abs(field).max() < 3.3
    np.testing.assert_array_equal(field, roughness((400, 300), 0.1, np.random.default_rng(0)))


def test_profiles_have_waves_of_the_band_and_fall_with_the_square():
    """Power is in the band alone, and sixteen times less at a quarter of a wavelength."""
    field = roughness((2048, 512), 0.05, np.random.default_rng(1), (0.2, 3.2))
    power = (np.abs(np.fft.rfft(field, axis=0)) ** 2).mean(axis=1)
    waves = np.fft.rfftfreq(2048, 0.05)
    outside = power[waves > 1 / 0.18].sum() / power.sum()
    assert outside < 0.01
    long, short = (power[(waves > k / 1.2) & (waves < 1.2 * k)].mean() for k in (0.6, 2.4))
    assert long / short == pytest.approx(16.0, rel=0.4)


def test_a_grid_without_any_of_the_waves_is_refused():
    """Waves shorter than two cells are not on a grid."""
    with pytest.raises(ValueError, match=r"cell: expected at most 0\.175 m for waves of 0\.35 m"):
        roughness((50, 50), 0.25, np.random.default_rng(0), (0.15, 0.35))


@pytest.mark.parametrize(
    ("away", "height"), [(0.0, 0.0), (0.7, -0.03), (0.575, 0.0), (0.60625, -0.015), (0.9, 0.0)]
)
def test_a_rut_lies_half_a_track_from_the_middle(away, height):
    """Its floor is flat, its sides slope, and all else is level."""
    assert rut(np.array([away]), 1.4, 0.03)[0] == pytest.approx(height, abs=1e-9)
