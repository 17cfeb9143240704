"""What the project's documents tell people to type: fenced blocks and commands in the text."""

import re
import shlex
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import typer

from andabata.app.cli import app
from andabata.reference.commands import walk

ROOT = Path(__file__).resolve().parents[2]

_FENCE = re.compile(r"^```(\S*)\n(.*?)^```\n", re.MULTILINE | re.DOTALL)
_SPAN = re.compile(r"`([^`]+)`")
_PROGRAM = ("andabata", ".venv/bin/andabata")


@dataclass(frozen=True)
class Block:
    """A fenced block of a document.

    Attributes:
        document: Path in the project.
        language: Word behind the opening fence; empty for a shell's lines.
        text: Lines between its fences.
    """

    document: str
    language: str
    text: str

    @property
    def commands(self) -> list[str]:
        """Lines to type, without comments; lines that end in a backslash go on."""
        lines = self.text.replace("\\\n", " ").splitlines()
        return [line for line in map(_without_comment, lines) if line]


def documents() -> list[str]:
    """Return the paths of all documents but the ledger of changes, which tells the past."""
    folders = ("", "andabata", "data", "docs", "rl", "terrain", "tests", "traversability", "worlds")
    found: list[Path] = []
    for folder in folders:
        found += (ROOT / folder).glob("*.md" if folder in ("", "data") else "**/*.md")
    names = {path.relative_to(ROOT).as_posix() for path in found}
    return sorted(names - {"CHANGELOG.md"})


def blocks(document: str) -> list[Block]:
    """Return the fenced blocks of a document, in order."""
    text = (ROOT / document).read_text(encoding="utf-8")
    assert text.count("\n```") % 2 == 0, f"{document}: expected every fence to be closed"
    return [Block(document, *match.groups()) for match in _FENCE.finditer(text)]


def spans(text: str) -> list[str]:
    """Return the backticked texts of a document outside its fenced blocks."""
    return _SPAN.findall(_FENCE.sub("", text))


_ROS2_VERBS = ("bag", "node", "run", "topic")
"""Verbs of ROS 2's own command line that the documents name; our ``ros2`` has none of them."""


def is_ours(words: list[str]) -> bool:
    """Return whether words call the command line, by its name or by one of its verbs."""
    if words[:1] == ["ros2"] and words[1:2] and words[1] in _ROS2_VERBS:
        return False  # ROS 2's own tool.
    return bool(words) and (words[0] in _PROGRAM or words[0] in _group(_root()))


def complaint(text: str) -> str | None:
    """Return what is wrong with a command or with options that a text names; None where nothing is.

    A text that begins with an option is right if any verb has it. What follows ``&&`` is a command
    of its own.
    """
    for part in text.split("&&"):
        words = _words(part)
        if words and words[0].startswith("-"):
            wrong = _unknown(words, _all_options())
        elif is_ours(words):
            wrong = _wrong_call(words)
        else:
            continue
        if wrong:
            return f"{part.strip()!r}: {wrong}"
    return None


def settings(text: str) -> list[str]:
    """Return the ``a.b=c`` of every ``--set`` in a text."""
    words = _words(text)
    return [after for word, after in pairwise(words) if word == "--set"]


@cache
def _all_options() -> frozenset[str]:
    return frozenset(name for _, command in verbs() for name in options(command))


def verbs() -> list[tuple[str, Any]]:
    """Return every command and group of commands with its words."""
    return list(walk())


def options(command: Any) -> set[str]:
    """Return the options of a command, under all their names."""
    return {name for each in command.params for name in (*each.opts, *each.secondary_opts)}


@cache  # Built in 20 ms, and needed for every piece of code in the documents.
def _root() -> Any:
    return typer.main.get_command(app)


def _group(command: Any) -> dict[str, Any]:
    return getattr(command, "commands", {})


def _words(text: str) -> list[str]:
    try:
        return shlex.split(text, comments=True)
    except ValueError:  # A lone quote: prose.
        return []


def _without_comment(line: str) -> str:
    """Return a line up to the comment that a shell would see."""
    found = re.match(r"""(?:[^#'"]|(?<=\S)#|'[^']*'|"[^"]*")*""", line)
    return found.group().strip() if found else ""


def _wrong_call(words: list[str]) -> str | None:
    """Return what is wrong with a call of the command line."""
    rest = words[1:] if words[0] in _PROGRAM else words
    command, known = _root(), {"--help", *options(_root())}
    while rest and _group(command) and not rest[0].startswith("-"):
        if rest[0] not in _group(command):
            return f"expected one of {', '.join(_group(command))}, got {rest[0]!r}"
        command, rest = _group(command)[rest[0]], rest[1:]
        known = {"--help", *options(command)}
    return _unknown(rest, known)


def _unknown(words: list[str], known: set[str]) -> str | None:
    """Return the first option that is not known."""
    for word in words:
        name = word.partition("=")[0]
        if name.startswith("--") and name not in known:
            return f"expected a known option, got {name}"
    return None
