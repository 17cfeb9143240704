"""Where each sense of a recording or of a live graph sits, and its measurements turned so."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from andabata.records.frames import (
    BASES,
    OWN_FRAMES,
    SENSES,
    FrameError,
    Sense,
    clean,
    is_base,
    is_world,
    local,
    prefix,
    rotation_by_name,
)
from andabata.records.mounting_checks import GroundCheck, MountingChecks
from andabata.records.transform_tree import HOLD, Transform, TransformTree
from traversability.cloud import PointCloud

Source = Literal["tf_static", "tf", "option", "name", "assumed"]

_APART = 0.05
"""Mountings that differ by more contradict each other [m, rad]."""

BARE = ""
"""Key of the mounting that is told without a sense: a laser's in a frame of its own."""


class PendingTransformError(FrameError):
    """Transforms that are not published yet."""


@dataclass(frozen=True)
class GivenMounting:
    """Mounting that the user tells.

    Attributes:
        x: Forward of the base [m].
        y: Left of the base [m].
        z: Above the ground [m]; None for a laser at ``robot.lidar_height``.
        rotation: From the sensor to the base.
    """

    x: float
    y: float
    z: float | None
    rotation: Rotation


@dataclass(frozen=True)
class Mount:
    """Where a sense sits.

    Attributes:
        frame: Frame of its messages.
        source: What tells.
        origin: Frame that ``transform`` leads to: ``sensor`` (level at ``robot.lidar_height``),
            ``base_link`` (fixed to the body, on the ground) or ``base_footprint`` (levelled).
        transform: From ``frame`` to ``origin``, where nothing moves.
        moving: Names of the frame and of its base in the tree, where the frame moves against it.
        lift: Height of that base above the ground [m].
    """

    frame: str
    source: Source
    origin: Literal["sensor", "base_link", "base_footprint"]
    transform: Transform
    moving: tuple[str, str] | None = None
    lift: float = 0.0

    @property
    def is_identity(self) -> bool:
        """Whether it changes nothing, to the bit."""
        still = self.moving is None and not self.transform.translation.any()
        return still and self.transform.rotation.magnitude() == 0.0

    def as_dict(self, lidar_height: float) -> dict[str, Any]:
        """Return frame, transform to the base (x, y, z [m], roll, pitch, yaw [rad]) and source."""
        x, y, z = self.transform.translation.tolist()
        up = lidar_height if self.origin == "sensor" else 0.0
        yaw, pitch, roll = yaw_pitch_roll(self.transform.rotation)
        numbers = [round(number, 6) for number in (x, y, z + up, roll, pitch, yaw)]
        return {
            "frame": self.frame,
            "transform": None if self.moving else numbers,
            "source": self.source,
        }


