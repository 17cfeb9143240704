"""A recording through the same navigator that drove."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from andabata.app.driving import digest
from andabata.models import shipped_forest, shipped_policy
from andabata.navigation.learned import LearnedController
from andabata.navigation.navigator import Navigator, Step
from andabata.navigation.reactive import ReactiveController, StraightController
from andabata.navigation.view import Controller
from andabata.records.bags import Bag
from andabata.records.playback import check_topics, read_periods, read_setup
from andabata.tasks.rig import RigConfig, make_localizer, make_perception
from rl.policy import Policy
from traversability.forest import Forest


def replay_bag(
    path: Path,
    controller: str | None = None,
    forest: Forest | None = None,
    policy: Policy | None = None,
    on_second: Callable[[], None] | None = None,
) -> dict[str, Any]:
    """Send a recording through the navigator and compare what comes out with what came out then.

    Args:
        path: The recording.
        controller: Who steers; None for the recorded one.
        forest: The cell classifier; None for the shipped one.
        policy: The learned controller's policy; None for the shipped one.
        on_second: Called after each recorded second.

    Returns:
        Figures, ready for JSON.

    Raises:
        BagError: If the recording lacks the robot's senses, or is damaged.
        ValueError: If there is no such controller, or it cannot be replayed.
    """
    eyes = forest or shipped_forest()
    with Bag(path) as bag:
        check_topics(bag)
        setup = read_setup(bag)
        config = RigConfig.model_validate(setup.settings.get("rig", {}))
        name = controller or str(setup.settings.get("controller", "learned"))
        rng = np.random.default_rng(0)
        localizer, perception = make_localizer(config, rng), make_perception(config, eyes)
        driver = _controller(name, config, policy)
        navigator = Navigator(config.robot, localizer, perception, driver)
        navigator.reset(setup.start, 0.0)
        steps: list[Step] = []
        navigator.watch(steps.append)
        periods = scans = other_scans = other_commands = 0
        health: dict[str, int] = {}
        for period in read_periods(bag, setup, config.sensing.lidar):
            if period.goal is not None:
                navigator.set_goal(period.goal)
            steps.clear()
            wheels = navigator.step(period.senses)
            periods += 1
            health[str(localizer.health)] = health.get(str(localizer.health), 0) + 1
            view = steps[0].view
            ranges = None if view is None else view.scan.ranges
            if (ranges is None) != (period.ranges is None):
                other_scans += 1
            elif ranges is not None and period.ranges is not None:
                scans += 1
                other_scans += not np.array_equal(ranges, period.ranges, equal_nan=True)
            if period.wheels is not None:
                other_commands += wheels != period.wheels
            if on_second is not None and periods % 10 == 0:
                on_second()
    recorded = setup.settings.get("forest_sha256")
    return {
        "periods": periods,
        "scans": scans,
        "differing_scans": int(other_scans),
        "differing_commands": int(other_commands),
        "controller": name,
        "recorded_controller": setup.settings.get("controller"),
        "same_forest": None if recorded is None else recorded == digest(eyes.to_bytes()),
        "health": health,
        "counts": getattr(localizer, "counts", {}),
    }


def _controller(name: str, config: RigConfig, policy: Policy | None) -> Controller:
    """Return a controller that needs no truth."""
    match name:
        case "learned":
            return LearnedController(policy or shipped_policy())
        case "reactive":
            return ReactiveController(config.robot, config.grid)
        case "straight":
            return StraightController()
    raise ValueError(
        f"--controller: expected learned, reactive or straight, got {name!r}; the oracle needs the "
        "true map"
    )
