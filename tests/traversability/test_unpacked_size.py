"""Limit of unpacked sizes."""

from traversability.unpacked_size import largest_unpacked


def test_the_limit_grows_with_the_file():
    """Small files may unpack to 64 MiB, large ones to 256 times their size."""
    assert largest_unpacked(0) == largest_unpacked(1 << 18) == 1 << 26
    assert largest_unpacked(1 << 20) == 1 << 28
