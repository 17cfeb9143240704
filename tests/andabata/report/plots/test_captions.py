"""Words on pictures: inside the picture, in their colours, none without entries."""

import numpy as np
import pytest
from PIL import Image, ImageDraw

from andabata.report.plots.captions import caption, legend_line, letter_size
from andabata.report.plots.drive_picture import LegendEntry

ENTRIES = [
    LegendEntry("free", (0, 158, 115), True),
    LegendEntry("blocked", (213, 94, 0), True),
    LegendEntry("laser", (255, 210, 40)),
    LegendEntry("driven", (208, 0, 111)),
    LegendEntry("plan", (0, 71, 200)),
]


@pytest.mark.parametrize("size", [(480, 300), (1200, 675)])
def test_words_lie_inside_the_picture(size):
    """Neither the caption nor the legend of all entries is cut, at any size."""
    image = Image.new("RGB", size)
    draw = ImageDraw.Draw(image)
    boxes = [caption(draw, size[0], "123 s, goal 45 m away"), legend_line(draw, *size, ENTRIES)]
    for left, top, right, bottom in boxes:
        assert 0 <= left < right <= size[0]
        assert 0 <= top < bottom <= size[1]
    assert boxes[0][3] < boxes[1][1]


def test_each_entry_has_its_colour():
    """Areas have more of it than lines."""
    image = Image.new("RGB", (480, 300))
    legend_line(ImageDraw.Draw(image), 480, 300, ENTRIES)
    pixels = np.asarray(image)
    counts = [int((pixels == each.colour).all(axis=2).sum()) for each in ENTRIES]
    assert min(counts) > 10
    assert min(counts[:2]) > max(counts[2:])


def test_without_entries_nothing_is_drawn():
    """The picture stays black."""
    image = Image.new("RGB", (480, 300))
    legend_line(ImageDraw.Draw(image), 480, 300, [])
    assert np.asarray(image).max() == 0


def test_letters_grow_with_the_picture_and_stay_legible():
    """Ten pixels and more."""
    assert letter_size(100) == letter_size(300) >= 10
    assert letter_size(1200) > letter_size(480)
