"""Pictures in a row as files: an animated GIF, or an MP4 by ffmpeg where there is one."""

import io
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

from andabata.distribution import install_extra

PICTURE = ".png"
"""End of the name of a single picture."""

FORMATS = (".gif", ".mp4", PICTURE)
"""Ends of the names of films, and of a single picture."""

_COLOURS = 72
"""Number of colours of a GIF."""

Colour = tuple[int, int, int]
"""Red, green and blue, 0 to 255."""


class FilmError(ValueError):
    """A film that cannot be made here."""


def check_film(path: Path) -> None:
    """Check that a film can be made, before minutes of driving.

    Raises:
        FilmError: If the name has another end, or there is no ffmpeg for an MP4.
    """
    if path.suffix not in FORMATS:
        raise FilmError(
            f"--clip: expected a file that ends in .gif or .mp4, or in "
            f".png for the last moment, got {path}"
        )
    if path.suffix == ".mp4":
        ffmpeg()


def ffmpeg() -> str:
    """Return the path of ffmpeg: the system's, or that of the extra ``mp4``.

    Raises:
        FilmError: If there is none.
    """
    found = shutil.which("ffmpeg")
    if found is not None:
        return found
    try:
        from imageio_ffmpeg import get_ffmpeg_exe

        return str(get_ffmpeg_exe())
    except (ImportError, RuntimeError) as error:
        raise FilmError(
            "--clip: expected ffmpeg for an MP4, got none; install it with "
            f"`{install_extra('mp4')}` or `apt install ffmpeg`, or take a .gif"
        ) from error


def film(
    pictures: Sequence[Image.Image], rate: float, kind: str, kept: Sequence[Colour] = ()
) -> bytes:
    """Return a film's file.

    Args:
        pictures: Pictures of one size.
        rate: Number of pictures a second [Hz].
        kind: End of the file's name: ``.gif`` or ``.mp4``, or ``.png`` for the last picture.
        kept: Colours that a GIF shows as they are, however rare: those of a legend.

    Raises:
        FilmError: If it cannot be made.
    """
    if kind == PICTURE:
        stream = io.BytesIO()
        pictures[-1].save(stream, format="PNG", optimize=True)
        return stream.getvalue()
    return _mp4(pictures, rate) if kind == ".mp4" else _gif(pictures, rate, kept)


def _gif(pictures: Sequence[Image.Image], rate: float, kept: Sequence[Colour]) -> bytes:
    """Return pictures as an animated GIF of one palette: palettes of their own would flicker."""
    palette = _palette(pictures, kept)
    frames = [each.quantize(palette=palette, dither=Image.Dither.NONE) for each in pictures]
    stream = io.BytesIO()
    frames[0].save(
        stream,
        format="GIF",
        save_all=True,
        append_images=frames[1:],
        duration=round(1000 / rate),
        loop=0,
        # Else colours that the first picture lacks are left out of the palette.
        optimize=False,
    )
    return stream.getvalue()


def _palette(pictures: Sequence[Image.Image], kept: Sequence[Colour]) -> Image.Image:
    """Return a picture with the palette of a film: common colours, and those that are kept."""
    width, height = pictures[0].size
    # Of three of them, so that what only the first or the last one shows has colours.
    strip = Image.new("RGB", (width, 3 * height))
    for row, picture in enumerate((pictures[0], pictures[len(pictures) // 2], pictures[-1])):
        strip.paste(picture, (0, row * height))
    count = _COLOURS - len(kept)
    common = strip.quantize(count, method=Image.Quantize.MEDIANCUT, kmeans=1).getpalette() or []
    found = Image.new("P", (1, 1))
    found.putpalette([*common[: 3 * count], *(part for colour in kept for part in colour)])
    return found


def _mp4(pictures: Sequence[Image.Image], rate: float) -> bytes:
    """Return pictures as H.264 in MP4, as all browsers play it.

    Raises:
        FilmError: If ffmpeg fails.
    """
    width, height = pictures[0].size
    source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", f"{rate:g}"]
    # Half-resolution colours and the index in front: what browsers ask for; sizes must be even.
    even = ["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2"]
    coding = ["-c:v", "libx264", "-crf", "23", "-pix_fmt", "yuv420p", "-movflags", "+faststart"]
    with TemporaryDirectory() as folder:
        path = Path(folder) / "film.mp4"
        words = [ffmpeg(), "-v", "error", "-y", *source, "-i", "-", *even, *coding, str(path)]
        data = b"".join(each.convert("RGB").tobytes() for each in pictures)
        done = subprocess.run(words, input=data, capture_output=True, check=False)
        if done.returncode or not path.is_file():
            reason = done.stderr.decode(errors="replace").strip().splitlines()[-1:]
            raise FilmError(
                f"--clip: expected an MP4 of ffmpeg, got {' '.join(reason) or 'none'}; take a .gif"
            )
        return path.read_bytes()
