"""Texts for terminals, pages and pictures."""

import os

from andabata.printable import printable


def test_bytes_that_are_no_letters_are_replaced():
    """Each stands as one U+FFFD; all other letters, of any script, stay."""
    name = os.fsdecode(b"nube_\xf1.bin")
    assert printable(name) == "nube_\ufffd.bin"
    for text in ("", "a\n", "ü 点 😀 [b] $x$"):
        assert printable(text) == text
    assert printable("\ud800x") == "\ufffdx"
