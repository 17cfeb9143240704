"""What is drawn on the page of a live view."""

import io

from PIL import Image


def canvas_colours(page):
    """Return the number of different colours on a page's canvas: 1 where it is blank."""
    picture = Image.open(io.BytesIO(page.screenshot(timeout=60_000))).convert("RGB")
    return len(picture.getcolors(picture.width * picture.height) or [])
