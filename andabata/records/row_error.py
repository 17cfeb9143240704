"""The error of a message that can't be used."""


class RowError(ValueError):
    """A message that can't be used; its text is a reason without changing numbers, to count by."""
