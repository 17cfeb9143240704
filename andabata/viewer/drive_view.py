"""Live view of a drive: takes frames from the navigator, draws them, and lets people take part.

The drive runs in its own thread and waits for nothing but its pace. Frames go to a thread that
draws, over a slot that holds the newest one: neither a slow browser nor a closed one holds up the
drive.
"""

import math
import queue
import secrets
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from andabata.assembly.navigator import NavigatorConfig
from andabata.localization.estimator_status import SIGMAS, EstimatorStatus
from andabata.machine.clock import CONTROL_PERIOD
from andabata.machine.pose import wrap
from andabata.navigation.controller import Steering
from andabata.navigation.hand_driving import BY_HAND, HandController, by_hand, led_by
from andabata.navigation.navigator import Navigator, StepResult
from andabata.navigation.planning.local_planner import LocalPlanner
from andabata.report.drive_frames import DriveFrame, FrameSource
from andabata.viewer.controls import PlayControls, SceneControls, SteeringControls
from andabata.viewer.ground_click import GroundClick
from andabata.viewer.newest import Newest
from andabata.viewer.offroad_scene import OffroadScene
from andabata.viewer.options import ViewConfig
from andabata.viewer.pace import Pace
from andabata.viewer.plots import Plots
from andabata.viewer.server import ViewServer
from worlds.world import World

FRAME_PERIOD = 1 / 20.5
"""Time between two frames at least, on average [s]: a little less than a twentieth of a second."""

_UNWATCHED_PERIOD = 1.0
"""The same while no page is open [s]; a page that opens then sees the last one at once."""

_TEXT_PERIOD = 0.4
"""Time between two updates of texts and plots [s]."""

_SWITCH_INTERVAL = 0.0005
"""Time after which Python's threads take turns [s]: the drive waits no longer for the drawing."""

PLOTS = {
    "Heading error [deg]": ("heading error",),
    "Steering [rad/s]": ("steering",),
    "Speed [m/s]": ("speed",),
}
"""Values of the plots by title."""


