"""XML as elements that know their file and line, on defusedxml: no entity is ever expanded."""

import gzip
import io
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn
from xml.parsers.expat import ErrorString, ExpatError

from defusedxml.common import DefusedXmlException, EntitiesForbidden
from defusedxml.ElementTree import DefusedXMLParser

_MAX_BYTES = 64 * 2**20
"""Largest size of a document, unpacked [bytes]; a world of 300 models has half a million."""

_MAX_ELEMENTS = 1_000_000
"""Largest number of elements of a document."""

_MAX_DEPTH = 100
"""Largest number of elements inside each other."""

_GZIP = b"\x1f\x8b"

_FORGIVEN = (
    (b"<pose frame=>", b"<pose>", "<pose frame=> without a value read as <pose>"),
    (b"</static>\\", b"</static>", "a stray backslash after </static> left out"),
)
"""Faults of the public files of DynaBARN, what is read in their place, and how that is told. Of
each kind all are forgiven, and no others."""


class SdfError(ValueError):
    """A world, or a file that it names, that is not as SDF says; the text names file and line."""


@dataclass(slots=True, eq=False)
class Element:
    """An element of a document.

    Attributes:
        tag: Name of its kind, without the namespace of the document.
        attributes: Attributes by name.
        source: File of the document.
        line: Line on which it begins.
        children: Elements inside it, in order.
        text: Text inside it.
        forgiven: Lines on which a fault was read past, and what it was; of a document's root alone.
    """

    tag: str
    attributes: dict[str, str]
    source: Path
    line: int
    children: list["Element"] = field(default_factory=list)
    text: str = ""
    forgiven: tuple[tuple[int, str], ...] = ()

    @property
    def where(self) -> str:
        """File, line and element as errors and warnings name them."""
        name = self.attributes.get("name")
        shown = f'<{self.tag} name="{name}">' if name else f"<{self.tag}>"
        return f"{self.source}:{self.line}: {shown}"

    def child(self, tag: str) -> "Element | None":
        """Return the first child of a kind, or None."""
        for each in self.children:
            if each.tag == tag:
                return each
        return None

    def all(self, tag: str) -> Iterator["Element"]:
        """Yield the children of a kind."""
        return (each for each in self.children if each.tag == tag)

    def required(self, tag: str) -> "Element":
        """Return the first child of a kind.

        Raises:
            SdfError: If there is none.
        """
        return self.child(tag) or self.fail(f"expected <{tag}> inside, got none")

    def fail(self, text: str) -> NoReturn:
        """Raise an error about this element.

        Raises:
            SdfError: Always.
        """
        raise SdfError(f"{self.where}: {text}")


def read_xml(path: Path, opaque: frozenset[str] = frozenset()) -> Element:
    """Return the root element of a file, plain or packed by gzip.

    Args:
        path: Path of the file.
        opaque: Kinds of elements whose contents are checked but not kept.

    Raises:
        SdfError: If the file is no XML, declares entities, or is too large or too deep.
        OSError: If it cannot be read.
    """
    with path.open("rb") as file:
        data = file.read(_MAX_BYTES + 1)
    if data.startswith(_GZIP):
        data = _unpacked(data, path)
    if len(data) > _MAX_BYTES:
        raise SdfError(f"{path}: expected at most {_MAX_BYTES} bytes of XML, got more")
    mended, forgiven = _mended(data)
    root = _Builder(path, opaque).build(mended)
    root.forgiven = forgiven
    return root


def _mended(data: bytes) -> tuple[bytes, tuple[tuple[int, str], ...]]:
    """Return a document without the faults that are forgiven, and on which lines they were."""
    forgiven = []
    for fault, right, text in _FORGIVEN:
        at = data.find(fault)
        while at >= 0:
            # What replaces a fault has no line break: the lines of the document stay.
            forgiven.append((data.count(b"\n", 0, at) + 1, text))
            data = data[:at] + right + data[at + len(fault) :]
            at = data.find(fault, at + len(right))
    return data, tuple(sorted(forgiven))


def _unpacked(data: bytes, path: Path) -> bytes:
    """Return the contents of gzip bytes, at most one byte more than is allowed."""
    try:
        return gzip.GzipFile(fileobj=io.BytesIO(data)).read(_MAX_BYTES + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise SdfError(f"{path}: expected a whole gzip file, got a damaged one ({error})") from None


class _Builder:
    """Handlers of one document's events."""

    def __init__(self, path: Path, opaque: frozenset[str]) -> None:
        """Prepare for a file."""
        self._path, self._opaque = path, opaque
        # The root's parent stands for the document, which errors outside of elements name.
        self._stack = [Element("document", {}, path, 1)]
        self._count = 0
        self._namespace = ""  # As expat writes it before names: "http://...}".
        self._skipped = 0  # Number of open elements from an opaque one on.
        # DefusedXMLParser installs what refuses entities; its expat parser knows the lines. Its own
        # handlers of elements, which know none, are replaced.
        parser = DefusedXMLParser(forbid_dtd=False, forbid_entities=True, forbid_external=True)
        self._expat = parser.parser
        self._expat.buffer_text = True
        # Text that comes in many pieces is copied as often: a mesh has megabytes in one element.
        self._expat.buffer_size = 2**20
        self._expat.ordered_attributes = False
        self._expat.StartElementHandler = self._start
        self._expat.EndElementHandler = self._end
        self._expat.CharacterDataHandler = self._characters
        self._expat.DefaultHandlerExpand = None

    def build(self, data: bytes) -> Element:
        """Return the root of a document.

        Raises:
            SdfError: If it is no XML, declares entities, or is too large or too deep.
        """
        try:
            self._expat.Parse(data, True)
        except ExpatError as error:
            self._fail(f"expected well-formed XML, got {ErrorString(error.code)}", error.lineno)
        except EntitiesForbidden as error:
            self._fail(f"expected no entities, got {error.name!r}; write out what it stands for")
        except DefusedXmlException as error:
            self._fail(f"expected nothing from outside of the file, got {type(error).__name__}")
        except (ValueError, LookupError) as error:
            # An unknown encoding; errors of our own pass as they are.
            if isinstance(error, SdfError):
                raise
            self._fail(f"expected well-formed XML, got {error}")
        return self._stack[0].children[0]

    def _fail(self, text: str, line: int | None = None) -> NoReturn:
        """Raise an error at a line, by default where the parser is, inside the open element."""
        tag = self._stack[-1].tag
        at = self._expat.CurrentLineNumber if line is None else line
        raise SdfError(f"{self._path}:{at}: <{tag}>: {text}") from None

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        """Take the begin of an element."""
        if self._skipped:
            self._skipped += 1
            return
        if not self._count:
            self._namespace = tag[: tag.rfind("}") + 1]
        tag = tag.removeprefix(self._namespace)
        self._count += 1
        if len(self._stack) > _MAX_DEPTH:
            self._fail(f"expected at most {_MAX_DEPTH} elements inside each other, got more")
        if self._count > _MAX_ELEMENTS:
            self._fail(f"expected at most {_MAX_ELEMENTS} elements, got more")
        element = Element(tag, attributes, self._path, self._expat.CurrentLineNumber)
        self._stack[-1].children.append(element)
        self._stack.append(element)
        if tag in self._opaque:
            self._skipped = 1

    def _end(self, tag: str) -> None:
        """Take the end of an element."""
        if self._skipped > 1:
            self._skipped -= 1
            return
        self._skipped = 0
        self._stack.pop()

    def _characters(self, text: str) -> None:
        """Take text."""
        if not self._skipped:
            self._stack[-1].text += text
