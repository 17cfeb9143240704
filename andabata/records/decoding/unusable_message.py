"""The error of a message that cannot be used."""


class UnusableMessageError(ValueError):
    """A message that cannot be used; its text is free of changing numbers, to be counted by."""
