"""Errors of elevation models and of files of objects."""


class ElevationError(ValueError):
    """Elevation model, or file of objects, that is not as expected; the text names the file."""


class MissingRasterioError(ImportError):
    """Raised where rasterio, which reads GeoTIFF, is not installed."""

    def __init__(self) -> None:
        """Name the extra."""
        super().__init__(
            "rasterio: expected it to read a GeoTIFF, got none; install the extra `gis`"
        )
