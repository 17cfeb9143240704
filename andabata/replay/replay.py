"""Replay of a recording through the navigator that drives, compared with the recorded output."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from andabata.assembly.controllers import (
    default_controller,
    make_steering,
    refuse_unused_policy,
)
from andabata.assembly.navigator import NavigatorParts, make_navigator
from andabata.localization.datum import Datum
from andabata.machine.fault_injector import FaultInjector
from andabata.models import Models
from andabata.navigation.fault_watch import FaultWatch, response_as_dict
from andabata.navigation.navigator import StepResult
from andabata.navigation.perception import assembler_of
from andabata.records.bag_piece import BagPiece
from andabata.records.bag_reader import Period, read_periods
from andabata.records.bags import Bag, BagError
from andabata.records.decoding.sensor_decoder import SensorDecoder
from andabata.records.drive_setup import DriveSetup, read_setup
from andabata.records.messages import NS
from andabata.records.pieces import Piece
from andabata.records.remarks import Remarks
from andabata.replay.compass_check import CompassCheck
from andabata.replay.datum import add_fix_remarks, position_fields, recorded_datum, use_datum
from andabata.replay.mounting_monitor import MountingMonitor
from andabata.replay.options import ReplayOptions
from andabata.replay.recorded_drive import RecordedDrive, inspect_drive
from andabata.replay.result import LocalizerStatistics, PieceReport, RecordedComparison, left_out

_FAULT_SEED = 1
"""Seed of the garbage of injected faults: a replay gives the same each time."""

_PERIODS_PER_SECOND = 10
"""Number of control periods after which ``on_second`` is called."""


class ReplayViewer(Protocol):
    """Person who watches a replay, and may let it wait."""

    def watch_replay(self, parts: NavigatorParts, drive: RecordedDrive) -> None:
        """Begin to watch a navigator that has not been sent anything yet."""

    def attend(self) -> object:
        """Wait before a control period, for as long as the viewer likes."""


def replay_bag(
    path: Path,
    options: ReplayOptions | None = None,
    on_second: Callable[[], None] | None = None,
    viewer: ReplayViewer | None = None,
) -> dict[str, Any]:
    """Send a recording through the navigator and compare its output with the recorded output.

    Args:
        path: The recording.
        options: User's choices; None for those of the recording.
        on_second: Function called after each recorded second.
        viewer: Person who watches, or None.

    Returns:
        Result, ready for JSON.

    Raises:
        BagError: If the recording lacks a sensor that the robot needs, or is damaged.
        FrameError: If gravity or the ground contradicts a stated mounting.
        DatumError: If the fixes lie far from the datum that is given or recorded.
        ValueError: If there is no such controller or unit, or the controller cannot be replayed.
    """
    with Bag(path) as bag:
        return BagReplay(bag, options or ReplayOptions(), on_second, viewer).run()


class ReplayObserver(Protocol):
    """Learns from a replay: it sees what was recorded and what the navigator makes of it."""

    def begin(self, parts: NavigatorParts, drive: RecordedDrive) -> None:
        """Take the navigator, which has not been sent anything yet, and the recording's facts."""

    def observe(self, period: Period, result: StepResult) -> None:
        """Take a recorded control period and the navigator's step for it."""

    def end_piece(self) -> None:
        """Take note that a piece is over: times and poses of the next one are its own."""


