"""Geodetic reference of the map: conversions from and to WGS-84, and the magnetic field."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

_A = 6_378_137.0
"""Equatorial radius of WGS-84 [m]."""

_E2 = (2 - 1 / 298.257223563) / 298.257223563
"""First eccentricity of WGS-84, squared."""

MAX_LATITUDE_DEG = 89.0
"""Largest latitude of a datum [deg]: nearer to a pole east and north change within a drive."""

MIN_ALTITUDE, MAX_ALTITUDE = -500.0, 9000.0
"""Limits of an altitude on the ground [m]."""

MIN_FIELD, MAX_FIELD = 1.0, 200.0
"""Limits of a magnetic flux density [uT]; on Earth it is 22 to 68 uT."""


class GeoReference(BaseModel):
    """Datum of the map, whose axes point east, north and up there, and the magnetic field at it.

    The default is the campus of Malaga, where the simulation takes place; its field is that of the
    World Magnetic Model of 2020, rounded.

    Attributes:
        latitude_deg: Latitude of the origin, north positive, within 89 degrees.
        longitude_deg: Longitude of the origin, east positive.
        altitude: Altitude of the map's z = 0 [m], in the receiver's own vertical datum; None where
            it is unknown, until the first fix with an altitude.
        declination_deg: Angle from true north to magnetic north, east positive.
        inclination_deg: Angle of the field below the horizon.
        field: Magnetic flux density [uT].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    latitude_deg: float = Field(default=36.7150, ge=-MAX_LATITUDE_DEG, le=MAX_LATITUDE_DEG)
    longitude_deg: float = Field(default=-4.4780, ge=-180, le=180)
    altitude: float | None = Field(default=60.0, ge=MIN_ALTITUDE, le=MAX_ALTITUDE)
    declination_deg: float = Field(default=0.3, ge=-180, le=180)
    inclination_deg: float = Field(default=52.3, ge=-90, le=90)
    field: float = Field(default=43.6, gt=MIN_FIELD, lt=MAX_FIELD)

    @property
    def flux(self) -> NDArray[np.float64]:
        """Magnetic flux density in the map: east, north, up [uT], shape (3,)."""
        down, aside = np.deg2rad([self.inclination_deg, self.declination_deg])
        level = self.field * np.cos(down)
        return np.array([level * np.sin(aside), level * np.cos(aside), -self.field * np.sin(down)])

    def to_map(self, geodetic: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return map coordinates [m] of latitudes, longitudes [deg] and altitudes [m], (n, 3)."""
        origin, axes = self._frame
        return _rotated(_earth(geodetic) - origin, axes)

    def to_geodetic(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return latitude, longitude [deg] and altitude [m] of map points [m], shape (n, 3).

        Source: Bowring 1985, closed form; within a micrometre up to 10 km of altitude.
        """
        origin, axes = self._frame
        x, y, z = (_rotated(np.asarray(points), axes.T) + origin).T
        b = _A * np.sqrt(1 - _E2)
        outward = np.hypot(x, y)
        angle = np.arctan2(z * _A, outward * b)
        latitude = np.arctan2(
            z + _E2 / (1 - _E2) * b * np.sin(angle) ** 3,
            outward - _E2 * _A * np.cos(angle) ** 3,
        )
        normal = _A / np.sqrt(1 - _E2 * np.sin(latitude) ** 2)
        altitude = (
            outward * np.cos(latitude) + z * np.sin(latitude) - normal
            + normal * _E2 * np.sin(latitude) ** 2
        )  # fmt: skip
        return np.column_stack([np.rad2deg(latitude), np.rad2deg(np.arctan2(y, x)), altitude])

    def distance(self, latitude_deg: float, longitude_deg: float) -> float:
        """Return the horizontal distance to a place [m], from the chord through the Earth."""
        places = np.array(
            [[self.latitude_deg, self.longitude_deg, 0.0], [latitude_deg, longitude_deg, 0.0]]
        )
        here, there = _earth(places)
        half_chord = float(np.linalg.norm(there - here)) / 2
        return 2 * _A * float(np.arcsin(min(half_chord / _A, 1.0)))

    @property
    def _frame(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Origin and axes of the map in Earth-centred, Earth-fixed coordinates."""
        return _map_frame(self.latitude_deg, self.longitude_deg, self.altitude or 0.0)


def place_text(latitude_deg: float, longitude_deg: float) -> str:
    """Return latitude and longitude [deg] as text, to a metre."""
    return f"latitude {latitude_deg:.5f}, longitude {longitude_deg:.5f}"


def wrapped_longitude(longitude_deg: float) -> float:
    """Return a longitude [deg] wrapped to -180 to 180: some receivers count from 0 to 360."""
    return (longitude_deg + 180.0) % 360.0 - 180.0 if abs(longitude_deg) > 180.0 else longitude_deg


@lru_cache(maxsize=64)
def _map_frame(
    latitude_deg: float, longitude_deg: float, altitude: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return where a map lies in Earth-centred, Earth-fixed coordinates.

    Returns:
        Origin [m], shape (3,), and rotation ``R_earth_map``: east, north and up at the origin as
        columns, shape (3, 3).
    """
    north, east = np.deg2rad([latitude_deg, longitude_deg])
    s, c, sl, cl = np.sin(north), np.cos(north), np.sin(east), np.cos(east)
    axes = np.array([[-sl, -s * cl, c * cl], [cl, -s * sl, c * sl], [0.0, c, s]])
    return _earth(np.array([[latitude_deg, longitude_deg, altitude]]))[0], axes


def _rotated(points: NDArray[np.float64], rotation: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return ``points @ rotation``, shape (n, 3), each row to the bit as if it stood alone.

    A matrix product rounds by the number of its rows and by the processor: a fix would move by its
    last bit because another one came with it.
    """
    parts = points[:, :, None] * rotation
    total: NDArray[np.float64] = parts[:, 0] + parts[:, 1] + parts[:, 2]
    return total


def _earth(geodetic: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return Earth-centred, Earth-fixed coordinates [m], shape (n, 3)."""
    geodetic = np.asarray(geodetic, dtype=np.float64)
    latitude, longitude = np.deg2rad(geodetic[:, 0]), np.deg2rad(geodetic[:, 1])
    altitude = geodetic[:, 2]
    normal = _A / np.sqrt(1 - _E2 * np.sin(latitude) ** 2)
    level = (normal + altitude) * np.cos(latitude)
    return np.column_stack(
        [
            level * np.cos(longitude),
            level * np.sin(longitude),
            (normal * (1 - _E2) + altitude) * np.sin(latitude),
        ]
    )
