"""Player of moments that are known from begin to end: a slider, and the pace."""

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING

from andabata.viewer.pace import Pace

if TYPE_CHECKING:
    import viser


class Player:
    """Plays numbered moments, and jumps where the slider is put.

    Attributes:
        number: Number of the moment that is shown.
    """

    def __init__(self, gui: "viser.GuiApi", pace: Pace) -> None:
        """Add the slider.

        Args:
            gui: Controls of the page.
            pace: Pace of the moments.
        """
        self._pace, self._lock = pace, threading.Lock()
        self._slider = gui.add_slider("Moment", min=0, max=1, step=1, initial_value=0)
        self.number, self._count, self._wanted = 0, 1, False
        self._slider.on_update(self._jump)

    def load(self, count: int) -> None:
        """Begin anew with a number of moments."""
        with self._lock:
            self._count, self.number, self._wanted = count, 0, True
        self._slider.max = max(count - 1, 1)
        self._show()

    def again(self) -> None:
        """Draw the moment that is shown once more."""
        with self._lock:
            self._wanted = True
        self._pace.nudge()

    def play(self, period: float, draw: Callable[[int], None], until: Callable[[], bool]) -> None:
        """Draw moments until something else is wanted; the last one stays.

        Args:
            period: Time from moment to moment [s].
            draw: Function that draws a moment by its number.
            until: Function that returns True when it is time to stop.
        """
        while not until():
            with self._lock:
                wanted, self._wanted = self._wanted, False
                number = self.number
            if wanted:
                draw(number)
                continue
            if number + 1 >= self._count:
                # Nothing moves at the end: look for a jump, or the end of the view, now and then.
                threading.Event().wait(0.05)
                continue
            self._pace.wait(period)
            with self._lock:
                if self._wanted:
                    continue
                self.number = number + 1
            draw(number + 1)
            self._show()

    def _show(self) -> None:
        """Put the slider where the player is."""
        self._slider.value = self.number  # type: ignore[misc]

    def _jump(self, event: "viser.GuiEvent[viser.GuiSliderHandle[int]]") -> None:
        """Go to where somebody has put the slider."""
        if event.client_id is None:  # The player has moved it.
            return
        with self._lock:
            self.number, self._wanted = int(self._slider.value), True
        self._pace.nudge()
