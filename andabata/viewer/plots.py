"""Plots beside the scene: values over the last seconds of a drive."""

from collections import deque
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import viser

_KEPT = 400
"""Number of samples that are shown."""

_HEIGHT = 150
"""Height of a plot [pixels]."""

_COLOURS = ("#d0006f", "#0047c8", "#2f7d32", "#d98e32", "#7b3fa0", "#00838f")
"""Colours of the lines of a plot."""


class History:
    """Samples of some values over time, the last few hundred."""

    def __init__(self, names: Sequence[str]) -> None:
        """Begin without samples.

        Args:
            names: Names of the values.
        """
        self.names = tuple(names)
        self._rows: deque[tuple[float, ...]] = deque(maxlen=_KEPT)

    def add(self, stamp: float, values: Mapping[str, float | None]) -> None:
        """Add a sample.

        Args:
            stamp: Time [s]; an earlier one than the last begins anew.
            values: Values by name; None, or a missing one, is a gap.
        """
        if self._rows and stamp < self._rows[-1][0]:
            self._rows.clear()
        row = [values.get(name) for name in self.names]
        self._rows.append((stamp, *(np.nan if value is None else float(value) for value in row)))

    def clear(self) -> None:
        """Forget all samples."""
        self._rows.clear()

    def columns(self, names: Sequence[str]) -> tuple[NDArray[np.float64], ...]:
        """Return the stamps [s] and the samples of some values, each of shape (k,)."""
        table = np.array(self._rows, dtype=np.float64).reshape(-1, 1 + len(self.names))
        places = [0, *(1 + self.names.index(name) for name in names)]
        return tuple(table[:, place].copy() for place in places)


class Plots:
    """Plots of a history, one for each group of values."""

    def __init__(self, gui: "viser.GuiApi", groups: Mapping[str, Sequence[str]]) -> None:
        """Add the plots to the controls.

        Args:
            gui: Controls.
            groups: Names of the values of each plot by the plot's title.
        """
        from viser import uplot

        self._groups = {title: tuple(names) for title, names in groups.items()}
        self.history = History([name for names in groups.values() for name in names])
        none = np.zeros(0)
        self._handles = {
            title: gui.add_uplot(
                (none,) * (1 + len(names)),
                (
                    uplot.Series(label="time [s]"),
                    *(
                        uplot.Series(label=name, stroke=colour, width=2)
                        for name, colour in zip(names, _COLOURS, strict=False)
                    ),
                ),
                title=title,
                scales={"x": uplot.Scale(time=False)},
                height=_HEIGHT,
            )
            for title, names in self._groups.items()
        }

    def draw(self) -> None:
        """Send the samples."""
        for title, handle in self._handles.items():
            handle.data = self.history.columns(self._groups[title])