class DriveView:
    """Watches one drive, in simulation, on a recording or on a robot.

    As an operator of a trial it waits for the pace, changes the steering and names goals.

    Attributes:
        server: Page.
        pace: Pace of the drive.
        frames: Number of frames that were drawn.
    """

    def __init__(
        self,
        config: ViewConfig,
        title: str,
        status: Callable[[str], None],
        is_live: bool = False,
    ) -> None:
        """Begin to serve.

        Args:
            config: Choices of who watches.
            title: Title over the controls.
            status: Function that prints a line for the user.
            is_live: True for a real robot, which waits for nobody.

        Raises:
            ViewerError: If viser is not installed.
        """
        self._config, self._status, self._is_live = config, status, is_live
        token = secrets.token_urlsafe() if config.allow_commands else None
        self.server = ViewServer(title, config.port, token)
        self.pace = Pace(config.speed, config.is_paused)
        self.frames = 0
        self._slot: Newest[DriveFrame] = Newest()
        self._lock = threading.Lock()
        self._commands: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._clicked: NDArray[np.float64] | None = None
        self._due, self._is_driving = -math.inf, False
        self._result: StepResult | None = None
        self._thread: threading.Thread | None = None
        self._interventions: dict[str, Any] = {"goals": 0, "controllers": [], "by_hand_s": 0.0}

    def __enter__(self) -> Self:
        """Return the view."""
        self._interval = sys.getswitchinterval()
        sys.setswitchinterval(_SWITCH_INTERVAL)
        return self

    def __exit__(self, *error: object) -> None:
        """Close the page."""
        sys.setswitchinterval(self._interval)
        self.close()

    def watch(
        self,
        navigator: Navigator,
        source: FrameSource,
        config: NavigatorConfig,
        world: World | None,
        steering: "Callable[[str], Steering] | None" = None,
        controllers: Sequence[str] = (),
        controller: str = "",
        set_goal: Callable[[NDArray[np.float64]], None] | None = None,
    ) -> None:
        """Draw what stays, and watch a navigator from now on.

        Args:
            navigator: Navigator of the robot.
            source: Source of its frames.
            config: Its settings.
            world: World of the drive; None where it is not known.
            steering: Function from a controller's name to the steering; None where nobody else can
                steer, as on a recording.
            controllers: Names of the controllers to choose from.
            controller: Name of the one that steers at first.
            set_goal: Function that takes goals that are clicked at; None leaves them to ``attend``,
                where somebody can steer.
        """
        self._navigator, self._source, self._steering = navigator, source, steering
        self._hand = HandController(config.robot)
        gui = self.server.viser.gui
        self._scene = OffroadScene(self.server.viser, config, world, self._config.points)
        self._text = gui.add_markdown("The drive has not begun.")
        if not self._is_live:
            PlayControls(gui, self.pace)
        self._set_goal = set_goal or self._keep_goal
        self._click = GroundClick(self.server.viser, world)
        if steering is not None:
            SteeringControls(
                gui,
                (*controllers, BY_HAND),
                controller,
                self._steer,
                self._hand.press,
                self._hand.release,
            )
        if steering is not None or set_goal is not None:
            goal = gui.add_button("Choose the goal", hint="then click on the ground")
            goal.on_click(lambda event: self._choose_goal())
        has_map = isinstance(led_by(navigator.planner), LocalPlanner)
        SceneControls(gui, self._scene, self.change, self._choose_layer, has_map)
        self._plots = Plots(gui, PLOTS)
        self.server.viser.on_client_disconnect(lambda client: self._hand.release())
        self._observe()
        self._thread = threading.Thread(target=self._draw_frames, name="view", daemon=True)
        self._thread.start()
        self.server.announce(self._status)

    @property
    def is_driving(self) -> bool:
        """True while the robot is driven by hand."""
        return self._is_driving

    @property
    def report(self) -> dict[str, Any]:
        """Number of frames, and what people did in the drive, ready for JSON.

        That are numbers of goals, names of controllers that took over, and time by hand [s].
        """
        return {"frames": self.frames, **self._interventions}

    def attend(self) -> NDArray[np.float64] | None:
        """Wait for the pace, do what was asked for, and return another goal, if there is one."""
        self.pace.wait(CONTROL_PERIOD)
        while not self._commands.empty():
            self._commands.get()()
        self._observe()
        if self._is_driving:
            self._interventions["by_hand_s"] = round(
                self._interventions["by_hand_s"] + CONTROL_PERIOD, 3
            )
        goal, self._clicked = self._clicked, None
        return goal

    def change(self, act: Callable[[], None]) -> None:
        """Change the scene between two frames, and draw the last one anew."""
        with self._lock:
            act()
        if self._result is not None and self.pace.is_paused:
            self._slot.put(self._source.frame(self._result))

    def finish(self, text: str) -> None:
        """Say how the drive ended, and wait until no page is open any more.

        Args:
            text: Text of the page.
        """
        if self._result is not None:
            self._slot.put(self._source.frame(self._result))
        self._text.content = f"**The drive is over.** {text}"
        self._ended = True
        if self.server.viewers:
            # The command has printed its result, which somebody else may read.
            sys.stdout.flush()
            self._status("the page stays until it is closed, or until Ctrl-C")
            with suppress(KeyboardInterrupt):
                self.server.wait_for_viewers_to_leave()

    def close(self) -> None:
        """Close the page; the drive goes on without it."""
        self.pace.close()
        self._slot.close()
        if self._thread is not None:
            self._thread.join(timeout=2.0)
        self.server.close()

    _ended = False

    def _observe(self) -> None:
        """Watch each scan while there is time for it, those of decisions alone at full speed."""
        navigator, watch = self._navigator, self._on_step
        waits = self.pace.is_paused or math.isfinite(self.pace.speed)
        here, there = navigator.observers, navigator.spectators
        if not waits:
            here, there = there, here
        if watch not in here:
            here.append(watch)
        if watch in there:
            there.remove(watch)

    def _on_step(self, result: StepResult) -> None:
        """Take in a step of the navigator; take a frame of it if one is due."""
        self._source.advance(result)
        self._result = result
        now = time.monotonic()
        period = FRAME_PERIOD if self.server.viewers else _UNWATCHED_PERIOD
        if now < self._due and not self.pace.is_paused:
            return
        # Steps come when they come: a frame that was late does not put off the next one.
        self._due = max(self._due, now - period) + period
        self._slot.put(self._source.frame(result))

    def _draw_frames(self) -> None:
        """Draw the newest frames, one after the other, until the end."""
        drawn = -math.inf
        while (frame := self._slot.take()) is not None:
            with self._lock:
                self._scene.draw(frame, self._source.positions)
            self.frames += 1
            self._plots.history.add(frame.stamp, _values(frame))
            if time.monotonic() - drawn > _TEXT_PERIOD or self.pace.is_paused:
                drawn = time.monotonic()
                self._plots.draw()
                if not self._ended:
                    self._text.content = frame_text(frame)

    def _steer(self, name: str) -> None:
        """Let another controller take over before the next step."""

        def change() -> None:
            assert self._steering is not None
            before = self._navigator.steering
            if name == BY_HAND:
                after = by_hand(self._hand, before)
            else:
                after = self._steering(name)
                planner = led_by(before.planner)
                if isinstance(planner, LocalPlanner) and isinstance(after.planner, LocalPlanner):
                    # The map that the robot has made so far stays.
                    after = Steering(after.controller, planner, after.action_repeat)
            self._navigator.steer(after)
            self._is_driving = name == BY_HAND
            self._interventions["controllers"] = [*self._interventions["controllers"], name]

        self._commands.put(change)

    def _choose_goal(self) -> None:
        """Take the next click on the ground as the goal."""
        self._click.wait(lambda: self._scene.offset, lambda: self._foot, self._set_goal)

    def _keep_goal(self, place: NDArray[np.float64]) -> None:
        """Keep a goal for the next step [m], shape (2,)."""
        self._clicked = place
        self._interventions["goals"] += 1

    @property
    def _foot(self) -> float:
        """Height of the robot's foot in the map [m]."""
        positions = self._source.positions
        return float(positions[-1][2]) if positions else 0.0

    def _choose_layer(self, name: str) -> None:
        """Show another layer of the map."""
        self._source.layer = name
        self.change(lambda: None)