class Mounts:
    """Looks up where senses sit, and brings what they measured into the robot's axes.

    The accelerometer's lever arm is neglected: at half a radian a second a metre of it feels
    0.25 m/s2, a third of what the filter takes for shaking.

    Attributes:
        tree: Frames of the recording or of the graph.
        checks: What gravity, the magnetic field and the wheels say of the mountings.
    """

    def __init__(
        self,
        given: Mapping[str, GivenMounting] | None = None,
        tree: TransformTree | None = None,
    ) -> None:
        """Begin without a message.

        Args:
            given: What the user tells, by sense, or ``BARE``.
            tree: Frames; None for none.
        """
        self.tree = tree or TransformTree()
        self.checks = MountingChecks()
        self._given = dict(given or {})
        self._known: dict[tuple[Sense, str], Mount] = {}
        self._version = self.tree.version
        self._used: dict[Sense, Mount] = {}
        self._refusals: dict[str, None] = {}

    def mount(self, sense: Sense, frame: str) -> Mount:
        """Return where a sense sits by the frame of its messages.

        Raises:
            FrameError: If that can't be known.
        """
        if self._version != self.tree.version:
            self._known.clear()
            self.checks = MountingChecks()  # What was measured was turned otherwise.
            self._version = self.tree.version
        key = sense, clean(frame)
        if key not in self._known:
            try:
                self._known[key] = self._resolve(*key)
            except FrameError as error:
                self.leave_out(sense, error)
                raise
        self._used[sense] = self._known[key]
        return self._known[key]

    def _resolve(self, sense: Sense, frame: str) -> Mount:
        """Return where a sense sits, after the table of ``andabata.records.frames``."""
        given = self._given.get(sense)
        if given is None and sense == "laser" and not is_base(frame):
            given = self._given.get(BARE)
        if given is not None:
            return _told(sense, frame, given)
        found = self.tree.find(frame)
        mount = None if found is None else self._by_tree(sense, frame, found)
        if mount is not None:
            return mount
        if is_base(frame):
            return Mount(frame, "name", "base_link", Transform.identity())
        if is_world(frame):
            raise FrameError(
                f"frame {frame}: expected a frame of the robot, or /tf from it to base_link, got "
                "one that is fixed to the world"
            )
        origin: Literal["sensor", "base_link"] = "sensor" if sense == "laser" else "base_link"
        named = rotation_by_name(frame)
        if named is not None:
            return Mount(frame, "name", origin, Transform(named[0], np.zeros(3)))
        return Mount(frame, "assumed", origin, Transform.identity())

    def _by_tree(self, sense: Sense, frame: str, found: str) -> Mount | None:
        """Return where the tree puts a frame, None where it is connected with no base."""
        tree = self.tree
        base = tree.base_of(found)
        if base is None:
            return None
        levelled = False
        lift = 0.0
        if local(base) == BASES[0]:
            link = "/".join(part for part in (prefix(base), BASES[1]) if part)
            if link in tree.names and tree.base_of(link) == base and tree.moving(link, base):
                # A base_footprint that turns against the body is levelled, as REP-120 has it.
                levelled, lift = found == base, float(tree.lookup(link, base).translation[2])
                base = found if levelled else link
        source: Source = "tf_static" if tree.is_static(found, base) else "tf"
        if found == base and local(base) != BASES[0]:
            source = "name" if lift == 0.0 else "tf"
        elif found == base:
            source = "name"
        if levelled:
            return Mount(frame, "tf", "base_footprint", Transform.identity())
        if tree.moving(found, base):
            if sense != "laser":
                raise FrameError(
                    f"frame {frame}: expected one that is fixed to {base}, got one that /tf moves"
                )
            return Mount(frame, source, "base_link", Transform.identity(), (found, base), lift)
        place = tree.lookup(found, base)
        up = np.array([0.0, 0.0, lift])
        return Mount(frame, source, "base_link", replace(place, translation=place.translation + up))

    def cloud(self, cloud: PointCloud, clock: float) -> PointCloud:
        """Return a laser's cloud in ``sensor``, ``base_link`` or ``base_footprint``.

        Args:
            cloud: In the frame of its message; with times where that frame moves.
            clock: Time of the transforms less that of the cloud's times [s].

        Raises:
            FrameError: If the frame's place can't be known.
            PendingTransformError: If it will be.
        """
        mount = self.mount("laser", cloud.frame)
        if mount.is_identity:
            return replace(cloud, frame=mount.origin)
        place = mount.transform
        if mount.moving is not None and len(cloud):
            stamps = np.zeros(len(cloud)) if cloud.stamps is None else cloud.stamps
            place = self._at(mount.moving, stamps + clock)
            lift = np.array([0.0, 0.0, mount.lift])
            place = replace(place, translation=place.translation + lift)
        points = place.apply(cloud.points).astype(np.float32)
        return replace(cloud, points=points, frame=mount.origin)

    def _at(self, moving: tuple[str, str], stamps: NDArray[np.float64]) -> Transform:
        """Return the transforms of a moving frame at some instants [s], shape (n,)."""
        if stamps.max() > self.tree.span(*moving)[1] + HOLD:
            raise PendingTransformError(
                f"/tf: expected transforms from {moving[0]} to {moving[1]} until "
                f"{stamps.max():.3f} s, got them until {self.tree.span(*moving)[1]:.3f} s"
            )
        return self.tree.lookup(*moving, stamps)

    def row(self, sense: Sense, frame: str, numbers: Sequence[float]) -> list[float]:
        """Return a measurement in the robot's axes.

        Args:
            sense: ``imu`` with angular velocity and specific force, ``compass`` with flux
                density, or ``gnss``, whose place ``antenna`` tells.
            frame: Of its message.
            numbers: What it measured; three or more.

        Raises:
            FrameError: If the frame's place can't be known.
        """
        mount, found = self.mount(sense, frame), list(numbers)
        if sense != "gnss" and mount.transform.rotation.magnitude() != 0.0:
            for k in range(0, len(found) - 2, 3):
                found[k : k + 3] = mount.transform.rotation.apply(found[k : k + 3]).tolist()
        self.checks.take(sense, found)
        return found

    @property
    def antenna(self) -> NDArray[np.float64] | None:
        """Place of the satellite antenna in the base frame [m], shape (3,); None for its origin."""
        mount = self._used.get("gnss")
        if mount is None or not mount.transform.translation.any():
            return None
        return mount.transform.translation

    def head(self, frame: str) -> tuple[NDArray[np.float64] | None, str]:
        """Return where the turning laser's head sits: its pose, and the frame of that.

        Args:
            frame: Of its sweeps, whose angles are those of the head's own plane.

        Returns:
            x, y, z [m], quaternion x, y, z, w in the frame; None level at the laser's height.

        Raises:
            FrameError: If the frame's place can't be known.
        """
        if is_base(frame):  # Where ranges are measured from is not said.
            frame = OWN_FRAMES[1]
        mount = self.mount("laser", frame)
        if mount.is_identity or mount.source == "name":
            return None, "sensor"
        place = mount.transform
        if mount.moving is not None:  # Its turn is what /head_angle tells.
            place = self.tree.lookup(self.tree.joint(*mount.moving), mount.moving[1])
            lift = np.array([0.0, 0.0, mount.lift])
            place = replace(place, translation=place.translation + lift)
        return np.concatenate([place.translation, place.rotation.as_quat()]), mount.origin

    def ground_check(self, lidar_height: float) -> GroundCheck:
        """Return a check of the ground that the laser sees.

        Args:
            lidar_height: Of a laser whose place nothing tells [m].
        """
        mount = self._used.get("laser")
        if mount is None or mount.origin == "sensor":
            return GroundCheck(lidar_height)
        height = float(mount.transform.translation[2])
        where = {"option": "--mounting", "name": f"frame {mount.frame}"}.get(
            mount.source, f"/{mount.source}"
        )
        known = height > 0
        return GroundCheck(height if known else lidar_height, where, known)

    @property
    def is_settled(self) -> bool:
        """Whether laser, IMU and compass have spoken and no transform of theirs is missing."""
        readings: tuple[Sense, ...] = ("laser", "imu", "compass")
        for sense in readings:
            mount = self._used.get(sense)
            if mount is None:
                return False
            mount = self.mount(sense, mount.frame)  # Transforms may have come since.
            named = mount.source == "name" and not is_base(mount.frame)
            own = local(mount.frame) in OWN_FRAMES
            if named or (mount.source == "assumed" and not own):
                return False
        return True

    def leave_out(self, sense: Sense, error: ValueError) -> None:
        """Note why a measurement is left out, the first of each sense."""
        if not any(text.startswith(f"{sense}: ") for text in self._refusals):
            self._refusals[f"{sense}: {error}"] = None

    def verify(self) -> None:
        """Refuse a mounting that gravity contradicts.

        Raises:
            FrameError: If it does; the message names the option to give.
        """
        mount = self._used.get("imu")
        if mount is not None:
            self.checks.verify_gravity(mount.frame, mount.source, mount.transform.rotation)

    def as_dict(self, lidar_height: float) -> dict[str, Any]:
        """Return where the senses sit that spoke, ready for JSON; see ``Mount.as_dict``."""
        return {
            sense: self._used[sense].as_dict(lidar_height)
            for sense in SENSES
            if sense in self._used
        }

    @property
    def remarks(self) -> list[str]:
        """What a person should know of the mountings, a line each."""
        found = list(self._refusals)
        found += [f"/tf: {text}" for text in self.tree.conflicts]
        for sense, mount in self._used.items():
            found += _doubts(sense, mount, self.tree)
            found += self._contradictions(sense, mount)
        return found + self.checks.remarks

    def _contradictions(self, sense: Sense, mount: Mount) -> list[str]:
        """Return whether the tree says otherwise than the user."""
        name = self.tree.find(mount.frame)
        if mount.source != "option" or name is None:
            return []
        try:
            other = self._by_tree(sense, mount.frame, name)
        except FrameError:
            return []
        if other is None or other.moving or other.source == "name":
            return []
        apart = mount.transform.inverse @ other.transform
        shift = apart.translation[: 2 if mount.origin == "sensor" else 3]
        if np.linalg.norm(shift) < _APART and apart.rotation.magnitude() < _APART:
            return []
        place = ",".join(f"{number:.3g}" for number in _numbers(other.transform))
        return [f"{sense}: --mounting is used; /{other.source} puts frame {mount.frame} at {place}"]


