"""From a 3D cloud to a virtual 2D scan: polar cells, five features, a random forest, free ranges.

In: a ``PointCloud`` in the levelled robot frame. Out: a ``VirtualScan``. Read ``grid.py`` first.
This package knows no world and no robot: labels reach it as arrays.
"""
