"""User's choices for a replay."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.models import Models
from andabata.records.frames.sensor_pose import GivenMounting


def keep_recorded(recorded: SimulatedRobotConfig) -> SimulatedRobotConfig:
    """Return the recorded configuration unchanged."""
    return recorded


@dataclass(frozen=True)
class ReplayOptions:
    """User's choices for a replay; the defaults are those of the recording.

    Attributes:
        controller: Name of the controller; None for the recorded one.
        models: Classifiers and policy; None for the shipped ones.
        cloud: Topic of a 3D laser that replaces the rotating laser's two; None for those two, or,
            where they are missing, for the only cloud in the laser's or the base's frame.
        configure: Function that takes the recorded configuration, or the defaults, and returns the
            one to use.
        topics: Names of the recording's topics by ours, where they differ.
        mountings: Mounting of each sensor by its name; takes precedence over frames and /tf.
        units: Unit of each quantity, where it differs from the one that magnitudes suggest.
        sources: Frame, node or joints of the only source that is read, by our names of topics.
        time_offsets: Times that are added to the stamps of topics, by our names [s].
    """

    controller: str | None = None
    models: Models | None = None
    cloud: str | None = None
    configure: Callable[[SimulatedRobotConfig], SimulatedRobotConfig] = keep_recorded
    topics: Mapping[str, str] = field(default_factory=dict)
    mountings: Mapping[str, GivenMounting] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    sources: Mapping[str, str] = field(default_factory=dict)
    time_offsets: Mapping[str, float] = field(default_factory=dict)
