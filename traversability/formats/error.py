"""The one error of every format."""


class FormatError(ValueError):
    """Bytes that do not keep what their header promises: "expected ..., got ..."."""
