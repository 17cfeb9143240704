"""The tree of coordinate frames that /tf_static and /tf publish."""

from array import array
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from andabata.records.bags import Bag
from andabata.records.frames import (
    BASES,
    FrameError,
    clean,
    is_base,
    is_world,
    local,
    prefix,
)
from andabata.records.topics import RosMessage

HOLD = 0.1
"""So long before the first transform of a moving frame and after its last, those hold [s]."""

_UNIT = 0.01
"""Largest error of a quaternion's length that rounding explains."""

_STILL = 1e-6
"""Transforms that differ by less say the same [m and rad]."""


@dataclass(frozen=True)
class Transform:
    """``T_a_b``: takes coordinates in b to coordinates in a, once or for n instants.

    Attributes:
        rotation: One, or n of them.
        translation: [m], float64, shape (3,) or (n, 3).
    """

    rotation: Rotation
    translation: NDArray[np.float64]

    @classmethod
    def identity(cls) -> "Transform":
        """Return the transform that changes nothing."""
        return cls(Rotation.identity(), np.zeros(3))

    @property
    def inverse(self) -> "Transform":
        """``T_b_a``."""
        turn = self.rotation.inv()
        return Transform(turn, -turn.apply(self.translation))

    def __matmul__(self, other: "Transform") -> "Transform":
        """Return ``T_a_c`` of ``T_a_b @ T_b_c``."""
        shift = self.translation + self.rotation.apply(other.translation)
        return Transform(self.rotation * other.rotation, shift)

    def apply(self, points: NDArray[np.floating]) -> NDArray[np.float64]:
        """Return points of b in a [m], shape (n, 3)."""
        return self.rotation.apply(points) + self.translation


@dataclass
class _Edge:
    """Transforms from a child to its parent, by time.

    Attributes:
        parent: Its name.
        static: Whether /tf_static tells.
        moves: Whether the transforms differ; those of old publishers of static ones come by /tf
            and do not.
        rows: Stamp [s], x, y, z [m], quaternion x, y, z, w of each, one after the other.
    """

    parent: str
    static: bool
    moves: bool = False
    rows: "array[float]" = field(default_factory=lambda: array("d"))
    _table: NDArray[np.float64] | None = None

    def add(self, stamp: float, numbers: list[float]) -> None:
        """Add x, y, z and the quaternion x, y, z, w at a time [s]; a static edge keeps the last."""
        if self.static:
            self.rows = array("d")
        elif self.rows and not self.moves:
            self.moves = _differ(self.rows[1:8], numbers)
        self.rows.extend([stamp, *numbers])
        self._table = None

    def forget(self, seconds: float) -> None:
        """Keep the latest rows, once they reach back twice as far."""
        newest = self.rows[-8]
        if newest - self.rows[0] > 2 * seconds:
            old = next(k for k in range(0, len(self.rows), 8) if newest - self.rows[k] <= seconds)
            self.rows = self.rows[old:]
            self._table = None

    @property
    def table(self) -> NDArray[np.float64]:
        """Rows of stamp, x, y, z, quaternion by growing stamps, shape (k, 8)."""
        if self._table is None:
            rows = np.array(self.rows).reshape(-1, 8)
            order = np.argsort(rows[:, 0], kind="stable")
            last = np.append(np.diff(rows[order, 0]) > 0, True)  # The later of equal stamps counts.
            self._table = rows[order][last]
        return self._table

    def at(self, stamps: NDArray[np.float64]) -> Transform:
        """Return the transforms at some instants [s], shape (n,), between the neighbours in time.

        Positions are interpolated linearly, rotations spherically.
        """
        table = self.table
        after = np.clip(np.searchsorted(table[:, 0], stamps), 1, len(table) - 1)
        one, two = table[after - 1], table[after]
        share = np.clip((stamps - one[:, 0]) / (two[:, 0] - one[:, 0]), 0.0, 1.0)[:, None]
        first, second = Rotation.from_quat(one[:, 4:]), Rotation.from_quat(two[:, 4:])
        turn = Rotation.from_rotvec((first.inv() * second).as_rotvec() * share)
        return Transform(first * turn, one[:, 1:4] + share * (two[:, 1:4] - one[:, 1:4]))


def _differ(one: Sequence[float], other: Sequence[float]) -> bool:
    """Return whether two transforms differ: x, y, z, quaternion, whose sign says nothing."""
    sign = 1.0 if sum(a * b for a, b in zip(one[3:], other[3:], strict=True)) > 0 else -1.0
    shift = max(abs(a - b) for a, b in zip(one[:3], other[:3], strict=True))
    turn = max(abs(a - sign * b) for a, b in zip(one[3:], other[3:], strict=True))
    return max(shift, turn) > _STILL


