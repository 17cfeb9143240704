"""A recording through the same navigator that drove."""

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.app.datum import fixes_by_reason, given_site, use_datum
from andabata.localization.datum import Datum, check_distance, make_datum
from andabata.machine.magnetic_model import decimal_year
from andabata.machine.senses import WheelSpeeds
from andabata.models import Models
from andabata.navigation.navigator import Navigator, Step
from andabata.navigation.perception import assembler_of
from andabata.records.bags import Bag
from andabata.records.gathering import Gathering
from andabata.records.playback import (
    Period,
    Renamed,
    Setup,
    check_topics,
    choose_cloud,
    read_first_fixes,
    read_periods,
    read_setup,
)
from andabata.tasks.controllers import make_controller
from andabata.tasks.rig import RigConfig, make_localizer, make_perception


@dataclass
class Comparison:
    """What came out of a replay beside what came out then.

    Attributes:
        periods: Control periods.
        scans: Of them, those with a virtual scan now.
        recorded_scans: Those with a recorded one.
        compared_scans: Those with both.
        differing_scans: Those with one of the two, or two that differ.
        differing_commands: Recorded commands that differ from the present ones.
        moving: Periods in which the robot is told to move.
        unequal_sectors: Sectors of compared scans that differ.
    """

    periods: int = 0
    scans: int = 0
    recorded_scans: int = 0
    compared_scans: int = 0
    differing_scans: int = 0
    differing_commands: int = 0
    moving: int = 0
    unequal_sectors: int = 0
    _sectors: int = field(default=0, repr=False)

    def add(self, period: Period, step: Step) -> None:
        """Compare one period."""
        self.periods += 1
        self.moving += step.wheels != WheelSpeeds(0.0, 0.0)
        ranges = None if step.view is None else step.view.scan.ranges
        self.scans += ranges is not None
        self.recorded_scans += period.ranges is not None
        if ranges is not None and period.ranges is not None:
            self._compare(ranges, period.ranges)
        elif period.wheels is not None:
            self.differing_scans += (ranges is None) != (period.ranges is None)
        if period.wheels is not None:
            self.differing_commands += step.wheels != period.wheels

    def _compare(self, ranges: NDArray[np.float32], recorded: NDArray[np.float32]) -> None:
        """Compare two virtual scans."""
        self.compared_scans += 1
        if ranges.shape != recorded.shape:
            self.differing_scans += 1
            return
        with np.errstate(invalid="ignore"):
            unequal = (ranges != recorded) & ~(np.isnan(ranges) & np.isnan(recorded))
        self.differing_scans += bool(unequal.any())
        self.unequal_sectors += int(unequal.sum())
        self._sectors += len(ranges)

    def as_dict(self) -> dict[str, Any]:
        """Return the figures, ready for JSON."""
        share = self.unequal_sectors / self._sectors if self._sectors else None
        return {
            "periods": self.periods,
            "scans": self.scans,
            "recorded_scans": self.recorded_scans,
            "compared_scans": self.compared_scans,
            "differing_scans": self.differing_scans,
            "differing_sectors": share,
            "differing_commands": self.differing_commands,
            "moving_periods": self.moving,
        }


def replay_bag(
    path: Path,
    controller: str | None = None,
    models: Models | None = None,
    on_second: Callable[[], None] | None = None,
    cloud: str | None = None,
    configure: Callable[[RigConfig], RigConfig] = lambda recorded: recorded,
    renamed: Mapping[str, str] | None = None,
) -> dict[str, Any]:
    """Send a recording through the navigator and compare what comes out with what came out then.

    Args:
        path: The recording.
        controller: Who steers; None for the recorded one.
        models: With what it sees and steers; None for the shipped ones.
        on_second: Called after each recorded second.
        cloud: A 3D laser's topic instead of the turning laser's two.
        configure: Given the recorded settings, or the defaults, returns those to use.
        renamed: Names of the recording's topics by ours, where they differ.

    Returns:
        Figures, ready for JSON.

    Raises:
        BagError: If the recording lacks the robot's senses, or is damaged.
        DatumError: If the fixes lie far from the datum that is given or recorded.
        ValueError: If there is no such controller, or it cannot be replayed.
    """
    models = models or Models()
    compared, health, names = Comparison(), Counter[str](), renamed or {}
    with Bag(path) as bag:
        topic = choose_cloud(bag, cloud)
        check_topics(bag, Gathering(0, topic), names)
        given = given_site(configure)
        setup = read_setup(bag, given, names)
        config = configure(RigConfig.model_validate(setup.settings.get("rig", {})))
        datum = setup.datum or _recorded_datum(bag, setup, config, given, names)
        name = controller or str(setup.settings.get("controller", "learned"))
        localizer = make_localizer(config, np.random.default_rng(0))
        use_datum(localizer, datum)
        perception = make_perception(config, models.forest)
        driver = make_controller(name, None, config, models)
        navigator = Navigator(config.robot, localizer, perception, driver)
        navigator.reset(setup.start, 0.0, setup.rough)
        navigator.area = setup.area
        gathering = Gathering(setup.epoch_ns, topic)
        for period in read_periods(bag, gathering, names):
            if period.goal is not None:
                navigator.set_goal(period.goal)
            navigator.watch(partial(compared.add, period))
            navigator.step(period.senses)
            health[str(localizer.health)] += 1
            if on_second is not None and compared.periods % 10 == 0:
                on_second()
    recorded, now = setup.settings.get("models"), models.hashes
    assembler = assembler_of(perception)
    return compared.as_dict() | {
        "controller": name,
        "recorded_controller": setup.settings.get("controller"),
        "laser": topic.ros1 if topic else "/2D_scan",
        "same_models": None if recorded is None else recorded == now,
        "health": dict(health),
        "counts": getattr(localizer, "counts", {}),
        "refused": gathering.refused + (assembler.refused if assembler else 0),
        "refused_by_reason": fixes_by_reason(localizer, "refused", setup.refused),
        "assumed_by_reason": fixes_by_reason(localizer, "assumed"),
        **datum.as_dict(),
    }


def _recorded_datum(
    bag: Bag, setup: Setup, config: RigConfig, given: Mapping[str, float], renamed: Renamed
) -> Datum:
    """Return the datum of a recording that names it in its settings.

    Raises:
        DatumError: If the fixes lie far from it.
    """
    site, (fixes, stamp_ns) = config.sensing.site, read_first_fixes(bag, renamed)
    if {"latitude_deg", "longitude_deg"} & set(given):
        ours = site.model_dump(include={"latitude_deg", "longitude_deg", "altitude"})
        year = decimal_year(stamp_ns or setup.epoch_ns)
        return make_datum({**ours, **given}, fixes, year) or Datum(site, "given", "given")
    check_distance(site, fixes, "the recording")
    return Datum(site, "the recording", "given" if given else "the recording")
