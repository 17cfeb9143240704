"""Conversion of fixes to the map: positions, sigmas, and missing altitudes."""

import numpy as np
import pytest

from andabata.localization.fix_conversion import FixConverter
from andabata.localization.ukf_config import UkfConfig
from andabata.machine.geo_reference import GeoReference

CONFIG = UkfConfig()
REFERENCE = GeoReference()


def fixes(*positions, variance=1.0, reference=REFERENCE):
    """Return a fix at each position in the map."""
    geodetic = reference.to_geodetic(np.array(positions, dtype=float))
    count = len(positions)
    return np.column_stack([np.arange(1.0, count + 1), geodetic, np.full(count, variance)])


def test_fixes_become_positions_in_the_map():
    """Stamps stay, positions are those of the map."""
    rows, rejected = FixConverter(CONFIG, REFERENCE).to_map(fixes((3, 4, 5), (6, 7, 8)), 0.0)
    np.testing.assert_allclose(rows[:, :4], [[1, 3, 4, 5], [2, 6, 7, 8]], atol=1e-5)
    assert rejected == 0


def test_sigmas_are_the_stated_ones_and_heights_are_no_better_than_a_receivers():
    """The horizontal sigma is what the receiver states, the vertical one at least its ratio."""
    rows, _ = FixConverter(CONFIG, REFERENCE).to_map(fixes((0, 0, 0), variance=4.0), 0.0)
    assert rows[0, 4] == pytest.approx(2.0)
    assert rows[0, 5] == pytest.approx(2.0 * 2.0)
    small, _ = FixConverter(CONFIG, REFERENCE).to_map(fixes((0, 0, 0), variance=1e-9), 0.0)
    assert small[0, 4] == pytest.approx(0.01)
    assert small[0, 5] == pytest.approx(2.0 * CONFIG.receiver.total)


@pytest.mark.parametrize("variance", [np.nan, 0.0])
def test_a_missing_variance_is_the_configured_one(variance):
    """Without a variance the configured sigma holds, and it is counted."""
    converter = FixConverter(CONFIG, REFERENCE)
    rows, _ = converter.to_map(fixes((0, 0, 0), variance=variance), 0.0)
    assert rows[0, 4] == pytest.approx(CONFIG.fix_sigma)
    assert converter.assumed.total() == 1


def test_a_missing_altitude_has_the_estimated_height_and_no_weight():
    """Without an altitude the height is the estimate, with a huge sigma."""
    given = fixes((3, 4, 5))
    given[0, 3] = np.nan
    rows, _ = FixConverter(CONFIG, REFERENCE).to_map(given, 2.5)
    np.testing.assert_allclose(rows[0, 1:4], [3, 4, 2.5], atol=1e-3)
    assert rows[0, 5] > 1e5


def test_without_an_altitude_of_the_datum_heights_count_from_the_first_fix():
    """The first altitude stands for the estimated height; later ones keep their difference."""
    converter = FixConverter(CONFIG, GeoReference(altitude=None))
    first, _ = converter.to_map(fixes((0, 0, 100.0)), 2.0)
    second, _ = converter.to_map(fixes((0, 0, 103.0)), 7.0)
    assert first[0, 3] == pytest.approx(2.0, abs=1e-3)
    assert second[0, 3] == pytest.approx(5.0, abs=1e-3)
    converter.set_geo_reference(GeoReference(altitude=None))
    again, _ = converter.to_map(fixes((0, 0, 103.0)), 7.0)
    assert again[0, 3] == pytest.approx(7.0, abs=1e-3)


def test_rejected_fixes_are_left_out_and_counted():
    """An impossible fix is rejected; a receiver without a fix is not."""
    given = fixes((0, 0, 0), (1, 0, 0), (2, 0, 0))
    given[0, 1], given[1, 4] = 120.0, np.inf
    converter = FixConverter(CONFIG, REFERENCE)
    rows, rejected = converter.to_map(given, 0.0)
    assert rows[:, 0].tolist() == [3.0]
    assert rejected == converter.rejected.total() == 1
