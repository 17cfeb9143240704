"""Worlds of Gazebo: what collides in an SDF file of version 1.4 to 1.9, plain or packed by gzip.

``read_sdf`` reads a world with the models that it includes. ``worlds.sdf.room`` makes a room of it,
for planar lasers, and ``worlds.sdf.ground`` a world of hills. What is seen but does not collide is
not taken; what cannot be taken is named in a warning.

A ``<state>`` says where a saved simulation left its models. Its poses, in the world's frame,
replace those of models and links; its scales come on top of the models' measures, as Gazebo saves
both.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from worlds.sdf.elements import Element
from worlds.sdf.files import ModelFolders, version_of
from worlds.sdf.frames import Entry, Scope
from worlds.sdf.notes import Notes
from worlds.sdf.shapes import Shape, read_shape, scaled
from worlds.sdf.state import ModelState, deleted, inserted, world_state
from worlds.sdf.values import IDENTITY, Pose, inverse, is_true, pose_of

_MAX_INCLUDES = 20
"""Largest number of models that include each other."""


@dataclass(frozen=True, eq=False)
class Solid:
    """A shape that collides.

    Attributes:
        name: Names of model, link and collision, with ``::`` between them.
        shape: Shape.
        pose: Pose in the world.
        where: File, line and element of its collision.
    """

    name: str
    shape: Shape
    pose: Pose
    where: str


@dataclass(frozen=True, eq=False)
class SdfWorld:
    """What collides in a world.

    Attributes:
        name: Name of the world.
        version: Version of SDF that the file is written in.
        solids: Shapes, in the order of the file.
        warnings: Parts that were left out or read otherwise than written, with file and line.
    """

    name: str
    version: str
    solids: tuple[Solid, ...]
    warnings: tuple[str, ...]


def read_sdf(
    path: Path,
    folders: Sequence[Path] = (),
    name: str | None = None,
    allow_missing: bool = False,
) -> SdfWorld:
    """Return what collides in a world, or in the model that a file holds.

    Args:
        path: File, plain or packed by gzip.
        folders: Folders in which included models and meshes are looked for, before the file's own.
        name: Name of the world, where a file holds several; None for the first one.
        allow_missing: True to leave out models, meshes and images that are not found, with a
            warning.

    Raises:
        SdfError: If a file is not as SDF says, or one that it names is missing.
        OSError: If the file cannot be read.
    """
    notes = Notes()
    files = ModelFolders(folders, path.parent, allow_missing, notes)
    root = files.read(path)
    reader = _Reader(files, notes)
    element = _chosen(root, name, notes)
    if element.tag == "world":
        scope = reader.scope(element, _name(element), [path])
    else:
        # A model alone stands in a world of its own.
        scope = Scope(Element("world", {}, path, element.line), _name(element), notes)
        reader.add_model(scope, element, None, [path])
    solids = tuple(reader.solids(scope, IDENTITY, (), world_state(element)))
    major, minor = version_of(root)
    return SdfWorld(scope.name, f"{major}.{minor}", solids, notes.lines)


def _chosen(root: Element, name: str | None, notes: Notes) -> Element:
    """Return the world of a file, or its model where there is no world.

    Raises:
        SdfError: If there is none.
    """
    worlds = list(root.all("world"))
    if not worlds and name is None:
        return root.child("model") or root.fail("expected <world> or <model> inside, got none")
    names = [_name(each) for each in worlds]
    if name is None:
        for each in worlds[1:]:
            notes.add("a second world of the same file was left out", each)
        return worlds[0]
    if name not in names:
        root.fail(f"expected one of the worlds {', '.join(names) or '(none)'}, got {name!r}")
    return worlds[names.index(name)]


class _Reader:
    """Elements to shapes; see ``read_sdf``."""

    def __init__(self, files: ModelFolders, notes: Notes) -> None:
        """Take the files that may be included, and the warnings."""
        self._files, self._notes = files, notes

    def scope(self, element: Element, name: str, opened: list[Path], fixed: bool = False) -> Scope:
        """Return the frames of a world or model with all that it includes.

        Args:
            element: ``<world>`` or ``<model>``.
            name: Name.
            opened: Files that are being read, the included one last.
            fixed: True if what it is part of, or what includes it, is static.

        Raises:
            SdfError: If a model is missing, includes itself, or has no name.
        """
        fixed = fixed or is_true(element.child("static"))
        scope = Scope(element, name, self._notes, fixed=fixed)
        for child in [*element.children, *inserted(element)]:
            match child.tag:
                case "model":
                    self.add_model(scope, child, None, opened)
                case "include":
                    self._add_include(scope, child, opened)
                case "link":
                    scope.add(_name(child), Entry(child, child.child("pose")))
                case "frame":
                    base = child.attributes.get("attached_to", "")
                    scope.add(_name(child), Entry(child, child.child("pose"), base))
                case "joint":
                    linked = child.child("child")
                    base = "" if linked is None else linked.text.strip()
                    scope.add(_name(child), Entry(child, child.child("pose"), base))
            self._notes.check(child, element.tag)
        return scope

    def add_model(
        self, scope: Scope, model: Element, include: Element | None, opened: list[Path]
    ) -> None:
        """Add a nested or included model; what its ``<include>`` says comes before its own.

        Args:
            scope: Frames of what it is in, to which this adds.
            model: ``<model>``.
            include: ``<include>`` that names it, None for one that stands there itself.
            opened: Files that are being read, that of the model last.
        """
        given = model if include is None else include
        name, placed = given.child("name"), given.child("placement_frame")
        inner = self.scope(
            model,
            _name(model) if name is None else name.text.strip(),
            opened,
            scope.fixed or is_true(given.child("static")),
        )
        entry = Entry(
            given,
            given.child("pose") or model.child("pose"),
            nested=inner,
            placed=model.attributes.get("placement_frame", "")
            if placed is None
            else placed.text.strip(),
        )
        scope.add(inner.name, entry)
        scope.models.append(entry)
        if given.attributes.get("merge", "").lower() in ("1", "true"):
            scope.merged.append(inner.name)

    def _add_include(self, scope: Scope, include: Element, opened: list[Path]) -> None:
        """Add the model that an ``<include>`` names; what else its file holds is left out."""
        for child in include.all("plugin"):
            self._notes.check(child, "include")
        path = self._files.model(include.required("uri"))
        if path is None:
            return
        if path in opened or len(opened) > _MAX_INCLUDES:
            include.fail(f"expected models that do not include themselves, got {path} again")
        root = self._files.read(path)
        model = root.child("model")
        if model is not None:
            self.add_model(scope, model, include, [*opened, path])
            return
        for child in root.children:
            self._notes.check(child, "sdf")

    def solids(
        self, scope: Scope, pose: Pose, names: tuple[str, ...], states: Mapping[str, ModelState]
    ) -> Iterator[Solid]:
        """Yield the shapes of all models in a world or model.

        Args:
            scope: Its frames.
            pose: Its pose in the world.
            names: Names of the models around, and its own.
            states: State of each model in it, by name.
        """
        gone = deleted(scope.element)
        left = {name: state for name, state in states.items() if name not in gone}
        for entry in scope.models:
            inner = entry.nested
            if inner is None or inner.name in gone:
                continue
            if not names and not inner.fixed:
                self._notes.add("a model that can move stands still", entry.element)
            state = left.pop(inner.name, _NO_STATE)
            at = pose @ scope.nested_pose(entry) if state.pose is None else state.pose
            yield from self._model(inner, at, (*names, inner.name), state)
        for state in left.values():
            if state.element is not None:
                self._notes.add("a state names a model that is not there", state.element)

    def _model(
        self, scope: Scope, pose: Pose, names: tuple[str, ...], state: ModelState
    ) -> Iterator[Solid]:
        """Yield the shapes of a model and of those in it."""
        count, seen = 0, False
        for link in scope.element.all("link"):
            name = _name(link)
            moved = state.links.get(name)
            at = pose @ scope.pose(link.child("pose")) if moved is None else moved
            for child in link.children:
                self._notes.check(child, "link")
                seen |= child.tag == "visual"
                if child.tag != "collision":
                    continue
                count += 1
                shape = self._shape(child)
                if shape is not None:
                    yield Solid(
                        "::".join([*names, name, child.attributes.get("name", "")]),
                        shape if state.scale == _NO_STATE.scale else scaled(shape, state.scale),
                        at @ _in_link(scope, link, child.child("pose")),
                        child.where,
                    )
        if seen and not count:
            self._notes.add("a model that is seen but does not collide", scope.element)
        yield from self.solids(scope, pose, names, state.models)

    def _shape(self, collision: Element) -> Shape | None:
        """Return the shape of a collision; None if it is empty or left out."""
        for child in collision.children:
            self._notes.check(child, "collision")
        return read_shape(collision.required("geometry"), self._files, self._notes)


_NO_STATE = ModelState()
"""State of a model that no state names."""


def _in_link(scope: Scope, link: Element, pose: Element | None) -> Pose:
    """Return the pose of a collision in the frame of its link."""
    if pose is None or not pose.attributes.get("relative_to"):
        return pose_of(pose)
    # Both frames as they are described, not where a state left the link.
    return inverse(scope.pose(link.child("pose"))) @ scope.pose(pose)


def _name(element: Element) -> str:
    """Return the name of an element.

    Raises:
        SdfError: If it has none.
    """
    return element.attributes.get("name") or element.fail("expected an attribute name, got none")
