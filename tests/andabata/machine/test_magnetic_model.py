"""The World Magnetic Model against the values that NOAA publishes with its coefficients."""

import numpy as np
import pytest

from andabata.machine.magnetic_model import decimal_year, magnetic_field

# Year, altitude [km], latitude, longitude, declination, inclination [deg], total field [nT].
WMM2025 = [
    (2025.0, 28, 89, -121, -99.77, 88.47, 56214),
    (2025.0, 48, 80, -96, -29.91, 87.77, 55665),
    (2025.0, 65, 43, 93, 0.50, 64.10, 55627),
    (2025.0, 51, -33, 109, -5.49, -67.50, 57055),
    (2025.0, 66, 14, 143, -0.19, 12.82, 35899),
    (2025.0, 18, 0, 21, 1.29, -26.06, 32595),
    (2025.5, 44, 33, -118, 11.10, 57.89, 44543),
    (2025.5, 50, -81, -67, 28.13, -67.61, 48032),
    (2026.0, 33, -3, -147, 9.71, -2.12, 30979),
    (2026.0, 82, -64, 87, -81.74, -75.40, 55453),
    (2026.5, 12, -79, 115, -137.58, -77.37, 59546),
    (2027.0, 54, 54, 178, 0.63, 65.46, 49634),
    (2027.0, 12, -63, 178, 57.87, -79.14, 62190),
    (2027.5, 0, -13, -59, -17.49, -15.26, 23220),
    (2028.0, 11, -22, -21, -23.24, -57.67, 25295),
    (2028.5, 95, 30, 28, 4.56, 44.27, 41600),
    (2029.0, 49, -50, -179, 32.11, -71.33, 56494),
    (2029.5, 51, -76, 40, -56.34, -66.22, 45918),
]
WMM2020 = [
    (2020.0, 0, 80, 0, -1.28, 83.14, 55000.1),
    (2020.0, 0, -80, 240, 69.36, -72.20, 55120.6),
    (2022.5, 0, 0, 120, -0.06, -15.24, 41130.5),
    (2022.5, 100, 80, 0, -0.41, 83.24, 52894.5),
]


@pytest.mark.parametrize("row", WMM2025 + WMM2020)
def test_the_published_values_come_out(row):
    """Declination, inclination and strength are the published ones."""
    year, km, latitude, longitude, declination, inclination, total = row
    found = magnetic_field(latitude, longitude, 1000.0 * km, year)
    assert found.declination_deg == pytest.approx(declination, abs=0.006)
    assert found.inclination_deg == pytest.approx(inclination, abs=0.006)
    assert found.flux_density == pytest.approx(total / 1000, abs=0.0006)
    assert found.is_valid
    assert found.source == f"WMM{2020 if year < 2025 else 2025} for {year:.1f}"


def test_each_date_has_its_own_model():
    """Each period of five years has its own model."""
    names = {year: magnetic_field(48.0, 11.0, 0.0, year).source[:7] for year in range(2010, 2031)}
    assert [names[year] for year in (2010, 2014, 2015, 2019, 2020, 2024, 2025, 2030)] == [
        *["WMM2010"] * 2,
        *["WMM2015"] * 2,
        *["WMM2020"] * 2,
        *["WMM2025"] * 2,
    ]


@pytest.mark.parametrize("year", [1970.0, 2009.9, 2030.2, 2106.0])
def test_a_date_outside_of_the_models_is_said_and_gives_a_sane_field(year):
    """Dates without a model are marked, and their field is near the nearest model."""
    found, near = (magnetic_field(48.0, 11.0, 500.0, y) for y in (year, 2020.0))
    assert not found.is_valid
    assert "outside of 2010 to 2030" in found.source
    assert found.declination_deg == pytest.approx(near.declination_deg, abs=5)
    assert found.flux_density == pytest.approx(near.flux_density, rel=0.03)


@pytest.mark.parametrize("latitude", [-89.0, 89.0])
def test_near_the_poles_it_is_a_number(latitude):
    """The field is finite near the poles."""
    found = magnetic_field(latitude, 0.0, 2800.0, 2026.9)
    assert np.isfinite([found.declination_deg, found.inclination_deg, found.flux_density]).all()


def test_the_year_of_a_stamp():
    """Stamps become decimal years."""
    assert decimal_year(0) == 1970.0
    assert decimal_year(1_767_225_600 * 10**9) == 2026.0
    assert decimal_year(1_700_000_000 * 10**9) == pytest.approx(2023.87, abs=0.01)
