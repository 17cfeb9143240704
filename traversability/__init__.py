"""Traversability of point clouds: polar cells, their features, a classifier, a virtual 2D scan.

In: a ``PointCloud`` in the levelled robot frame. Out: a ``VirtualScan``. Read ``grid.py`` first,
then ``scanner.py``, which runs all stages. The package depends on no world and no robot: labels
come in as arrays.
"""
