"""Worlds of real terrain: elevation models (GeoTIFF) as ground, GeoJSON as objects on it.

``raster.py`` opens a model, ``square.py`` takes a square of ground from it, ``objects_file.py``
reads what stands where, and ``world.py`` makes a world of both. rasterio comes with the extra
``gis`` and is imported only where it is used.
"""
