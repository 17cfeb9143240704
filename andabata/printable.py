"""Texts that can be printed and drawn: names of files are bytes, and need not be UTF-8."""


def printable(text: str) -> str:
    """Return a text with U+FFFD in place of what Unicode has no letter for.

    Python gives bytes of a name that are no UTF-8 as lone surrogates, which no terminal, page or
    font takes.
    """
    return text.encode("utf-16", "surrogatepass").decode("utf-16", "replace")
