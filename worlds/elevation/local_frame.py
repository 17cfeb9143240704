"""Local frame of a world on Earth: metres to the east and to the north of a place.

The projection is the azimuthal equidistant one about the place: within 300 m of it lengths are
those on the ellipsoid to a micrometre.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from worlds.elevation.errors import MissingRasterioError

Floats = NDArray[np.float64]

WGS_84 = "OGC:CRS84"
"""Longitude and latitude in degrees, in this order."""

MAX_LATITUDE = 89.0
"""Largest latitude of a world [deg]: nearer to a pole east and north change within it."""


@dataclass(frozen=True)
class LocalFrame:
    """Frame with its origin at a place, x to the east and y to the north.

    Attributes:
        latitude_deg: Latitude of the origin, WGS 84.
        longitude_deg: Longitude of the origin, WGS 84.
    """

    latitude_deg: float
    longitude_deg: float

    def to(self, crs: object, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Return places of this frame in a coordinate reference system.

        Args:
            crs: Coordinate reference system, as text or rasterio's.
            x: Metres to the east, any shape.
            y: Metres to the north, same shape.

        Returns:
            Coordinates in the system's units, easting or longitude first; infinite where a place
            has none.
        """
        return transformed(self._crs, crs, x, y)

    def of(self, crs: object, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Return coordinates of a coordinate reference system in this frame [m], as ``to``."""
        return transformed(crs, self._crs, x, y)

    @property
    def text(self) -> str:
        """The origin in words, to a metre."""
        return f"latitude {self.latitude_deg:.5f}, longitude {self.longitude_deg:.5f}"

    @property
    def _crs(self) -> str:
        """The projection in PROJ's words."""
        place = f"+lat_0={self.latitude_deg:.12f} +lon_0={self.longitude_deg:.12f}"
        return f"+proj=aeqd {place} +datum=WGS84 +units=m +no_defs"


def crs_of(text: str) -> Any:  # noqa: ANN401 - rasterio's, which may not be installed.
    """Return the coordinate reference system of a text such as ``EPSG:32632``.

    Raises:
        MissingRasterioError: If rasterio is not installed.
        ValueError: If there is no such system.
    """
    try:
        import rasterio
    except ImportError as error:
        raise MissingRasterioError from error
    # GDAL writes its errors to the terminal where no environment takes them.
    with rasterio.Env():
        return rasterio.crs.CRS.from_user_input(text)


def transformed(source: object, target: object, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Return coordinates of one system in another, infinite where they have none.

    Args:
        source: System of the coordinates, as text or rasterio's.
        target: The other system.
        x: Easting or longitude, any shape.
        y: Northing or latitude, same shape.
    """
    systems = [crs_of(each) if isinstance(each, str) else each for each in (source, target)]
    import rasterio
    from rasterio.warp import transform

    try:
        with rasterio.Env():
            first, second = transform(*systems, np.ravel(x), np.ravel(y))
    except Exception:  # GDAL's errors have no public class; this one says "outside of the domain".
        return np.full(np.shape(x), np.inf), np.full(np.shape(y), np.inf)
    return np.reshape(first, np.shape(x)), np.reshape(second, np.shape(y))
