"""Words on pictures: a line above, and a legend below, on light strips."""

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Protocol

import matplotlib
from PIL import ImageDraw, ImageFont

_INK, _PAPER = (25, 25, 25), (255, 255, 255)

_SHARE = 1 / 56
"""Size of the letters over the width of the picture."""

_LEAST_SIZE = 11
"""Least size of letters [pixels]."""


class Entry(Protocol):
    """An entry of a legend."""

    @property
    def text(self) -> str:
        """Text."""

    @property
    def colour(self) -> tuple[int, int, int]:
        """Colour."""

    @property
    def is_area(self) -> bool:
        """True for a filled area, False for a line."""


@cache
def _font(size: int) -> ImageFont.FreeTypeFont:
    """Return matplotlib's font, which is there wherever matplotlib is."""
    return ImageFont.truetype(
        str(Path(matplotlib.get_data_path()) / "fonts/ttf/DejaVuSans.ttf"), size
    )


def letter_size(width: int) -> int:
    """Return the size of the letters on a picture of a width [pixels]."""
    return max(round(_SHARE * width), _LEAST_SIZE)


def caption(draw: ImageDraw.ImageDraw, width: int, text: str) -> tuple[float, float, float, float]:
    """Write a line into the upper left corner, and return its box.

    Args:
        draw: Pen on the picture.
        width: Width of the picture [pixels].
        text: Text.

    Returns:
        Left, top, right and bottom of the box [pixels].
    """
    size = letter_size(width)
    font, pad = _font(size), size // 3
    right = draw.textlength(text, font) + 2 * pad
    box = (0.0, 0.0, right, 1.25 * size + pad)
    draw.rectangle(box, fill=_PAPER)
    draw.text((pad, pad // 2), text, fill=_INK, font=font)
    return box


def legend_line(
    draw: ImageDraw.ImageDraw, width: int, height: int, entries: Sequence[Entry]
) -> tuple[float, float, float, float]:
    """Write a legend into the lower left corner, and return its box.

    Args:
        draw: Pen on the picture.
        width: Width of the picture [pixels].
        height: Height of the picture [pixels].
        entries: Entries from left to right.

    Returns:
        Left, top, right and bottom of the box [pixels], empty without entries.
    """
    size = letter_size(width)
    font, pad = _font(size), size // 3
    top = height - 1.25 * size - pad
    lengths = [draw.textlength(entry.text, font) for entry in entries]
    right = sum(lengths) + len(entries) * (size + 4 * pad)
    box = (0.0, top, right, float(height))
    if not entries:
        return (0.0, float(height), 0.0, float(height))
    draw.rectangle(box, fill=_PAPER)
    x, middle = float(pad), (top + height) / 2
    for entry, length in zip(entries, lengths, strict=True):
        half = 0.4 * size if entry.is_area else max(0.12 * size, 1.0)
        draw.rectangle((x, middle - half, x + size, middle + half), fill=entry.colour)
        draw.text((x + size + pad, top + pad // 2), entry.text, fill=_INK, font=font)
        x += size + length + 4 * pad
    return box
