"""Gallery: makes the pictures of the documents anew, by the commands that stand beside them.

``python -m andabata.bench.gallery [NAME...]`` reads the table of ``docs/gallery.md``, runs the
command of each picture (or of those named) in an empty folder, and writes the pictures, made
smaller, into ``docs/pictures``. It takes about ten minutes.
"""

import argparse
import base64
import io
import re
import shlex
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from PIL import Image, ImageSequence

from andabata.bench import chromium
from andabata.runs import atomic_io

if TYPE_CHECKING:
    from playwright.sync_api import ViewportSize

TABLE = Path("docs/gallery.md")
"""Document with the table, from the root of the project."""

_ROW = re.compile(
    r"^\| !\[[^\]]*\]\((pictures/[^)]+)\) \| `([^`]+)` \| `([^`]+)` \| (\d+) \|", re.M
)
_PROGRAM = (sys.executable, "-m", "andabata")

_ADDRESS = re.compile(r"http://127\.0\.0\.1:\d+")

_VIEWPORT: "ViewportSize" = {"width": 1200, "height": 760}
"""Size of a live view [pixels]."""

_PICTURE = re.compile(r'<img alt="([^"]*)" src="data:image/png;base64,([^"]*)"')


@dataclass(frozen=True)
class Exhibit:
    """A picture of the documents.

    Attributes:
        path: Path of the picture beside the table's document.
        command: Command lines, joined by ``&&``.
        source: File that the command writes; behind a ``#`` the beginning of the caption of a
            picture in a page; ``view@30`` for the live view that it serves, after 30 seconds.
        width: Largest width [pixels].
    """

    path: str
    command: str
    source: str
    width: int

    @property
    def lines(self) -> list[list[str]]:
        """Words of each command line, with this Python in front."""
        return [_program(shlex.split(line)) for line in self.command.split(" && ")]


def _program(words: list[str]) -> list[str]:
    """Return the words of a command line of ours, or of ``python -m``, to run with this Python."""
    if words[0] == "python":
        return [sys.executable, *words[1:]]
    return [*_PROGRAM, *words[1:]]


def exhibits(text: str) -> list[Exhibit]:
    """Return the pictures of a document's table."""
    rows = _ROW.findall(text)
    return [Exhibit(path, command, source, int(width)) for path, command, source, width in rows]


def make(exhibit: Exhibit) -> bytes:
    """Return a picture, made anew.

    Args:
        exhibit: Picture to make.

    Raises:
        subprocess.CalledProcessError: If a command fails.
        ValueError: If a page has no picture with that caption.
    """
    with TemporaryDirectory() as folder:
        view, _, seconds = exhibit.source.partition("@")
        if view == "view":
            (words,) = exhibit.lines
            return fitted(_from_view(words, folder, float(seconds)), exhibit.width)
        for words in exhibit.lines:
            # Ours print what they found; other modules print nothing and know no such option.
            quiet = ["--quiet"] if tuple(words[: len(_PROGRAM)]) == _PROGRAM else []
            subprocess.run([*words, *quiet], cwd=folder, check=True, stdout=subprocess.DEVNULL)
        name, _, caption = exhibit.source.partition("#")
        data = (Path(folder) / name).read_bytes()
    return fitted(_from_page(data.decode(), caption) if caption else data, exhibit.width)


def _from_view(words: Sequence[str], folder: str, seconds: float) -> bytes:
    """Return a picture of the live view that a command serves.

    Args:
        words: Words of the command.
        folder: Folder to run it in.
        seconds: Time after which the picture is taken [s].
    """
    command = [*words, "--view-port", "0"]
    with subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, text=True) as served:
        try:
            assert served.stderr is not None
            addresses = (_ADDRESS.search(line) for line in served.stderr)
            address = next(match for match in addresses if match)
            with chromium.browser() as browser:
                page = browser.new_page(viewport=_VIEWPORT)
                page.goto(address.group())
                page.wait_for_timeout(1000 * seconds)
                # The notice that no graphics card draws is not a part of the view.
                page.add_style_tag(content=".mantine-Notifications-root { display: none; }")
                return page.screenshot(timeout=60_000)
        finally:
            served.kill()


def _from_page(page: str, caption: str) -> bytes:
    """Return the first picture of a page whose caption begins with a text."""
    for title, data in _PICTURE.findall(page):
        if title.startswith(caption):
            return base64.b64decode(data)
    raise ValueError(f"page: expected a picture with the caption {caption!r}, got none")


def fitted(data: bytes, width: int) -> bytes:
    """Return a PNG or GIF picture of a largest width, of few colours; a GIF keeps its palette.

    Args:
        data: Picture.
        width: Largest width [pixels].
    """
    picture = Image.open(io.BytesIO(data))
    if picture.width <= width and picture.format == "GIF":
        return data
    size = (width, round(picture.height * width / picture.width))
    size = size if picture.width > width else picture.size
    out = io.BytesIO()
    if picture.format != "GIF":
        small = picture.convert("RGB").resize(size, Image.Resampling.LANCZOS)
        # Median cut would drop the colours of thin lines and markers.
        small.quantize(256, method=Image.Quantize.MAXCOVERAGE, kmeans=1).save(
            out, "PNG", optimize=True
        )
        return out.getvalue()
    palette = picture.copy()
    # The iterator gives one object that moves on: each frame is copied while it is the present one.
    frames = [
        frame.convert("RGB")
        .resize(size, Image.Resampling.LANCZOS)
        .quantize(palette=palette, dither=Image.Dither.NONE)
        for frame in ImageSequence.Iterator(picture)
    ]
    duration = int(picture.info["duration"])
    frames[0].save(out, "GIF", save_all=True, append_images=frames[1:], duration=duration, loop=0)
    return out.getvalue()


def main(argv: Sequence[str] | None = None) -> None:
    """Make the pictures of the table, or those whose names the arguments give."""
    parser = argparse.ArgumentParser(prog="python -m andabata.bench.gallery", description=__doc__)
    parser.add_argument("names", nargs="*", help="Names of pictures; all by default.")
    names = parser.parse_args(argv).names
    shown = exhibits(TABLE.read_text(encoding="utf-8"))
    known = [Path(exhibit.path).name for exhibit in shown]
    unknown = [name for name in names if name not in known]
    if unknown:
        parser.error(f"expected names of {', '.join(known)}; got {', '.join(unknown)}")
    for exhibit in shown:
        if not names or Path(exhibit.path).name in names:
            sys.stderr.write(f"{exhibit.path}: {exhibit.command}\n")
            atomic_io.write(TABLE.parent / exhibit.path, make(exhibit))


if __name__ == "__main__":
    main()
