"""Parts that several pictures share: ranges of a scan, and PNG bytes."""

import io
import warnings
from collections.abc import Sequence
from typing import Any, BinaryIO

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Wedge
from matplotlib.text import Text
from numpy.typing import NDArray

from andabata.printable import printable
from traversability.grid import PolarGrid

RANGE_COLOUR = "#1540c4"

_UNKNOWN_STYLE: dict[str, Any] = {
    "facecolor": "#9a9a9a30",
    "edgecolor": "#777777",
    "hatch": "///",
    "linewidth": 0,
}


def draw_ranges(
    axes: Axes,
    ranges: NDArray[np.float32],
    grid: PolarGrid,
    here: Sequence[float] | NDArray[np.float64] = (0.0, 0.0),
    yaw: float = 0.0,
) -> None:
    """Draw the virtual scan of a robot: an arc for each sector, unknown sectors hatched.

    Args:
        axes: Axes to draw on.
        ranges: Ranges of the virtual scan [m], shape (n_sectors,): infinite is free to the last
            ring, NaN unknown.
        grid: Polar grid of the scan.
        here: Position of the robot [m], shape (2,).
        yaw: Heading of the robot [rad].
    """
    half = np.pi / grid.n_sectors
    for bearing, range_ in zip(grid.bearings, ranges, strict=True):
        ends = yaw + bearing - half, yaw + bearing + half
        if np.isnan(range_):
            degrees = np.rad2deg(ends)
            place = (float(here[0]), float(here[1]))
            axes.add_patch(Wedge(place, grid.outer_radius, *degrees, **_UNKNOWN_STYLE))
            continue
        angles, reach = np.linspace(*ends, 6), min(float(range_), grid.outer_radius)
        x, y = here[0] + reach * np.cos(angles), here[1] + reach * np.sin(angles)
        axes.plot(x, y, color=RANGE_COLOUR, linewidth=2)


def range_legend(ranges: NDArray[np.float32]) -> list[Artist]:
    """Return the legend of a drawn virtual scan, of what is there.

    Args:
        ranges: Ranges of the virtual scan [m], shape (n_sectors,).
    """
    known = Line2D([], [], color=RANGE_COLOUR, linewidth=2, label="virtual scan: free up to here")
    unknown = Patch(**_UNKNOWN_STYLE, label="unknown sector: no cell could be classified")
    is_unknown = np.isnan(ranges)
    return [*([] if is_unknown.all() else [known]), *([unknown] if is_unknown.any() else [])]


def save(figure: Figure, stream: BinaryIO, **options: Any) -> None:  # noqa: ANN401
    """Write a figure; names in it may hold anything that a file's name may.

    Args:
        figure: Figure, whose texts become such that can be drawn.
        stream: File to write to.
        **options: Options of ``Figure.savefig``.
    """
    for text in figure.findobj(Text):
        if isinstance(text, Text):
            text.set_text(printable(text.get_text()))
    with warnings.catch_warnings():
        # The font draws a box for letters that it lacks, of other scripts.
        warnings.filterwarnings("ignore", "Glyph .* missing from font", UserWarning)
        figure.savefig(stream, **options)


def png(figure: Figure, dpi: int = 80) -> bytes:
    """Return a figure's PNG file.

    Args:
        figure: Figure.
        dpi: Resolution [pixels/inch].
    """
    stream = io.BytesIO()
    save(figure, stream, format="png", dpi=dpi)
    return stream.getvalue()
