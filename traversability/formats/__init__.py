"""Readers and writers of point cloud formats: bytes in, columns out, every header checked.

Each module has ``parse(data)``, which returns the points' columns by name or raises
``FormatError``; formats that are written have ``render``, too. ``traversability.files`` chooses
among them.
"""
