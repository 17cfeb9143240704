"""Pictures in a row as files: an animated GIF, or an MP4 by ffmpeg where there is one."""

import io
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

from andabata.distribution import install_extra

FORMATS = (".gif", ".mp4")
"""Ends of the names of films."""

_COLOURS = 96
"""Number of colours of a GIF."""


class FilmError(ValueError):
    """A film that cannot be made here."""


def check_film(path: Path) -> None:
    """Check that a film can be made, before minutes of driving.

    Raises:
        FilmError: If the name has another end, or there is no ffmpeg for an MP4.
    """
    if path.suffix not in FORMATS:
        raise FilmError(f"--clip: expected a file that ends in .gif or .mp4, got {path}")
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


def film(pictures: Sequence[Image.Image], rate: float, kind: str) -> bytes:
    """Return a film's file.

    Args:
        pictures: Pictures of one size.
        rate: Number of pictures a second [Hz].
        kind: End of the file's name: ``.gif`` or ``.mp4``.

    Raises:
        FilmError: If it cannot be made.
    """
    return _mp4(pictures, rate) if kind == ".mp4" else _gif(pictures, rate)


def _gif(pictures: Sequence[Image.Image], rate: float) -> bytes:
    """Return pictures as an animated GIF of one palette: palettes of their own would flicker."""
    middle = pictures[len(pictures) // 2]
    palette = middle.quantize(_COLOURS, method=Image.Quantize.MEDIANCUT)
    frames = [each.quantize(palette=palette, dither=Image.Dither.NONE) for each in pictures]
    stream = io.BytesIO()
    frames[0].save(
        stream,
        format="GIF",
        save_all=True,
        append_images=frames[1:],
        duration=round(1000 / rate),
        loop=0,
        optimize=True,
    )
    return stream.getvalue()


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
