"""Facts about a recording that a replay needs before it begins: topics, frames, units, pieces."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationError

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.configuration.settings import explain
from andabata.machine.proprioception import MICROTESLA
from andabata.machine.robot import RobotModel
from andabata.records.bag_survey import survey_bag
from andabata.records.bags import Bag, BagError
from andabata.records.decoding.message_decoder import MessageDecoder
from andabata.records.decoding.sensor_decoder import SensorDecoder
from andabata.records.decoding.unit_inference import infer_units
from andabata.records.decoding.units import UnitError, UnitFactors, si_factor
from andabata.records.decoding.wheel_speeds import JointFacts
from andabata.records.frames.extrinsics import Extrinsics
from andabata.records.frames.transform_tree import read_transforms
from andabata.records.pieces import Piece
from andabata.records.remarks import Remarks
from andabata.records.topic_selection import (
    check_frames,
    choose_cloud,
    choose_sources,
    select_topics,
)
from andabata.records.topics import SCAN, Topic
from andabata.replay.datum import given_geo_reference, magnetic_flux_density
from andabata.replay.options import ReplayOptions


@dataclass(frozen=True)
class RecordedDrive:
    """Recorded drive, inspected and not yet replayed.

    Attributes:
        cloud: Topic of a 3D laser; None for the rotating laser's two.
        topics: Names of the recording's topics by ours, where they differ.
        extrinsics: Mounting of each sensor.
        settings: Recorded settings of the drive; empty in recordings of other recorders.
        config: Configuration of the robot: the recorded one with the user's changes.
        given: Fields of ``GeoReference`` that the user gives.
        units: Units of the sensors' quantities.
        joints: Facts about the joint states.
        pieces: Stretches of the recording over which its clocks run evenly.
        skipped_pieces: Number of stretches that are too short or mixed with others.
        message_counts: Number of messages by our topics.
    """

    cloud: Topic | None
    topics: Mapping[str, str]
    extrinsics: Extrinsics
    settings: dict[str, Any]
    config: SimulatedRobotConfig
    given: dict[str, float]
    units: UnitFactors
    joints: JointFacts
    pieces: list[Piece]
    skipped_pieces: int
    message_counts: Mapping[str, int]

    @property
    def laser(self) -> str:
        """Name of the topic that the clouds are made of."""
        return self.cloud.ros1 if self.cloud else SCAN.ros1

    @property
    def controller(self) -> str | None:
        """Name of the recorded controller; None where none is recorded."""
        return self.settings.get("controller")

    @property
    def sensor_topics(self) -> set[str]:
        """Names of all topics that may hold the sensors' messages."""
        wanted = SensorDecoder(0, self.cloud).wanted
        return {name for t in wanted for name in (t.ros1, t.ros2)} | set(self.topics.values())

    def message_decoder(self, remarks: Remarks | None = None) -> MessageDecoder:
        """Return a new decoder of messages in the units of the recording."""
        return MessageDecoder(self.config.robot, self.units, remarks, joints=self.joints)


def inspect_drive(bag: Bag, options: ReplayOptions, remarks: Remarks) -> RecordedDrive:
    """Return what a replay needs to know of a recording.

    Args:
        bag: The recording, open.
        options: User's choices.
        remarks: Remarks of the replay, extended.

    Raises:
        BagError: If the recording lacks a sensor that the robot needs.
        FrameError: If the mounting of a sensor is unknown.
        DatumError: If the fixes lie far from the datum that is given.
        ValueError: If there is no such quantity or unit.
    """
    cloud = choose_cloud(bag, options.cloud)
    decoder = SensorDecoder(0, cloud, MessageDecoder(remarks=remarks))
    topics = select_topics(bag, decoder, options.topics)
    choose_sources(bag, options.sources, topics, remarks)
    extrinsics = Extrinsics(options.mountings, read_transforms(bag))
    check_frames(bag, SensorDecoder(0, cloud, extrinsics=extrinsics), topics)
    robot = options.configure(SimulatedRobotConfig()).robot
    survey = survey_bag(bag, cloud, topics, MessageDecoder(robot, UnitFactors(), remarks))
    config = options.configure(_recorded_config(bag, survey.settings))
    factors = _factors(options.units, config.robot)
    given = given_geo_reference(options.configure)
    flux = magnetic_flux_density(bag, given, topics, config) * MICROTESLA
    try:
        units = infer_units(survey.history, config.robot, factors, remarks, flux)
    except UnitError as error:
        raise UnitError(error.topic, error.reason + survey.choice_of_source(error.topic)) from error
    pieces, skipped = survey.pieces(remarks, options.time_offsets)
    return RecordedDrive(
        cloud=cloud,
        topics=topics,
        extrinsics=extrinsics,
        settings=survey.settings,
        config=config,
        given=given,
        units=units,
        joints=survey.joints,
        pieces=pieces,
        skipped_pieces=skipped,
        message_counts=survey.messages,
    )


def _recorded_config(bag: Bag, settings: Mapping[str, Any]) -> SimulatedRobotConfig:
    """Return the configuration that a recording holds, the default one without any.

    Raises:
        BagError: If it is none of this version.
    """
    try:
        recorded = SimulatedRobotConfig.model_validate(settings.get("simulated_robot", {}))
    except ValidationError as error:
        raise BagError(
            f"{bag.path}: expected settings of this version in the diagnostics, got "
            f"simulated_robot.{explain(error)}; record it again, replay it with the version that "
            "recorded it, or replay a copy without this topic, with --controller and --set"
        ) from error
    # The recorded readings have these faults already.
    return recorded.model_copy(update={"faults": ()})


def _factors(units: Mapping[str, str], robot: RobotModel) -> dict[str, float]:
    """Return the factors to SI of the units that the user gives.

    Raises:
        ValueError: If there is no such quantity or unit.
    """
    return {quantity: si_factor(quantity, unit, robot) for quantity, unit in units.items()}
