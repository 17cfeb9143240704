"""The tree of coordinate frames that /tf_static and /tf publish."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from andabata.records.bags import Bag
from andabata.records.frames.names import (
    BASES,
    FrameError,
    is_base,
    is_world,
    local_name,
    namespace_of,
    strip_slashes,
)
from andabata.records.frames.sources import FrameSource, FrameSources, returning_text
from andabata.records.frames.transform import Transform, TransformHistory, differ
from andabata.records.topics import RosMessage

EXTRAPOLATION = 0.1
"""Time before the first and after the last transform for which these still hold [s]."""

_MIN_RETURNS = 5
"""Number of transforms that jump back from which a frame has two publishers."""

_RETURN_SHARE = 0.1
"""The same as a share of its transforms."""

_UNIT_LENGTH_ERROR = 0.01
"""Largest error of a quaternion's length that rounding explains."""


class TransformTree:
    """Frames by name, each with the transforms to its parent.

    Impossible transforms are left out by name, and reported when a path through them is looked up:
    two parents, two poses, loops, quaternions of another length, numbers that are not finite.

    Attributes:
        version: Number of changes of static parts, for callers that cache look-ups.
    """

    def __init__(self) -> None:
        """Create a tree without frames."""
        self.version = 0
        self._sources = FrameSources()
        self._invalid: dict[str, str] = {}
        self._histories: dict[str, TransformHistory] = {}
        self._faults: dict[str, str] = {}

    @property
    def remarks(self) -> list[str]:
        """Remarks on frames with several sources and on ignored transforms, a line each."""
        return self._sources.remarks

    def add(self, transforms: Iterable[RosMessage], static: bool, node: str = "") -> None:
        """Add the transforms of a TFMessage.

        Args:
            transforms: Its TransformStamped.
            static: True if it came by /tf_static.
            node: Name of the publishing node; empty if it is unknown.
        """
        for each in transforms:
            child = strip_slashes(each.child_frame_id)
            parent = strip_slashes(each.header.frame_id)
            position, quaternion = each.transform.translation, each.transform.rotation
            stamp = each.header.stamp
            numbers = [position.x, position.y, position.z]
            numbers += [quaternion.x, quaternion.y, quaternion.z, quaternion.w]
            seconds = int(stamp.sec) + int(stamp.nanosec) / 1e9
            source = FrameSource("/tf_static" if static else "/tf", node)
            self._add_one(parent, child, seconds, [float(n) for n in numbers], source)

    def _add_one(
        self, parent: str, child: str, seconds: float, numbers: list[float], source: FrameSource
    ) -> None:
        """Add one transform, or note why it is impossible."""
        if parent == child:  # As tf2 does.
            self._sources.ignore_self(child)
            return
        label, length = (
            f"the transform from {child} to {parent}",
            float(np.linalg.norm(numbers[3:])),
        )
        if not np.isfinite(numbers).all():
            self._note_invalid(child, f"{label}: expected finite numbers, got {numbers}")
            return
        if abs(length - 1) > _UNIT_LENGTH_ERROR:
            text = f"{label}: expected a quaternion of length 1, got {length:.3g}"
            self._note_invalid(child, text)
            return
        numbers[3:] = [part / length for part in numbers[3:]]
        history = self._histories.get(child)
        if history is not None and history.parent != parent:
            # The robot's pose in the world is no second parent of its body.
            if is_world(parent) and is_base(child):
                return
            if not (is_world(history.parent) and is_base(child)):
                parents = f"{history.parent} and {parent}"
                self._note_fault(child, f"expected one parent, got two: {parents}")
                return
            history = None
        if not is_world(parent):
            self._note_fault(child, self._sources.add(parent, child, source, numbers))
        static = source.is_static
        is_repeated = history is not None and history.static and static
        if is_repeated and history is not None and not differ(history.first, numbers):
            return
        self._extend(history, parent, child, seconds, numbers, static)

    def _note_fault(self, child: str, fault: str | None) -> None:
        """Note why a frame has no pose, the first reason alone."""
        if fault is not None and child not in self._faults:
            self._faults[child] = f"{child}: {fault}"
            self.version += 1

    def _extend(
        self,
        history: TransformHistory | None,
        parent: str,
        child: str,
        seconds: float,
        numbers: list[float],
        static: bool,
    ) -> None:
        """Add a valid transform to its history, or to a new one; /tf_static outranks /tf."""
        if history is None or (static and not history.static):
            history = self._histories[child] = TransformHistory(parent, static)
            self.version += 1
        elif history.static and not static:
            return
        elif static:
            self.version += differ(history.last, numbers)
        moved = history.moves
        history.add(seconds, numbers)
        self.version += history.moves != moved
        if history.returns >= _MIN_RETURNS and history.returns > _RETURN_SHARE * history.count:
            self._note_fault(child, returning_text(parent, history.last, history.before_last))

    def _note_invalid(self, child: str, reason: str) -> None:
        """Note an impossible transform; valid ones of the same frame still hold."""
        if child not in self._invalid:
            self._invalid[child] = reason
            self.version += 1

    def prune(self, seconds: float) -> None:
        """Drop the transforms of moving frames that are older than the newest by more [s].

        Twice as many are kept before, so that frequent calls cost little.
        """
        for history in self._histories.values():
            if not history.static:
                history.prune(seconds)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the known frames, sorted."""
        parents = {history.parent for history in self._histories.values()}
        return tuple(sorted(parents | set(self._histories)))

    def find(self, name: str) -> str | None:
        """Return the frame of that name, else the only one that differs by its namespace alone."""
        name, known = strip_slashes(name), {*self.names, *self._invalid}
        if name in known:
            return name
        alike = [other for other in known if local_name(other) == local_name(name)]
        return alike[0] if len(alike) == 1 else None

    def base_of(self, name: str) -> str | None:
        """Return the base that a frame is connected with: ``base_footprint``, else ``base_link``.

        Args:
            name: Name of a frame as ``find`` returns it.

        Raises:
            FrameError: If the path to the root is faulty.
        """
        path = self._path_to_root(name)
        candidates: list[tuple[int, int, str]] = []
        for other in self.names:
            way = self._valid_path_to_root(other) if is_base(other) else None
            if way is not None and way[-1] == path[-1]:
                foreign = bool(namespace_of(name)) and namespace_of(other) != namespace_of(name)
                candidates.append((foreign, len(set(path) ^ set(way)), other))
        if not candidates:
            return None
        _, _, nearest = min(candidates)
        preferred = "/".join(part for part in (namespace_of(nearest), BASES[0]) if part)
        return preferred if preferred in {other for _, _, other in candidates} else nearest

    def _valid_path_to_root(self, name: str) -> list[str] | None:
        """Return the path of a frame to the root, None where it is faulty."""
        try:
            return self._path_to_root(name)
        except FrameError:
            return None

    def _path_to_root(self, name: str) -> list[str]:
        """Return a frame, its parent, and so on to the root.

        Raises:
            FrameError: If one of them is faulty, or the path is a loop.
        """
        path = [name]
        while True:
            if path[-1] in self._faults:
                raise FrameError(f"/tf: {self._faults[path[-1]]}")
            history = self._histories.get(path[-1])
            if history is None and path[-1] in self._invalid:
                raise FrameError(f"/tf: {self._invalid[path[-1]]}")
            if history is None:
                return path
            if history.parent in path:
                loop = " -> ".join([*path[path.index(history.parent) :], history.parent])
                raise FrameError(f"/tf: expected a tree of frames, got a loop: {loop}")
            path.append(history.parent)

    def _branches(self, name: str, base: str) -> tuple[list[str], list[str]]:
        """Return the frames from ``name``, and from ``base``, below their common ancestor."""
        path, base_path = self._path_to_root(name), self._path_to_root(base)
        up = [frame for frame in path if frame not in base_path]
        return up, [frame for frame in base_path if frame not in path]

    def is_static(self, name: str, base: str) -> bool:
        """Return whether all transforms between two frames came by /tf_static."""
        up, down = self._branches(name, base)
        return all(self._histories[child].static for child in up + down)

    def moving(self, name: str, base: str) -> tuple[str, ...]:
        """Return the frames between two whose transforms change."""
        up, down = self._branches(name, base)
        return tuple(child for child in up + down if self._histories[child].moves)

    def joint_parent(self, name: str, base: str) -> str:
        """Return the parent of the moving frame nearest to the base, ``name`` if none moves."""
        up, _ = self._branches(name, base)
        moving = [child for child in up if self._histories[child].moves]
        return self._histories[moving[-1]].parent if moving else name

    def time_span(self, name: str, base: str) -> tuple[float, float]:
        """Return the first and the last time at which the transforms between two are known [s]."""
        tables = [self._histories[child].table[:, 0] for child in self.moving(name, base)]
        first = max((float(stamps[0]) for stamps in tables), default=-np.inf)
        return first, min((float(stamps[-1]) for stamps in tables), default=np.inf)

    def lookup(self, name: str, base: str, stamps: NDArray[np.float64] | None = None) -> Transform:
        """Return ``T_base_name``.

        Args:
            name: Name of a frame as ``find`` returns it.
            base: Name of a frame that it is connected with.
            stamps: Instants [s], shape (n,); None where nothing moves.

        Raises:
            FrameError: If the path is faulty, or the transforms do not cover the instants.
        """
        up, down = self._branches(name, base)
        if stamps is not None and len(stamps):
            first, last = self.time_span(name, base)
            if stamps.min() < first - EXTRAPOLATION or stamps.max() > last + EXTRAPOLATION:
                raise FrameError(
                    f"/tf: expected transforms from {name} to {base} at "
                    f"{stamps.min():.3f} to {stamps.max():.3f} s, got them from {first:.3f} to "
                    f"{last:.3f} s"
                )
        return self._chain(down, stamps).inverse @ self._chain(up, stamps)

    def _chain(self, children: list[str], stamps: NDArray[np.float64] | None) -> Transform:
        """Return the transform from the first child to the parent of the last."""
        transform = Transform.identity()
        for child in children:
            history = self._histories[child]
            step = history.latest() if stamps is None or not history.moves else history.at(stamps)
            transform = step @ transform
        return transform


_TF_TYPES = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage", "tf2_msgs/TFMessage", "tf/tfMessage")
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
        if kind in _TF_TYPES or local_name(name) in ("tf", "tf_static")
    )
    for message in bag.messages(names) if names else ():
        if message.kind in _TF_TYPES:
            static = local_name(message.topic) == "tf_static"
            tree.add(message.content.transforms, static, message.publisher)
    return tree
