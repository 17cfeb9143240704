"""A recording through the same navigator that drove."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from andabata.assembly.controllers import make_controller
from andabata.assembly.simulated_robot import SimulatedRobotConfig, make_localizer, make_perception
from andabata.localization.datum import Datum, check_distance, make_datum
from andabata.machine.geo_reference import GeoReference
from andabata.machine.magnetic_model import decimal_year
from andabata.machine.proprioception import TESLA
from andabata.machine.robot import RobotModel
from andabata.models import Models
from andabata.navigation.navigator import Navigator
from andabata.navigation.perception import assembler_of
from andabata.records.bag_pieces import BagPiece
from andabata.records.bag_reader import (
    Renamed,
    Setup,
    check_frames,
    check_topics,
    choose_cloud,
    read_first_fixes,
    read_periods,
    read_setup,
    survey,
)
from andabata.records.bags import Bag, BagError
from andabata.records.clocks import NS
from andabata.records.mounts import GivenMounting, Mounts
from andabata.records.remarks import Remarks
from andabata.records.sense_decoding import MessageDecoder
from andabata.records.sense_units import SenseUnits, factor_of, judge_history
from andabata.records.sensor_decoder import SensorDecoder
from andabata.records.topics import SCAN
from andabata.records.transform_tree import read_transforms
from andabata.replay.datum import add_fix_remarks, given_geo_reference, use_datum
from andabata.replay.mounting_monitor import MountingMonitor
from andabata.replay.result import Comparison, Confidence, left_out


def replay_bag(
    path: Path,
    controller: str | None = None,
    models: Models | None = None,
    on_second: Callable[[], None] | None = None,
    cloud: str | None = None,
    configure: Callable[[SimulatedRobotConfig], SimulatedRobotConfig] = lambda recorded: recorded,
    renamed: Mapping[str, str] | None = None,
    mountings: Mapping[str, GivenMounting] | None = None,
    units: Mapping[str, str] | None = None,
) -> dict[str, Any]:
    """Send a recording through the navigator and compare what comes out with what came out then.

    Args:
        path: The recording.
        controller: Name of the controller; None for the recorded one.
        models: With what it sees and steers; None for the shipped ones.
        on_second: Called after each recorded second.
        cloud: A 3D laser's topic instead of the turning laser's two.
        configure: Given the recorded settings, or the defaults, returns those to use.
        renamed: Names of the recording's topics by ours, where they differ.
        mountings: Where senses sit, by sense, above what frames and /tf say.
        units: Units of the senses by quantity, where they differ from what sizes tell.

    Returns:
        Figures, ready for JSON.

    Raises:
        BagError: If the recording lacks the robot's senses, or is damaged.
        FrameError: If gravity or the ground contradicts where a sense is said to sit.
        DatumError: If the fixes lie far from the datum that is given or recorded.
        ValueError: If there is no such controller, or it cannot be replayed.
    """
    models = models or Models()
    compared, sure, names = Comparison(), Confidence(), renamed or {}
    remarks, refused = Remarks(), 0
    told: list[dict[str, Any]] = []
    datum: Datum | None = None
    with Bag(path) as bag:
        topic = choose_cloud(bag, cloud)
        names = check_topics(bag, SensorDecoder(0, topic, MessageDecoder(remarks=remarks)), names)
        mounts = Mounts(mountings, read_transforms(bag))
        check_frames(bag, SensorDecoder(0, topic, mounts=mounts), names)
        robot = configure(SimulatedRobotConfig()).robot
        found = survey(bag, topic, names, MessageDecoder(robot, SenseUnits(), remarks))
        config = configure(
            SimulatedRobotConfig.model_validate(found.settings.get("simulated_robot", {}))
        )
        asked = _factors(units or {}, config.robot)
        given = given_geo_reference(configure)
        flux = _field_strength(bag, given, names, config) * TESLA
        si = judge_history(found.history, config.robot, asked, remarks, flux)
        pieces, cut_out = found.pieces(remarks)
        name = controller or str(found.settings.get("controller", "learned"))
        localizer = make_localizer(config, np.random.default_rng(0))
        perception = make_perception(config, models.forest)
        driver = make_controller(name, None, config, models)
        navigator = Navigator(config.robot, localizer, perception, driver)
        assembler = assembler_of(perception)
        watcher = MountingMonitor(mounts, assembler, config.robot.lidar_height)
        for piece in pieces:
            part = BagPiece(bag, piece)
            decoder = MessageDecoder(config.robot, si, remarks)
            begin = (piece.first_ns - pieces[0].first_ns) / NS
            told.append({"begin_s": begin, "seconds": piece.seconds, "scans": 0, "reason": None})
            try:
                first = MessageDecoder(config.robot, si)
                setup = read_setup(part, given, names, first, mounts)
            except BagError as error:
                told[-1]["reason"] = str(error)
                continue
            if datum is None:
                datum = setup.datum or _recorded_datum(part, setup, config, given, names)
                given = {**given, **_place(datum)}
                use_datum(localizer, datum)
            navigator.reset(setup.start, 0.0, setup.rough)
            navigator.geofence = replace(setup, settings=found.settings).geofence
            sensor_decoder, before = (
                SensorDecoder(piece.epoch_ns(setup.epoch_ns), topic, decoder, mounts),
                compared.scans,
            )
            for period in read_periods(part, sensor_decoder, names):
                if period.goal is not None:
                    navigator.set_goal(period.goal)
                navigator.watch(partial(compared.add, period))
                navigator.step(period.readings)
                watcher.watch(localizer.odometry)
                sure.add(localizer)
                if on_second is not None and compared.periods % 10 == 0:
                    on_second()
            sure.end(localizer)
            add_fix_remarks(remarks, localizer, setup.refused)
            told[-1]["scans"] = compared.scans - before
            unplaced = assembler.refused if assembler else 0
            refused += sensor_decoder.refused + unplaced
            if unplaced:
                laser = topic.ros1 if topic else SCAN.ros1
                remarks.refuse(laser, "no pose is known at its stamp", number=unplaced)
        read = {name for t in SensorDecoder(0, topic).wanted for name in (t.ros1, t.ros2)}
        unread = [str(lost) for lost in bag.left_out if lost.topic in read | set(names.values())]
        for text in bag.notes:
            remarks.note(path.name, text)
    watcher.remark(remarks)
    if told and all(piece["reason"] is not None for piece in told):
        raise BagError(str(told[0]["reason"]))
    recorded, now = found.settings.get("models"), models.hashes
    data = compared.as_dict() | {
        "controller": name,
        "recorded_controller": found.settings.get("controller"),
        "laser": topic.ros1 if topic else "/2D_scan",
        "same_models": None if recorded is None else recorded == now,
        "health": dict(sure.health),
        "complaints": dict(sure.complaints),
        "counts": sure.counts,
        "refused": refused,
        "refused_by_reason": remarks.refused_by_reason(),
        "pieces": told,
        "frames": watcher.frames,
        "remarks": remarks.as_dicts(),
        "remark_texts": remarks.texts,
        **({"datum": None, "magnetic": None} if datum is None else datum.as_dict()),
    }
    return data | {"left_out": [*left_out(data, found.messages, cut_out), *unread]}


def _factors(units: Mapping[str, str], robot: RobotModel) -> dict[str, float]:
    """Return the factors to SI of the units that the user tells.

    Raises:
        ValueError: If there is no such quantity or unit.
    """
    return {quantity: factor_of(quantity, unit, robot) for quantity, unit in units.items()}


def _field_strength(
    bag: Bag, given: Mapping[str, float], renamed: Renamed, config: SimulatedRobotConfig
) -> float:
    """Return the strength of the magnetic field where a recording was made [uT].

    Raises:
        DatumError: If its fixes lie far from the datum that is given.
    """
    if config.sensing.geo_reference != GeoReference():
        return config.sensing.geo_reference.field
    fixes, stamp_ns = read_first_fixes(bag, renamed)
    datum = make_datum(given, fixes, decimal_year(stamp_ns)) if stamp_ns else None
    return (config.sensing.geo_reference if datum is None else datum.reference).field


def _place(datum: Datum) -> dict[str, float]:
    """Return the place of a datum as fields that are given: later pieces count from it, too."""
    fields = datum.reference.model_dump(include={"latitude_deg", "longitude_deg", "altitude"})
    return {name: value for name, value in fields.items() if value is not None}


def _recorded_datum(
    bag: Bag,
    setup: Setup,
    config: SimulatedRobotConfig,
    given: Mapping[str, float],
    renamed: Renamed,
) -> Datum:
    """Return the datum of a recording that names it in its settings.

    Raises:
        DatumError: If the fixes lie far from it.
    """
    geo_reference, (fixes, stamp_ns) = config.sensing.geo_reference, read_first_fixes(bag, renamed)
    if {"latitude_deg", "longitude_deg"} & set(given):
        ours = geo_reference.model_dump(include={"latitude_deg", "longitude_deg", "altitude"})
        year = decimal_year(stamp_ns or setup.epoch_ns)
        return make_datum({**ours, **given}, fixes, year) or Datum(geo_reference, "given", "given")
    check_distance(geo_reference, fixes, "the recording")
    return Datum(geo_reference, "the recording", "given" if given else "the recording")
