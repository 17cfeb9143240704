"""Walks of a stranger: lines of the pages, typed in their order in an empty folder."""

import json
import shlex
from contextlib import chdir
from pathlib import Path
from typing import Any

import pytest

from andabata.app.cli import main
from tests.support.documents import ROOT, blocks

PROGRAM = ".venv/bin/andabata "


class Walk:
    """A folder in which a stranger types what pages say, and reads what comes.

    Lines run in this process, which has all imports. None ends in a traceback.

    Attributes:
        folder: The folder, with the examples of the repository.
    """

    def __init__(self, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
        """Take a folder and the captured output."""
        self.folder, self._capsys = folder, capsys
        (folder / "examples").symlink_to(ROOT / "examples")

    def read(self, page: str, start: str) -> str:
        """Return the line of a page's blocks that begins with some words of a command.

        Args:
            page: Path of the page in the project.
            start: Verb and what follows it, as far as it names one line.
        """
        lines = [line for block in blocks(page) for line in block.commands]
        found = [line for line in lines if line.startswith(PROGRAM + start)]
        assert len(found) == 1, f"{page}: expected one line {start!r}, got {found}"
        return found[0]

    def type(self, line: str, more: str = "", code: int = 0) -> str:
        """Run a line and return what it prints.

        Args:
            line: Line of a page, with the program.
            more: Options that make it short.
            code: Exit code that is expected.
        """
        words = shlex.split(f"{line.removeprefix(PROGRAM)} {more}")
        with chdir(self.folder):
            given = main(words)
        out, err = self._capsys.readouterr()
        assert given == code, f"{line} {more}\n{out}\n{err}"
        assert "Traceback" not in err
        return out + err

    def ask(self, line: str, more: str = "", code: int = 0) -> Any:
        """Return the JSON that a line prints with ``--json``; progress is left out."""
        text = self.type(line, f"{more} --json", code)
        return json.loads(text[text.index("{") : text.rindex("}") + 1])
