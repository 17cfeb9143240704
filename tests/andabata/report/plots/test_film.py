"""Films: GIF and MP4, and the error without ffmpeg."""

import io
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from andabata.report.plots import film as films
from andabata.report.plots.film import FilmError, check_film, ffmpeg, film

PICTURES = [
    Image.linear_gradient("L").resize((31, 20)).rotate(30 * k).convert("RGB") for k in range(4)
]


def test_a_gif_holds_the_pictures_at_their_rate():
    """Four pictures, a tenth of a second each."""
    moving = Image.open(io.BytesIO(film(PICTURES, 10.0, ".gif")))
    assert (moving.n_frames, moving.size, moving.info["duration"]) == (4, (31, 20), 100)


def test_the_end_png_makes_a_picture_of_the_last_moment():
    """It has the last picture's pixels."""
    check_film(Path("a.png"))
    found = Image.open(io.BytesIO(film(PICTURES, 10.0, ".png")))
    assert found.format == "PNG"
    assert (np.asarray(found) == np.asarray(PICTURES[-1])).all()


def test_a_gif_keeps_the_colours_of_a_legend():
    """However rare they are, and in pictures that come later."""
    rng = np.random.default_rng(0)
    pictures = [Image.fromarray(rng.integers(0, 90, (60, 80, 3), dtype=np.uint8)) for _ in "abcd"]
    kept = [(208, 0, 111), (0, 71, 200)]
    for number, colour in enumerate(kept):
        pictures[2 + number].putpixel((5, 7), colour)
    moving = Image.open(io.BytesIO(film(pictures, 10.0, ".gif", kept)))
    for number, colour in enumerate(kept):
        moving.seek(2 + number)
        assert moving.convert("RGB").getpixel((5, 7)) == colour


def test_an_mp4_is_made_where_there_is_ffmpeg():
    """The file begins as MP4 does; odd sizes are no error."""
    try:
        ffmpeg()
    except FilmError as error:
        pytest.skip(str(error))
    assert film(PICTURES, 10.0, ".mp4")[4:8] == b"ftyp"


@pytest.fixture
def no_ffmpeg(monkeypatch):
    """Hide ffmpeg and the package that brings it."""
    monkeypatch.setattr(films.shutil, "which", lambda name: None)
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)


def test_without_ffmpeg_the_error_says_what_to_install(no_ffmpeg):
    """An MP4 is refused before the drive, a GIF is not; other ends are never taken."""
    check_film(Path("a.gif"))
    with pytest.raises(FilmError, match=r"pip install -e '\.\[mp4\]'.*apt install ffmpeg"):
        check_film(Path("a.mp4"))
    with pytest.raises(FilmError, match=r"ends in \.gif or \.mp4, or in .* got a\.avi"):
        check_film(Path("a.avi"))


def test_what_ffmpeg_says_is_told(monkeypatch):
    """The last line of its errors stands in ours."""
    monkeypatch.setattr(films, "ffmpeg", lambda: "ffmpeg")
    failed = subprocess.CompletedProcess([], 1, b"", b"first\nno such codec\n")
    monkeypatch.setattr(films.subprocess, "run", lambda *_, **__: failed)
    with pytest.raises(FilmError, match=r"got no such codec; take a \.gif"):
        film(PICTURES, 10.0, ".mp4")
