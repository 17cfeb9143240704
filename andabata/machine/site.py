"""Where on Earth the map lies: geodetic coordinates there and back, and the magnetic field."""

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

_A = 6_378_137.0
"""Equatorial radius of WGS-84 [m]."""

_E2 = (2 - 1 / 298.257223563) / 298.257223563
"""First eccentricity of WGS-84, squared."""


class Site(BaseModel):
    """The map's origin; map axes point east, north and up there.

    The default is the campus of Malaga, where the paper's robot lives; field and declination there
    after the World Magnetic Model of 2020, rounded.

    Attributes:
        latitude_deg: Of the origin, north positive.
        longitude_deg: Of the origin, east positive.
        altitude: Of the map's z = 0 above the ellipsoid [m].
        declination_deg: From true north to magnetic north, east positive.
        inclination_deg: Of the field below the horizon.
        field: Magnetic flux density [uT].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    latitude_deg: float = Field(default=36.7150, ge=-89, le=89)
    longitude_deg: float = Field(default=-4.4780, ge=-180, le=180)
    altitude: float = Field(default=60.0, ge=-500, le=9000)
    declination_deg: float = Field(default=0.3, ge=-180, le=180)
    inclination_deg: float = Field(default=52.3, ge=-85, le=85)
    field: float = Field(default=43.6, gt=1, lt=200)

    @property
    def flux(self) -> NDArray[np.float64]:
        """Magnetic flux density in the map: east, north, up [uT], shape (3,)."""
        down, aside = np.deg2rad([self.inclination_deg, self.declination_deg])
        level = self.field * np.cos(down)
        return np.array([level * np.sin(aside), level * np.cos(aside), -self.field * np.sin(down)])

    def to_map(self, geodetic: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return map coordinates [m] of latitudes, longitudes [deg] and altitudes [m], (n, 3)."""
        return (_earth(geodetic) - self._origin) @ self._axes

    def to_geodetic(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return latitude, longitude [deg] and altitude [m] of map points [m], shape (n, 3).

        Bowring's closed form; within a micrometre up to 10 km of altitude.
        """
        x, y, z = (np.asarray(points) @ self._axes.T + self._origin).T
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

    @property
    def _origin(self) -> NDArray[np.float64]:
        """The origin in Earth-centred coordinates [m], shape (3,)."""
        place = np.array([[self.latitude_deg, self.longitude_deg, self.altitude]])
        return _earth(place)[0]

    @property
    def _axes(self) -> NDArray[np.float64]:
        """``R_earth_map``: east, north and up at the origin as columns, shape (3, 3)."""
        north, east = np.deg2rad([self.latitude_deg, self.longitude_deg])
        s, c, sl, cl = np.sin(north), np.cos(north), np.sin(east), np.cos(east)
        return np.array([[-sl, -s * cl, c * cl], [cl, -s * sl, c * sl], [0.0, c, s]])


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