class TransformTree:
    """Frames by name, each with the transforms to its parent.

    What cannot be is kept out by name, and told when someone asks for a way through it: two
    parents, loops, quaternions that are none, numbers that are not finite.

    Attributes:
        version: Number of changes of what stands still, for those who keep what they looked up.
        conflicts: What was published twice and differs, in words.
    """

    def __init__(self) -> None:
        """Begin without frames."""
        self.version = 0
        self.conflicts: list[str] = []
        self._bad: dict[str, str] = {}
        self._edges: dict[str, _Edge] = {}
        self._faults: dict[str, str] = {}

    def add(self, transforms: Iterable[RosMessage], static: bool) -> None:
        """Take in the transforms of a TFMessage, from /tf_static or from /tf."""
        for each in transforms:
            child, parent = clean(each.child_frame_id), clean(each.header.frame_id)
            move, turn, stamp = (
                each.transform.translation,
                each.transform.rotation,
                each.header.stamp,
            )
            numbers = [move.x, move.y, move.z, turn.x, turn.y, turn.z, turn.w]
            seconds = int(stamp.sec) + int(stamp.nanosec) / 1e9
            self._put(parent, child, [float(n) for n in numbers], seconds, static)

    def _put(
        self, parent: str, child: str, numbers: list[float], seconds: float, static: bool
    ) -> None:
        """Take in one transform, or note why it cannot be."""
        what, length = f"the transform from {child} to {parent}", float(np.linalg.norm(numbers[3:]))
        if not np.isfinite(numbers).all():
            self._leave_out(child, f"{what}: expected finite numbers, got {numbers}")
            return
        if abs(length - 1) > _UNIT:
            self._leave_out(child, f"{what}: expected a quaternion of length 1, got {length:.3g}")
            return
        numbers[3:] = [part / length for part in numbers[3:]]
        known = self._edges.get(child)
        if known is not None and known.parent != parent:
            # Where the body is in the world is another matter than where its parts are.
            if is_world(parent) and is_base(child):
                return
            if not (is_world(known.parent) and is_base(child)):
                parents = f"{known.parent} and {parent}"
                self._faults[child] = f"{child}: expected one parent, got two: {parents}"
                self.version += 1
                return
            known = None
        if known is not None and known.static and static:
            if not _differ(known.rows[1:8], numbers):
                return
            self.conflicts.append(f"{what} was published twice and differs; the last is used")
        if known is None or (static and not known.static):
            known = self._edges[child] = _Edge(parent, static)
            self.version += 1
        elif known.static and not static:
            return
        elif static:
            self.version += 1
        moved = known.moves
        known.add(seconds, numbers)
        self.version += known.moves != moved

    def _leave_out(self, child: str, reason: str) -> None:
        """Note a transform that cannot be; the good ones of the same frame hold."""
        if child not in self._bad:
            self._bad[child] = reason
            self.version += 1

    def forget(self, seconds: float) -> None:
        """Forget the transforms of moving frames that are older than the newest by more [s].

        Twice as many are kept before, so that it costs little to call it often.
        """
        for edge in self._edges.values():
            if not edge.static:
                edge.forget(seconds)

    @property
    def names(self) -> tuple[str, ...]:
        """Frames that are known, sorted."""
        parents = {edge.parent for edge in self._edges.values()}
        return tuple(sorted(parents | set(self._edges)))

    def find(self, name: str) -> str | None:
        """Return the frame that is meant: the same name, or the only one but for a prefix."""
        name, known = clean(name), {*self.names, *self._bad}
        if name in known:
            return name
        alike = [other for other in known if local(other) == local(name)]
        return alike[0] if len(alike) == 1 else None

    def base_of(self, name: str) -> str | None:
        """Return the base that a frame is fixed to: ``base_footprint``, else ``base_link``.

        Args:
            name: A frame that ``find`` returned.

        Raises:
            FrameError: If the way up is faulty.
        """
        mine = self._way_up(name)
        found: list[tuple[int, int, str]] = []
        for other in self.names:
            way = self._root_way(other) if is_base(other) else None
            if way is not None and way[-1] == mine[-1]:
                foreign = bool(prefix(name)) and prefix(other) != prefix(name)
                found.append((foreign, len(set(mine) ^ set(way)), other))
        if not found:
            return None
        _, _, nearest = min(found)
        wanted = "/".join(part for part in (prefix(nearest), BASES[0]) if part)
        return wanted if wanted in {other for _, _, other in found} else nearest

    def _root_way(self, name: str) -> list[str] | None:
        """Return the way up of a frame, None where it is faulty."""
        try:
            return self._way_up(name)
        except FrameError:
            return None

    def _way_up(self, name: str) -> list[str]:
        """Return a frame, its parent, and so on to the root.

        Raises:
            FrameError: If one of them is faulty, or the way is a loop.
        """
        way = [name]
        while True:
            if way[-1] in self._faults:
                raise FrameError(f"/tf: {self._faults[way[-1]]}")
            edge = self._edges.get(way[-1])
            if edge is None and way[-1] in self._bad:
                raise FrameError(f"/tf: {self._bad[way[-1]]}")
            if edge is None:
                return way
            if edge.parent in way:
                loop = " -> ".join([*way[way.index(edge.parent) :], edge.parent])
                raise FrameError(f"/tf: expected a tree of frames, got a loop: {loop}")
            way.append(edge.parent)

    def _steps(self, name: str, base: str) -> tuple[list[str], list[str]]:
        """Return the children of the edges from a frame, and from its base, to where they meet."""
        mine, others = self._way_up(name), self._way_up(base)
        return [n for n in mine if n not in others], [n for n in others if n not in mine]

    def is_static(self, name: str, base: str) -> bool:
        """Return whether all transforms between two frames came by /tf_static."""
        up, down = self._steps(name, base)
        return all(self._edges[child].static for child in up + down)

    def moving(self, name: str, base: str) -> tuple[str, ...]:
        """Return the frames between two whose transforms change."""
        up, down = self._steps(name, base)
        return tuple(child for child in up + down if self._edges[child].moves)

    def joint(self, name: str, base: str) -> str:
        """Return the frame under the first that moves, on the way from a base to a frame."""
        up, _ = self._steps(name, base)
        moving = [child for child in up if self._edges[child].moves]
        return self._edges[moving[-1]].parent if moving else name

    def span(self, name: str, base: str) -> tuple[float, float]:
        """Return from when to when the transforms between two frames are known [s]."""
        rows = [self._edges[child].table[:, 0] for child in self.moving(name, base)]
        first = max((float(row[0]) for row in rows), default=-np.inf)
        return first, min((float(row[-1]) for row in rows), default=np.inf)

    def lookup(self, name: str, base: str, stamps: NDArray[np.float64] | None = None) -> Transform:
        """Return ``T_base_name``.

        Args:
            name: A frame that ``find`` returned.
            base: One that it is connected with.
            stamps: Instants [s], shape (n,); None where nothing moves.

        Raises:
            FrameError: If the way is faulty, or the transforms do not reach to the instants.
        """
        up, down = self._steps(name, base)
        if stamps is not None and len(stamps):
            first, last = self.span(name, base)
            if stamps.min() < first - HOLD or stamps.max() > last + HOLD:
                raise FrameError(
                    f"/tf: expected transforms from {name} to {base} at "
                    f"{stamps.min():.3f} to {stamps.max():.3f} s, got them from {first:.3f} to "
                    f"{last:.3f} s"
                )
        return self._climb(down, stamps).inverse @ self._climb(up, stamps)

    def _climb(self, children: list[str], stamps: NDArray[np.float64] | None) -> Transform:
        """Return the transform from the first child to the parent of the last."""
        found = Transform.identity()
        for child in children:
            edge = self._edges[child]
            if stamps is not None and edge.moves:
                found = edge.at(stamps) @ found
            else:
                row = edge.table[-1]
                found = Transform(Rotation.from_quat(row[4:]), row[1:4]) @ found
        return found


_KINDS = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage", "tf2_msgs/TFMessage", "tf/tfMessage")
"""Types of messages with transforms, as ROS 2 and ROS 1 write them."""


def read_transforms(bag: Bag) -> TransformTree:
    """Return the frames of a recording: all of its /tf_static and /tf, whenever they came.

    Every topic of their types counts, also in a robot's namespace (``/husky1/tf_static``).

    Raises:
        BagError: If the recording is damaged.
    """
    tree = TransformTree()
    names = tuple(
        name
        for name, (kind, _) in bag.topics.items()
        if kind in _KINDS or local(name) in ("tf", "tf_static")
    )
    for message in bag.messages(names) if names else ():
        if message.kind in _KINDS:
            tree.add(message.content.transforms, local(message.topic) == "tf_static")
    return tree
