"""Readers of point cloud formats that trust no header: bytes in, coordinates out.

Each module has one function ``parse(data) -> float32 array of shape (n, 3)`` that raises
``FormatError``. ``traversability.files`` chooses among them.
"""
