"""The live view in a real browser: what it shows, each control, the keyboard, and its end."""

import threading
import time

import numpy as np
import pytest

from andabata.assembly.controllers import make_steering
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.bench import chromium
from andabata.evaluation.trial import run_trial
from andabata.models import Models
from andabata.tasks.episode_monitor import TerminationConfig
from andabata.viewer.controls import SPEEDS
from andabata.viewer.options import ViewConfig
from andabata.viewer.simulated import SimulatedDriveView
from tests.support.canvases import canvas_colours
from worlds.world import Start, Task

pytestmark = [
    pytest.mark.skipif(chromium.missing() is not None, reason=str(chromium.missing())),
    # viser and the browser's driver leave sockets for the garbage collector.
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]

CONFIG = SimulatedRobotConfig(plant="kinematic")
TASK = Task(Start(-6.0, 0.0, 0.0), ((8.0, 0.0),))
PATIENCE = 240.0


class Drive:
    """A drive on flat ground that is watched, in a thread of its own."""

    def __init__(self, scene):
        models = Models()
        config = ViewConfig(port=0, points=2000, is_paused=True)
        self.view = SimulatedDriveView(config, "planner", models, lambda text: None)
        steering = make_steering("planner", scene.world, CONFIG, models)
        self.robot = SimulatedRobot(scene, CONFIG, models, steering)
        self.view.watch_robot(self.robot)
        self.attempts = None
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()

    def _run(self):
        rules, rng = TerminationConfig(time_limit=60.0), np.random.default_rng(0)
        self.attempts = run_trial(self.robot, TASK, rules, rng, operator=self.view)

    @property
    def steps(self):
        """Number of control steps so far."""
        return len(self.view._source.positions)


