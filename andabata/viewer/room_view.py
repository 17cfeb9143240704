"""View of the drives of an evaluation in rooms."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Self

from andabata.evaluation.room_moments import WatchedDrive
from andabata.viewer.controls import PlayControls, on_choice
from andabata.viewer.export import PageWriter
from andabata.viewer.options import ViewConfig
from andabata.viewer.pace import Pace
from andabata.viewer.player import Player
from andabata.viewer.plots import Plots
from andabata.viewer.room_choices import DriveChoices
from andabata.viewer.room_scene import ROOM_LAYERS, RoomScene
from andabata.viewer.server import ViewServer


class RoomView:
    """Plays drives in rooms that are chosen on the page.

    Attributes:
        server: Page.
    """

    def __init__(
        self,
        choices: DriveChoices,
        config: ViewConfig,
        first: Mapping[str, str],
        status: Callable[[str], None],
    ) -> None:
        """Load the first drive and begin to serve.

        Args:
            choices: Drives to choose from.
            config: Choices of who watches.
            first: Values of the first drive; the first of each name where it is missing.
            status: Function that prints a line for the user.

        Raises:
            ViewerError: If viser is not installed.
        """
        self._choices, self._status = choices, status
        self._chosen = {
            name: first.get(name, values[0]) for name, values in choices.choices.items()
        }
        self._drive = choices.load(self._chosen)
        self.server = ViewServer("andabata view", config.port)
        gui, pace = self.server.viser.gui, Pace(config.speed, config.is_paused)
        self._pace, self._is_closed, self._is_stale = pace, False, False
        self._text = gui.add_markdown("")
        for name in choices.choices:
            self._add_choice(name)
        PlayControls(gui, pace)
        self._player = Player(gui, pace)
        self._scene = RoomScene(self.server.viser)
        with gui.add_folder("Shown", expand_by_default=False):
            for layer in ROOM_LAYERS:
                self._add_layer(layer)
        terms = sorted({name for one in self._drive.moments for name in one.rewards})
        groups = {"Speed [m/s]": ["speed"], "Yaw rate [rad/s]": ["yaw rate"]}
        groups |= {"Reward of a step": terms} if terms else {}
        self._plots = Plots(gui, groups)

    def __enter__(self) -> Self:
        """Return the view."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close the page."""
        self.close()

    def run(self) -> None:
        """Play until Ctrl-C, or until the view is closed."""
        self.server.announce(self._status)
        while not self._is_closed:
            self._load()
            self._player.play(
                self._drive.period, self._draw, lambda: self._is_closed or self._is_stale
            )
            if self._is_stale and not self._is_closed:
                self._text.content = "Driving it again ..."
                self._is_stale = False
                self._drive = self._choices.load(self._chosen)

    def write(self, path: Path) -> None:
        """Write the first drive as a page that plays by itself."""
        with PageWriter(self.server.viser, path) as page:
            self._scene.load(self._drive)
            for number in range(len(self._drive.moments)):
                self._scene.draw(number)
                page.hold(self._drive.period)

    def close(self) -> None:
        """Close the page."""
        self._is_closed = True
        self._pace.close()
        self.server.close()

    def _load(self) -> None:
        """Show the room of the drive that is chosen."""
        self._scene.load(self._drive)
        self._player.load(len(self._drive.moments))
        self._text.content = f"**{self._choices.remark(self._chosen, self._drive)}**"
        _fill(self._plots, self._drive)
        self._plots.draw()

    def _draw(self, number: int) -> None:
        """Draw a moment."""
        self._scene.draw(number)

    def _add_choice(self, name: str) -> None:
        """Add the choice of one thing that tells drives apart."""
        names = list(self._choices.choices[name])
        handle = self.server.viser.gui.add_dropdown(
            name.capitalize(), names, initial_value=self._chosen[name]
        )

        def choose(value: str) -> None:
            self._chosen = self._chosen | {name: value}
            self._is_stale = True
            self._pace.nudge()

        on_choice(handle, choose)

    def _add_layer(self, layer: str) -> None:
        """Add the check box of a layer."""
        box = self.server.viser.gui.add_checkbox(layer.capitalize(), True)

        def show() -> None:
            self._scene.show(layer, box.value)
            self._player.again()

        box.on_update(lambda event: show())


def _fill(plots: Plots, drive: WatchedDrive) -> None:
    """Put the values of a whole drive into the plots."""
    plots.history.clear()
    for number, moment in enumerate(drive.moments):
        values = {"speed": moment.velocity[0], "yaw rate": moment.velocity[1], **moment.rewards}
        plots.history.add(number * drive.period, values)
