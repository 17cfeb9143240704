"""Limit of the size that packed bytes may unpack to, by their own size.

A few kilobytes can declare or unpack gigabytes. Measured clouds, maps and messages shrink to a
hundredth at most.
"""

_MAX_RATIO = 256
"""Largest ratio of unpacked bytes to packed ones (assumption)."""

_SMALL = 1 << 26
"""Size up to which any ratio is taken [bytes]: that harms nobody, and empty maps shrink a lot."""


def largest_unpacked(packed: int) -> int:
    """Return the largest size to which some packed bytes may unpack [bytes].

    Args:
        packed: Size of the packed bytes [bytes].
    """
    return max(_SMALL, _MAX_RATIO * packed)
