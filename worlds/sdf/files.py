"""Files that a simulation description names: models, meshes and images in given folders."""

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from worlds.sdf.elements import Element, SdfError, read_xml
from worlds.sdf.notes import Notes

NEWEST = (1, 9)
"""Newest version of SDF that is read."""

OPAQUE = frozenset(
    {
        "actor",
        "atmosphere",
        "audio",
        "battery",
        "gripper",
        "gui",
        "inertial",
        "light",
        "physics",
        "plugin",
        "population",
        "projector",
        "road",
        "scene",
        "sensor",
        "spherical_coordinates",
        "surface",
        "visual",
        "wind",
    }
)
"""Elements that say nothing about the shapes that collide."""

_STANDARD = Path(__file__).parent / "models"
"""Folder of models that worlds include without bringing them."""

_CONFIGS = ("model.config", "manifest.xml")
_MODEL = "model.sdf"


def version_of(root: Element) -> tuple[int, int]:
    """Return the version of an ``<sdf>`` element.

    Raises:
        SdfError: If it says none.
    """
    text = root.attributes.get("version", "")
    try:
        major, minor = text.split(".")
        return int(major), int(minor)
    except ValueError:
        return root.fail(f"expected a version such as 1.6, got {text!r}")


class ModelFolders:
    """Folders of models, and what was read from them so far: each file once."""

    def __init__(
        self, folders: Sequence[Path], own: Path, allow_missing: bool, notes: Notes
    ) -> None:
        """Prepare for a world.

        Args:
            folders: Folders that hold models, the first one first.
            own: Folder of the world.
            allow_missing: True to leave out what is in none of them, with a warning.
            notes: Warnings, to which this adds.
        """
        self._roots = [*folders, own, _STANDARD]
        self._allow_missing = allow_missing
        self._notes = notes
        self._read: dict[Path, Element] = {}

    def read(self, path: Path) -> Element:
        """Return the ``<sdf>`` element of a file.

        Raises:
            SdfError: If it is no SDF.
            OSError: If it cannot be read.
        """
        if path not in self._read:
            root = read_xml(path, OPAQUE)
            if root.tag != "sdf":
                root.fail("expected <sdf> as the outermost element")
            for line, text in root.forgiven:
                self._notes.add(text, Element("sdf", {}, path, line))
            version = version_of(root)
            if version < (1, 4):
                root.fail(f"expected version 1.4 to 1.9, got {root.attributes['version']}")
            if version > NEWEST:
                self._notes.add("versions after 1.9 are read as if they were 1.9", root)
            self._read[path] = root
        return self._read[path]

    def file(self, uri: Element) -> Path | None:
        """Return the file that a ``<uri>`` names; None if it is missing and may be.

        Raises:
            SdfError: If it is missing, or outside of all folders.
        """
        for path in self._candidates(uri):
            if path.is_file():
                return path
        self._miss(uri)
        return None

    def model(self, uri: Element) -> Path | None:
        """Return the SDF file of the model that a ``<uri>`` names; None if missing and may be.

        Raises:
            SdfError: If it is missing, or outside of all folders, or its folder names none.
        """
        for path in self._candidates(uri):
            if path.is_file():
                return path
            for name in _CONFIGS:
                if (path / name).is_file():
                    return _configured(path / name)
            if (path / _MODEL).is_file():
                return path / _MODEL
        self._miss(uri)
        return None

    def _miss(self, uri: Element) -> None:
        """Warn of what is missing, or refuse it."""
        text = uri.text.strip()
        if not self._allow_missing:
            folders = ", ".join(map(str, self._roots[:-1]))
            uri.fail(
                f"expected {text} in {folders}, got nothing; give the folder that holds it, or "
                f"allow what is missing to be left out"
            )
        self._notes.add(f"{text} is missing and was left out", uri)

    def _candidates(self, uri: Element) -> Iterator[Path]:
        """Yield the paths that a ``<uri>`` may stand for, none outside of the folders.

        Raises:
            SdfError: If it is empty or leads out of them.
        """
        text = uri.text.strip()
        scheme, separator, rest = text.partition("://")
        if not separator:
            scheme, rest = "", text
        if scheme in ("http", "https"):
            # A server's models have spaces and capitals in their names, folders mostly have not.
            rest = rest.rpartition("/models/")[2]
            names = [rest, rest.lower().replace(" ", "_")]
        else:
            names = [rest]
        if not rest:
            uri.fail("expected the name of a model or a file, got nothing")
        folders = [*self._roots]
        if scheme in ("", "file"):
            folders.insert(0, uri.source.parent)
        allowed = [os.path.abspath(folder) for folder in folders]
        # What climbs out with ".." is refused as it is written: links are the user's own affair.
        paths = [os.path.abspath(os.path.join(root, name)) for root in allowed for name in names]
        inside = [p for p in paths if any(p.startswith(root + os.sep) for root in allowed)]
        if not inside:
            uri.fail(f"expected a path inside of the folders of models, got {text!r}")
        return map(Path, inside)


def _configured(config: Path) -> Path:
    """Return the SDF file of a model's folder: that of the newest version which is read.

    Raises:
        SdfError: If the file names none.
    """
    root = read_xml(config)
    versions = [(version_of(each), each.text.strip()) for each in root.all("sdf") if _known(each)]
    readable = [entry for entry in versions if entry[0] <= NEWEST]
    unknown = [each.text.strip() for each in root.all("sdf") if not _known(each)]
    names = [max(readable)[1]] if readable else [*unknown, *(name for _, name in sorted(versions))]
    if not names or not names[0]:
        root.fail("expected <sdf> with the name of a file inside, got none")
    path = config.parent / names[0]
    if not Path(os.path.abspath(path)).is_relative_to(os.path.abspath(config.parent)):
        root.fail(f"expected a file in the folder of the model, got {names[0]!r}")
    if not path.is_file():
        raise SdfError(f"{root.where}: expected the file {path}, got none")
    return path


def _known(element: Element) -> bool:
    """Return True if an element says its version."""
    return "version" in element.attributes