def _values(frame: DriveFrame) -> dict[str, float | None]:
    """Return the values of a frame that are plotted."""
    error = frame.heading_error
    return {
        "heading error": None if error is None else math.degrees(error),
        "steering": frame.twist.angular,
        "speed": frame.twist.linear,
    }


def frame_text(frame: DriveFrame) -> str:
    """Return what the page says of a frame."""
    lines = [f"**{frame.stamp:.1f} s**"]
    if frame.goal is not None:
        away = float(np.hypot(*(frame.goal - frame.pose.position[:2])))
        there = ", declared reached" if frame.has_arrived else ""
        lines.append(
            f"goal at {frame.goal[0]:.1f}, {frame.goal[1]:.1f} m: {away:.1f} m away{there}"
        )
    if frame.status is not None:
        lines += _estimate_lines(frame, frame.status)
    return "  \n".join(lines)


def _estimate_lines(frame: DriveFrame, status: EstimatorStatus) -> list[str]:
    """Return what the page says of the estimate: health and causes, uncertainty, unused readings.

    The true error stands beside the uncertainty where it is known.
    """
    sigma, yaw_sigma = SIGMAS * status.position_sigma, SIGMAS * np.rad2deg(status.yaw_sigma)
    lines = [f"estimate **{status.health}**", *status.causes]
    lines.append(f"{SIGMAS:.0f} sigma: {sigma:.2f} m, {yaw_sigma:.1f} degrees")
    if frame.is_true:
        error = float(np.hypot(*(frame.estimate.position - frame.pose.position)[:2]))
        turn = np.rad2deg(abs(wrap(frame.estimate.yaw - frame.pose.yaw)))
        lines.append(f"estimate off by {error:.2f} m, {turn:.1f} degrees")
    return [*lines, *(f"not used: {text}" for text in status.unused_in_words)]
