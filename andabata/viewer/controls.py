"""Controls beside the scene: play and pause, what is shown, and who steers."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from andabata.navigation.hand_driving import BY_HAND
from andabata.report.drive_frames import MAP_LAYERS
from andabata.viewer.cloud_drawing import COLOURINGS
from andabata.viewer.keyboard import ARROWS, bind, listen
from andabata.viewer.offroad_scene import LAYERS, OffroadScene
from andabata.viewer.pace import AS_FAST_AS_IT_GOES, Pace

if TYPE_CHECKING:
    import viser

SPEEDS = {
    "0.25 x": 0.25,
    "0.5 x": 0.5,
    "1 x": 1.0,
    "2 x": 2.0,
    "5 x": 5.0,
    "10 x": 10.0,
    "as fast as it goes": AS_FAST_AS_IT_GOES,
}
"""Speeds by name."""


def on_choice(dropdown: "viser.GuiDropdownHandle[str]", act: Callable[[str], None]) -> None:
    """Let the choices of a dropdown do something; other values, which no page sends, do nothing.

    Args:
        dropdown: Dropdown.
        act: Function that takes a choice, in a thread of the server.
    """

    @dropdown.on_update
    def _(event: object) -> None:
        if dropdown.value in dropdown.options:
            act(dropdown.value)


class PlayControls:
    """Play, pause, single step and speed."""

    def __init__(self, gui: "viser.GuiApi", pace: Pace) -> None:
        """Add the controls.

        Args:
            gui: Controls of the page.
            pace: Pace that they set.
        """
        self._pace = pace
        self._play = gui.add_button("Play" if pace.is_paused else "Pause", hint="space")
        step = gui.add_button("Step", hint="One control step: N")
        first = next((name for name, speed in SPEEDS.items() if speed == pace.speed), None)
        names = list(SPEEDS) if first else [f"{pace.speed:g} x", *SPEEDS]
        choice = gui.add_dropdown("Speed", names, initial_value=first or names[0])
        self._play.on_click(lambda event: self.toggle())
        step.on_click(lambda event: self.step())
        on_choice(choice, lambda name: pace.set_speed(_speed_of(name)))
        bind(gui, "space", "Play or pause", self.toggle)
        bind(gui, "N", "One control step", self.step)

    def toggle(self) -> None:
        """Play if there is a pause, else pause."""
        if self._pace.is_paused:
            self._pace.play()
        else:
            self._pace.pause()
        self._name()

    def step(self) -> None:
        """Let one control step pass."""
        self._pace.step()
        self._name()

    def _name(self) -> None:
        """Name the button after what it does."""
        self._play.label = "Play" if self._pace.is_paused else "Pause"


def _speed_of(name: str) -> float:
    """Return the speed of a name."""
    return SPEEDS[name] if name in SPEEDS else float(name.removesuffix(" x"))


class SceneControls:
    """What is shown, and how it is coloured."""

    def __init__(
        self,
        gui: "viser.GuiApi",
        scene: OffroadScene,
        change: Callable[[Callable[[], None]], None],
        choose_layer: Callable[[str], None],
        has_map: bool,
    ) -> None:
        """Add the controls.

        Args:
            gui: Controls of the page.
            scene: Scene that they change.
            change: Function that runs a change of the scene between two frames.
            choose_layer: Function that takes the name of the map's layer.
            has_map: True if the robot keeps a local map.
        """
        follow = gui.add_checkbox("Follow", scene.follows, hint="The camera follows the robot: F")

        def set_follow() -> None:
            scene.follows = follow.value

        follow.on_update(lambda event: set_follow())

        def toggle_follow() -> None:
            follow.value = not follow.value  # type: ignore[misc]  # viser's setter has no type.

        bind(gui, "F", "Follow the robot", toggle_follow)
        colours = gui.add_dropdown("Points by", COLOURINGS)
        on_choice(colours, lambda name: change(lambda: scene.cloud.colour_by(name)))
        layers = gui.add_dropdown("Map", MAP_LAYERS, disabled=not has_map)
        on_choice(layers, choose_layer)
        with gui.add_folder("Shown", expand_by_default=False):
            for name in LAYERS:
                self._add_layer(gui, scene, change, name)

    @staticmethod
    def _add_layer(
        gui: "viser.GuiApi",
        scene: OffroadScene,
        change: Callable[[Callable[[], None]], None],
        name: str,
    ) -> None:
        """Add the check box of a layer."""
        box = gui.add_checkbox(name.capitalize(), True)
        box.on_update(lambda event: change(lambda: scene.show(name, box.value)))


class SteeringControls:
    """Who steers, and where to."""

    def __init__(
        self,
        gui: "viser.GuiApi",
        controllers: Sequence[str],
        first: str,
        steer: Callable[[str], None],
        press: Callable[[str], None],
        release: Callable[[], None],
    ) -> None:
        """Add the controls.

        Args:
            gui: Controls of the page.
            controllers: Names of the controllers to choose from, by hand among them.
            first: Name of the one that steers at first.
            steer: Function that takes the name of another one.
            press: Function that takes the name of a key of ``ARROWS``.
            release: Function that lets all keys go.
        """
        self._steers = gui.add_dropdown("Controller", controllers, initial_value=first)
        on_choice(self._steers, steer)
        gui.add_markdown("Arrows or WASD: drive by hand. Space: pause. N: one step. F: follow.")
        self._press = press
        for name, key in ARROWS.items():
            bind(gui, key, f"Drive by hand: {name}", self._presses(name))
        bind(gui, "end", "Drive by hand: stop", release)
        listen(gui)

    def _presses(self, name: str) -> Callable[[], None]:
        """Return the function of a key: who presses one takes over."""

        def press() -> None:
            if self._steers.value != BY_HAND:
                self._steers.value = BY_HAND  # type: ignore[misc]
            self._press(name)

        return press