class BagReplay:
    """Replay of one recording, assembled once and run piece by piece."""

    def __init__(
        self,
        bag: Bag,
        options: ReplayOptions,
        on_second: Callable[[], None] | None = None,
        viewer: ReplayViewer | None = None,
        observer: ReplayObserver | None = None,
    ) -> None:
        """Inspect a recording and assemble the navigator for it.

        Args:
            bag: The recording, open.
            options: User's choices.
            on_second: Function called after each recorded second.
            viewer: Person who watches, or None.
            observer: Learner from the replay, or None.

        Raises:
            BagError: If the recording lacks a sensor that the robot needs, or is damaged.
            FrameError: If the mounting of a sensor is unknown.
            DatumError: If the fixes lie far from the datum that is given.
            ValueError: If there is no such controller or unit.
        """
        self._bag, self._on_second, self._viewer = bag, on_second, viewer
        self._observer = observer
        self._period: Period | None = None
        self._remarks, self._refused = Remarks(), 0
        self._comparison, self._statistics = RecordedComparison(), LocalizerStatistics()
        self._reports: list[PieceReport] = []
        self._drive = inspect_drive(bag, options, self._remarks)
        self._given: dict[str, float] = self._drive.given
        self._datum: Datum | None = None
        self._has_compass_advice = False
        self._watches: list[FaultWatch] = []
        self._models = options.models or Models()
        named = options.controller or self._drive.controller
        self._controller = str(named or default_controller(self._models))
        refuse_unused_policy((self._controller,), self._models, "--controller")
        self._assemble_navigator()

    def _assemble_navigator(self) -> None:
        """Assemble the recorded robot's navigator.

        Raises:
            ValueError: If there is no such controller.
        """
        config = self._drive.config
        steering = make_steering(self._controller, None, config, self._models)
        rng = np.random.default_rng(0)
        self._injector = FaultInjector(config.faults, np.random.default_rng(_FAULT_SEED))
        parts = make_navigator(config, self._models, steering, rng, self._injector)
        self._navigator, self._localizer, perception = parts
        self._navigator.observers.append(self._compare)
        if self._viewer is not None:
            self._viewer.watch_replay(parts, self._drive)
        if self._observer is not None:
            self._observer.begin(parts, self._drive)
        self._assembler = assembler_of(perception)
        self._mountings = MountingMonitor(
            self._drive.extrinsics, self._assembler, config.robot.lidar_height
        )

    def run(self) -> dict[str, Any]:
        """Replay all pieces of the recording and return the result, ready for JSON.

        Raises:
            BagError: If no piece has a known start, or the recording is damaged.
            FrameError: If gravity or the ground contradicts a stated mounting.
            DatumError: If the fixes lie far from the datum.
        """
        for piece in self._drive.pieces:
            self._replay_piece(piece)
        for note in self._bag.notes:
            self._remarks.note(self._bag.path.name, note)
        self._mountings.add_remarks(self._remarks)
        if self._reports and all(report.reason is not None for report in self._reports):
            raise BagError(str(self._reports[0].reason))
        return self._result()

    def _replay_piece(self, piece: Piece) -> None:
        """Replay one piece from a start of its own; a piece without a known start is reported."""
        report, bag = self._begin_report(piece), BagPiece(self._bag, piece)
        try:
            setup = self._read_setup(bag)
        except BagError as error:
            report.reason = str(error)
            return
        self._reset(bag, setup)
        scans_before = self._comparison.scans
        decoder = self._sensor_decoder(piece.epoch_ns(setup.epoch_ns))
        for period in read_periods(bag, decoder, self._drive.topics, with_updates=True):
            self._step(period)
        self._end_piece(setup, decoder)
        if self._observer is not None:
            self._observer.end_piece()
        report.scans = self._comparison.scans - scans_before

    def _begin_report(self, piece: Piece) -> PieceReport:
        """Return the report of a piece, empty and already among the others."""
        begin = (piece.first_ns - self._drive.pieces[0].first_ns) / NS
        report = PieceReport(begin, piece.seconds)
        self._reports.append(report)
        return report

    def _read_setup(self, bag: BagPiece) -> DriveSetup:
        """Return start, settings and datum of a piece.

        Raises:
            BagError: If no start is known.
        """
        drive = self._drive
        return read_setup(bag, self._given, drive.topics, drive.message_decoder(), drive.extrinsics)

    def _reset(self, bag: BagPiece, setup: DriveSetup) -> None:
        """Reset the navigator to the start of a piece; the first piece fixes the datum."""
        drive = self._drive
        if self._datum is None:
            self._datum = setup.datum or recorded_datum(
                bag, setup, drive.config, self._given, drive.topics
            )
            # Later pieces have to use the same map.
            self._given = {**self._given, **position_fields(self._datum)}
            use_datum(self._localizer, self._datum)
        self._compass = CompassCheck(self._datum.reference, drive.config.robot.wheel_radius)
        self._navigator.reset(setup.start, 0.0, setup.is_rough)
        self._injector.reset(np.random.default_rng(_FAULT_SEED))
        faults, robot = drive.config.faults, drive.config.robot
        if faults:
            self._watches.append(FaultWatch.of(faults, self._localizer, robot))
        recorded = replace(setup, settings=drive.settings).geofence
        self._navigator.geofence = recorded or drive.config.geofence

    def _sensor_decoder(self, epoch_ns: int) -> SensorDecoder:
        """Return a decoder of the sensors' messages that counts time from an epoch [ns]."""
        drive = self._drive
        decoder = drive.message_decoder(self._remarks)
        return SensorDecoder(epoch_ns, drive.cloud, decoder, drive.extrinsics)

    def _step(self, period: Period) -> None:
        """Send one control period through the navigator and compare the outcome."""
        if period.goal is not None:
            self._navigator.set_goal(period.goal)
        if self._viewer is not None:
            self._viewer.attend()
        self._period = period
        for part in period.earlier:
            self._navigator.update(part)
            self._compass.add(part, self._localizer.odometry)
        result = self._navigator.step(period.readings)
        for watch in self._watches[-1:]:
            watch(result)
        if self._observer is not None:
            self._observer.observe(period, result)
        self._mountings.check(self._localizer.odometry)
        self._compass.add(period.readings, self._localizer.odometry)
        self._statistics.add(self._localizer)
        if self._on_second is not None and self._comparison.periods % _PERIODS_PER_SECOND == 0:
            self._on_second()

    def _compare(self, result: StepResult) -> None:
        """Compare a step with the recorded period that was sent."""
        assert self._period is not None
        self._comparison.add(self._period, result)

    def _end_piece(self, setup: DriveSetup, decoder: SensorDecoder) -> None:
        """Add up the measurements that were refused in a piece."""
        self._statistics.end(self._localizer)
        add_fix_remarks(self._remarks, self._localizer, setup.refused)
        self._advise_on_compass()
        unplaced = self._assembler.refused if self._assembler else 0
        self._refused += decoder.refused + unplaced
        if unplaced:
            reason = "no pose is known at its stamp"
            self._remarks.refuse(self._drive.laser, reason, number=unplaced)

    def _advise_on_compass(self) -> None:
        """Note what is wrong with the compass and the step to take, once for all pieces."""
        mounting = self._mountings.rotation("compass")
        # A gyro that contradicts the wheels is no judge of a compass.
        is_gyro_wrong = any(text.startswith("imu:") for text in self._drive.extrinsics.failures)
        if mounting is None or is_gyro_wrong or self._has_compass_advice:
            return
        advice = self._compass.advice(self._drive.units.magnetic_field, mounting)
        if advice is not None:
            self._has_compass_advice = True
            self._remarks.note("compass", advice)

    def _result(self) -> dict[str, Any]:
        """Return the result of all pieces, ready for JSON."""
        drive, recorded = self._drive, self._drive.settings.get("models")
        datum = {"datum": None, "magnetic": None} if self._datum is None else self._datum.as_dict()
        data = self._comparison.as_dict() | {
            "controller": self._controller,
            "recorded_controller": drive.controller,
            "laser": drive.laser,
            "same_models": None if recorded is None else recorded == self._models.hashes,
            "health": self._statistics.health_after(self._remarks.has_failures),
            "complaints": dict(self._statistics.complaints),
            "counts": self._statistics.counts,
            "refused": self._refused,
            "faults": self._fault_response(),
            "refused_by_reason": self._remarks.refused_by_reason(),
            "pieces": [report.as_dict() for report in self._reports],
            "frames": self._mountings.frames,
            "remarks": self._remarks.as_dicts(),
            "remark_texts": self._remarks.texts,
            **datum,
        }
        sentences = left_out(data, drive.message_counts, drive.skipped_pieces)
        return data | {"left_out": [*sentences, *self._unreadable()]}

    def _fault_response(self) -> dict[str, Any] | None:
        """Return injected faults and the response to them, ready for JSON; None without faults.

        It is that of the first piece that went on beyond the onset, if any did.
        """
        if not self._watches:
            return None
        responses = [watch.response() for watch in self._watches]
        first = next((each for each in responses if each.was_faulty), responses[-1])
        return response_as_dict(self._drive.config.faults, first)

    def _unreadable(self) -> list[str]:
        """Return which messages of the sensors' topics could not be read, in words."""
        wanted = self._drive.sensor_topics
        return [str(lost) for lost in self._bag.left_out if lost.topic in wanted]
