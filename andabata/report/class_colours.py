"""Colours of classes, cells and health, the same in figures, clips and the live view.

Free and blocked are a bluish green and vermilion, which the colour-blind tell apart (Okabe and Ito
2008, "Color universal design").
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from andabata.localization.localizer import Health
from terrain.classes import SemanticClass

FREE_COLOUR: Final = "#009e73"
"""Colour of free cells, and of goals that were reached."""

BLOCKED_COLOUR: Final = "#d55e00"
"""Colour of blocked cells, and of crashes."""

UNKNOWN_COLOUR: Final = "#f4f4f0"
"""Colour of unknown cells."""

PATH_COLOUR: Final = "#d0006f"
"""Colour of the driven path."""

PLAN_COLOUR: Final = "#0047c8"
"""Colour of the plan and of goals."""


HEALTH_COLOURS: Final = {
    Health.OK: "#0078ff",
    Health.DEGRADED: "#e69f00",
    Health.DISORIENTED: "#cc5ba5",
    Health.LOST: "#d00000",
}
"""Colours of an estimate by its health."""


def rgb(colour: str) -> tuple[int, int, int]:
    """Return red, green and blue, 0 to 255, of a colour in hexadecimal, such as ``#d55e00``."""
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue


def _table() -> NDArray[np.uint8]:
    """Return red, green and blue by the number of a class, read-only; grey for all others."""
    colours = np.full((256, 3), 150, dtype=np.uint8)
    for semantic, colour in {
        SemanticClass.GROUND: (176, 158, 122),
        SemanticClass.PATH: (200, 184, 150),
        SemanticClass.TRUNK: (107, 74, 43),
        SemanticClass.FOLIAGE: (79, 143, 70),
        SemanticClass.BUSH: (63, 111, 56),
        SemanticClass.ROCK: (125, 125, 125),
        SemanticClass.STONE: (140, 138, 132),
        SemanticClass.HIGH_GRASS: (168, 191, 79),
        SemanticClass.STALKS: (196, 188, 104),
        SemanticClass.MEADOW: (148, 178, 72),
        SemanticClass.THICKET: (92, 128, 52),
        SemanticClass.SHORT_GRASS: (158, 176, 98),
        SemanticClass.KERB: (188, 186, 180),
        SemanticClass.ROOT: (128, 96, 66),
        SemanticClass.WALL: (154, 91, 69),
        SemanticClass.WATER: (63, 127, 196),
        SemanticClass.WALKER: (122, 47, 181),
    }.items():
        colours[semantic] = colour
    colours.setflags(write=False)
    return colours


CLASS_COLOURS: Final = _table()
"""Red, green and blue of each class, uint8, shape (256, 3)."""
