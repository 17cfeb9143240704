"""Named frames of a world or model, and the poses between them (SDF's pose frame semantics).

Links, joints, nested models and ``<frame>`` elements name frames. A pose stands in the frame that
its ``relative_to`` names, else in that of what it is part of. Up to version 1.6 a pose has an
attribute ``frame`` instead, which never had a meaning and is ignored.
"""

from dataclasses import dataclass, field

from worlds.sdf.elements import Element
from worlds.sdf.notes import Notes
from worlds.sdf.values import IDENTITY, Pose, inverse, pose_of

_MAX_CHAIN = 100
"""Largest number of frames that are each given in the next one."""


@dataclass(frozen=True)
class Entry:
    """A named frame of a scope.

    Attributes:
        element: Element that makes it.
        pose: Pose element, None for no pose.
        base: Name of the frame in which the pose stands unless it says otherwise.
        nested: Scope of a nested model, None for other frames.
        placed: Name of the frame of the nested model that the pose is that of.
    """

    element: Element
    pose: Element | None
    base: str = ""
    nested: "Scope | None" = None
    placed: str = ""


@dataclass(eq=False)
class Scope:
    """Frames of one world or model, each found when it is asked for.

    Attributes:
        element: Element of the world or model.
        name: Name.
        notes: Warnings, to which this adds.
        entries: Frames by name.
        models: Nested models in order, those of one name too.
        merged: Names of nested models whose frames count as this scope's own.
        fixed: True if the model is static.
    """

    element: Element
    name: str
    notes: Notes
    entries: dict[str, Entry] = field(default_factory=dict)
    models: list[Entry] = field(default_factory=list)
    merged: list[str] = field(default_factory=list)
    fixed: bool = False
    _known: dict[str, Pose] = field(default_factory=dict)
    _open: list[str] = field(default_factory=list)

    def add(self, name: str, entry: Entry) -> None:
        """Take a frame; of several of one name the first one counts."""
        if name in self.entries:
            text = "a name is used twice in one model: poses relative to it mean the first one"
            self.notes.add(text, entry.element)
            return
        self.entries[name] = entry

    def pose(self, pose: Element | None, base: str = "") -> Pose:
        """Return a pose in this scope's own frame.

        Args:
            pose: Pose element, None for no pose.
            base: Name of the frame in which it stands unless it says otherwise.

        Raises:
            SdfError: If it is no pose, or stands in a frame that is not known.
        """
        if pose is None:
            return self.frame(base, self.element)
        if pose.attributes.get("frame"):
            self.notes.add("the attribute frame of a pose has no meaning and was ignored", pose)
        asked = pose.attributes.get("relative_to") or base
        around, own = self.frame(asked, pose), pose_of(pose)
        return own if around is IDENTITY else around @ own

    def frame(self, name: str, asked: Element) -> Pose:
        """Return the pose of a frame in this scope's own frame.

        Args:
            name: Name, with those of nested models before it as ``a::b``.
            asked: Element that names it, for errors.

        Raises:
            SdfError: If there is no such frame, or it is given in itself.
        """
        if name in ("", "world" if self.element.tag == "world" else "__model__"):
            return IDENTITY
        if name not in self._known:
            if name in self._open:
                around = " in ".join([*self._open[self._open.index(name) :], name])
                asked.fail(f"expected frames that are not given in each other, got {around}")
            if len(self._open) >= _MAX_CHAIN:
                asked.fail(f"expected at most {_MAX_CHAIN} frames in a row, got more")
            self._open.append(name)
            self._known[name] = self._found(name, asked)
            self._open.pop()
        return self._known[name]

    def nested_pose(self, entry: Entry) -> Pose:
        """Return the pose of a frame or nested model by its entry."""
        pose = self.pose(entry.pose, entry.base)
        if entry.nested is not None and entry.placed:
            # The pose is that of a frame of the model: the model's own lies where that leaves it.
            pose = pose @ inverse(entry.nested.frame(entry.placed, entry.element))
        return pose

    def _found(self, name: str, asked: Element) -> Pose:
        """Return the pose of a frame that has not been asked for before."""
        if name in self.entries:
            return self.nested_pose(self.entries[name])
        for part in self.merged:
            nested = self.entries[part].nested
            if nested is not None and name in nested.entries:
                return self.frame(part, asked) @ nested.frame(name, asked)
        head, separator, rest = name.partition("::")
        inner = self.entries[head].nested if separator and head in self.entries else None
        if inner is None:
            known = ", ".join(sorted(self.entries)) or "none"
            asked.fail(f"expected one of the frames {known}, got {name!r}")
        return self.frame(head, asked) @ inner.frame(rest, asked)