def _told(sense: Sense, frame: str, given: GivenMounting) -> Mount:
    """Return a mount as the user tells it."""
    shift = np.array([given.x, given.y, given.z or 0.0])
    relative = sense == "laser" and given.z is None
    place = Transform(given.rotation, shift)
    return Mount(frame, "option", "sensor" if relative else "base_link", place)


def _doubts(sense: Sense, mount: Mount, tree: TransformTree) -> list[str]:
    """Return what is taken for granted of a mount."""
    option = f"--mounting {sense}=X,Y,Z,ROLL,PITCH,YAW"
    if mount.source == "name" and not is_base(mount.frame):
        named = rotation_by_name(mount.frame)
        why = named[1] if named else "its name"
        return [f"{sense}: no transform to frame {mount.frame}; turned as its name says ({why})"]
    if mount.source != "assumed" or mount.frame in OWN_FRAMES:
        return []
    known = "" if not tree.names else f"; /tf knows {', '.join(tree.names[:8])}"
    taken = {
        "laser": "level at robot.lidar_height, x forward",
        "gnss": "over the middle of the robot",
    }.get(sense, "along the robot's axes")
    return [f"{sense}: nothing tells where frame {mount.frame} is; taken {taken} ({option}){known}"]


def _numbers(place: Transform) -> list[float]:
    """Return x, y, z [m], roll, pitch and yaw [deg], as ``--mounting`` takes them."""
    return [*place.translation.tolist(), *np.rad2deg(yaw_pitch_roll(place.rotation)[::-1]).tolist()]


def yaw_pitch_roll(rotation: Rotation) -> list[float]:
    """Return yaw, pitch and roll [rad]; upright, where they are not unique, roll is 0."""
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        angles: list[float] = rotation.as_euler("ZYX").tolist()
    return angles
