"""Readers of point cloud formats that trust no header: bytes in, columns out.

Each module has ``parse(data)``, which returns the points' columns by name or raises
``FormatError``; those that we write have ``render``. ``traversability.files`` chooses among them.
"""
