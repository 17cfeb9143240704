"""Error that all formats raise."""


class FormatError(ValueError):
    """Bytes that do not keep what their header promises: "expected ..., got ..."."""