def wait_for(condition):
    """Wait until a condition holds; fail after a long time."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


@pytest.fixture(scope="module")
def drive(make_scene):
    """Return a paused drive; it is closed at the end."""
    with_trunks = make_scene()
    made = Drive(with_trunks)
    with made.view:
        yield made


@pytest.fixture(scope="module")
def page(drive):
    """Return an open page of the drive, with the errors that its console has seen."""
    with chromium.browser() as browser:
        found = browser.new_page(viewport={"width": 700, "height": 500})
        found.errors = []
        found.on("pageerror", lambda error: found.errors.append(str(error)))
        found.on(
            "console",
            lambda said: found.errors.append(said.text) if said.type == "error" else None,
        )
        found.set_default_timeout(1000 * PATIENCE)
        found.goto(drive.view.server.url)
        found.get_by_role("button", name="Step", exact=True).wait_for()
        yield found


def test_steps_are_drawn(drive, page):
    """Each press of the button is one control step; the canvas is not blank, the console quiet."""
    for number in range(1, 4):
        page.get_by_role("button", name="Step", exact=True).click()
        wait_for(lambda due=number: drive.steps == due)
    wait_for(lambda: canvas_colours(page) > 100)
    assert drive.view.frames > 0
    assert page.errors == []


def test_play_and_pause_change_the_drive_and_the_button(drive, page):
    """The button says what it does; the space bar does the same."""
    page.get_by_role("button", name="Play", exact=True).click()
    page.get_by_role("button", name="Pause", exact=True).wait_for()
    wait_for(lambda: drive.steps > 5)
    press(page, "Space")
    wait_for(lambda: drive.view.pace.is_paused)
    page.get_by_role("button", name="Play", exact=True).wait_for()


def play(drive, page):
    """Let the drive go on: each test begins for itself, in whatever order and process it runs."""
    if drive.view.pace.is_paused:
        page.get_by_role("button", name="Play", exact=True).click()
        wait_for(lambda: not drive.view.pace.is_paused)


def press(page, key):
    """Press a key once no form has the keyboard any more."""
    page.wait_for_function("document.activeElement === document.body")
    page.keyboard.press(key)


def choose(page, label, value):
    """Choose a value of a dropdown by its label; the page may close it when it draws anew."""
    from playwright.sync_api import TimeoutError as PageTimeoutError

    option = page.get_by_role("option", name=value, exact=True)
    end = time.monotonic() + PATIENCE
    while True:
        page.get_by_label(label, exact=True).first.click()
        try:
            option.click(timeout=5000)
            return
        except PageTimeoutError:
            assert time.monotonic() < end
            page.keyboard.press("Escape")


def test_every_choice_reaches_the_drive(drive, page):
    """Speed, colours, layer of the map and controller."""
    choose(page, "Speed", "10 x")
    wait_for(lambda: drive.view.pace.speed == SPEEDS["10 x"])
    choose(page, "Points by", "height")
    wait_for(lambda: drive.view._scene.cloud._colouring == "height")
    choose(page, "Map", "cost")
    wait_for(lambda: drive.view._source.layer == "cost")
    choose(page, "Controller", "reactive")
    press(page, "n")
    wait_for(lambda: drive.view.report["controllers"] == ["reactive"])


def test_every_check_box_reaches_the_scene(drive, page):
    """Following by box and by key; each layer by its box."""
    scene = drive.view._scene
    press(page, "f")
    wait_for(lambda: not scene.follows)
    page.get_by_label("Follow", exact=True).first.click()
    wait_for(lambda: scene.follows)
    page.get_by_text("Shown", exact=True).click()
    hidden = {
        "Cloud": lambda: not scene.cloud._visible,
        "Sweep": lambda: not scene._robot._shows_sweep,
        "Cells": lambda: not scene._cells._shows_cells,
        "Ranges": lambda: not scene._cells._ranges.visible,
        "Plan": lambda: not scene._way._shows_plan,
        "Estimate": lambda: not scene._estimate._lines.visible,
    }
    for name, is_hidden in hidden.items():
        page.get_by_label(name, exact=True).first.click()
        wait_for(is_hidden)


def test_arrows_drive_by_hand(drive, page):
    """Held, the robot drives ahead by whom it was pressed; let go, it stands."""
    start = drive.robot.simulator.vehicle.state.pose.position.copy()
    play(drive, page)
    page.keyboard.down("ArrowUp")
    wait_for(lambda: drive.view.is_driving and drive.view._result.twist.linear > 0)
    page.keyboard.up("ArrowUp")
    wait_for(lambda: drive.view._result.twist.linear == 0)
    assert drive.view._result.situation is not None
    assert drive.view._result.scan is not None
    moved = drive.robot.simulator.vehicle.state.pose.position - start
    assert np.hypot(*moved[:2]) > 0.01
    assert drive.view.report["controllers"][-1] == "by hand"


def test_a_click_on_the_ground_is_a_goal(drive, page):
    """It becomes the goal of the navigator, on the ground of the world."""
    play(drive, page)
    wait_for(lambda: drive.steps > 0)
    before = drive.view._result.goal.copy()
    page.get_by_role("button", name="Choose the goal").click()
    wait_for(lambda: drive.view.server.viser.scene._scene_pointer_cb)

    def is_chosen():
        # The page hears of it after the server, and a click before that is none.
        page.mouse.click(200, 330)
        time.sleep(0.5)
        return not np.array_equal(drive.view._result.goal, before)

    wait_for(is_chosen)
    assert np.abs(drive.view._result.goal).max() < 10
    assert drive.view.report["goals"] == 1
    assert page.errors == []


def test_a_page_that_is_left_lets_the_drive_end(drive, page):
    """The drive goes on without it, to its goal or its end."""
    play(drive, page)
    choose(page, "Controller", "policy+planner")
    wait_for(lambda: not drive.view.is_driving)
    choose(page, "Speed", "as fast as it goes")
    page.close()
    wait_for(lambda: drive.attempts is not None)
    wait_for(lambda: drive.view.server.viewers == 0)
