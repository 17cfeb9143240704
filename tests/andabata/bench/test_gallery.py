"""Gallery: the table of pictures and commands, and pictures made smaller."""

import base64
import io
import re
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from andabata.bench import chromium, gallery
from andabata.bench.gallery import TABLE, Exhibit, exhibits, fitted, make
from tests.support.documents import ROOT, complaint, documents

EXHIBITS = exhibits((ROOT / TABLE).read_text(encoding="utf-8"))
PICTURES = ROOT / TABLE.parent / "pictures"
MOST_BYTES = 6_000_000


def test_a_row_is_read_from_the_table():
    """Path, command, file and width; other lines of the document are no rows."""
    text = (
        "| picture |\n| ![a (b)](pictures/a.gif) | `andabata x && andabata y` | `a.gif` | 320 |\n"
    )
    (found,) = exhibits(text)
    assert found == Exhibit("pictures/a.gif", "andabata x && andabata y", "a.gif", 320)
    ours = [sys.executable, "-m", "andabata"]
    assert found.lines == [[*ours, "x"], [*ours, "y"]]


def test_a_command_of_another_module_runs_with_this_python():
    """``python -m`` is the Python that runs; the words behind it stay."""
    exhibit = Exhibit("pictures/a.png", "python -m some.module a.png", "a.png", 320)
    assert exhibit.lines == [[sys.executable, "-m", "some.module", "a.png"]]


def test_a_module_makes_its_picture_without_options_of_ours(monkeypatch):
    """The file that it writes is the picture: it is not asked to be quiet."""

    def run(command, cwd, **others):
        assert command == [sys.executable, "-m", "some.module", "a.png"]
        Image.new("RGB", (400, 100), "red").save(Path(cwd) / "a.png")

    monkeypatch.setattr("andabata.bench.gallery.subprocess.run", run)
    made = make(Exhibit("pictures/a.png", "python -m some.module a.png", "a.png", 200))
    assert Image.open(io.BytesIO(made)).size == (200, 50)


def test_a_picture_that_there_is_not_is_refused(capsys):
    """The message lists the names, with their endings."""
    with pytest.raises(SystemExit):
        gallery.main(["room"])
    assert re.search(r"expected names of .*room\.png.*; got room\n", capsys.readouterr().err)


@pytest.mark.parametrize("exhibit", EXHIBITS, ids=lambda each: each.path)
def test_each_picture_is_there_with_a_command_that_exists(exhibit):
    """Options are known, the picture is not wider than the table says."""
    assert complaint(exhibit.command) is None
    for module in re.findall(r"python -m (\S+)", exhibit.command):
        assert find_spec(module) is not None
    picture = Image.open(io.BytesIO((PICTURES.parent / exhibit.path).read_bytes()))
    assert 100 < picture.width <= exhibit.width
    assert picture.format == Path(exhibit.path).suffix[1:].upper()
    assert picture.format != "GIF" or picture.n_frames > 10


def test_every_picture_is_in_the_table_and_used():
    """No picture without a command or a reader; all together stay small."""
    files = {path.name for path in PICTURES.iterdir()}
    assert files == {Path(each.path).name for each in EXHIBITS}
    assert sum(path.stat().st_size for path in PICTURES.iterdir()) < MOST_BYTES
    texts = [(ROOT / name).read_text() for name in documents() if name != TABLE.as_posix()]
    assert {
        name for name in files if not any(f"pictures/{name})" in text for text in texts)
    } == set()


def gif(width, height, count):
    """Return an animation of a ramp of greys that moves to the left, by 20 a frame."""
    ramp = np.tile(np.linspace(0, 200, width), (height, 1))
    frames = [
        Image.fromarray((ramp + 20 * number).clip(0, 255).astype(np.uint8))
        for number in range(count)
    ]
    out = io.BytesIO()
    frames[0].save(out, "GIF", save_all=True, append_images=frames[1:], duration=100)
    return out.getvalue()


def test_a_narrower_clip_has_all_frames_at_the_same_rate():
    """It lasts as long, and its frames differ."""
    picture = Image.open(io.BytesIO(fitted(gif(200, 100, 8), 100)))
    assert (picture.size, picture.n_frames, picture.info["duration"]) == ((100, 50), 8, 100)
    shades = []
    for number in (0, 2, 4):
        picture.seek(number)
        shades.append(picture.convert("L").getpixel((50, 5)))
    assert shades == pytest.approx([101, 141, 181], abs=6)


def test_a_narrower_clip_keeps_rare_colours():
    """Three pixels in a thousand keep their colour: the palette is that of the clip."""
    frames = []
    for number in range(3):
        frame = Image.new("RGB", (200, 100), (90, 90, 90 + number))
        frame.paste((208, 0, 111), (100, 50, 108, 58))
        frames.append(frame.quantize(4, method=Image.Quantize.MAXCOVERAGE))
    out = io.BytesIO()
    frames[0].save(out, "GIF", save_all=True, append_images=frames[1:], duration=100)
    small = Image.open(io.BytesIO(fitted(out.getvalue(), 100))).convert("RGB")
    assert small.getpixel((52, 27)) == pytest.approx((208, 0, 111), abs=12)


def test_a_clip_that_fits_stays_as_it_is():
    """The same bytes."""
    assert fitted(gif(100, 50, 3), 100) == gif(100, 50, 3)


def test_a_picture_keeps_its_proportions():
    """A wide one is made smaller, a small one not larger."""
    out = io.BytesIO()
    Image.new("RGB", (400, 100), "red").save(out, "PNG")
    assert Image.open(io.BytesIO(fitted(out.getvalue(), 200))).size == (200, 50)
    assert Image.open(io.BytesIO(fitted(out.getvalue(), 900))).size == (400, 100)


def test_a_picture_keeps_rare_colours():
    """A thin line on a ramp of a thousand greys and greens keeps its colour."""
    ramp = np.zeros((100, 400, 3), dtype=np.uint8)
    ramp[..., 0], ramp[..., 1] = np.linspace(0, 200, 400), np.linspace(40, 220, 100)[:, None]
    ramp[50, 200:210] = (208, 0, 111)
    out = io.BytesIO()
    Image.fromarray(ramp).save(out, "PNG")
    found = Image.open(io.BytesIO(fitted(out.getvalue(), 400))).convert("RGB")
    assert found.getpixel((205, 50)) == pytest.approx((208, 0, 111), abs=16)


def page(folder, monkeypatch):
    """Let commands write a page with two pictures instead of running."""
    pictures = {}
    for caption, colour in (("First", "red"), ("Second: b", "blue")):
        out = io.BytesIO()
        Image.new("RGB", (10, 10), colour).save(out, "PNG")
        pictures[caption] = base64.b64encode(out.getvalue()).decode()
    body = "".join(
        f'<img alt="{caption}" src="data:image/png;base64,{data}">'
        for caption, data in pictures.items()
    )

    def run(command, cwd, **others):
        assert command[1:] == ["-m", "andabata", "report", "run", "--quiet"]
        (Path(cwd) / "page.html").write_text(body)

    monkeypatch.setattr("andabata.bench.gallery.subprocess.run", run)


def test_a_picture_of_a_page_is_found_by_its_caption(tmp_path, monkeypatch):
    """The beginning of the caption is enough; a caption that is not there is refused."""
    page(tmp_path, monkeypatch)
    made = make(Exhibit("b.png", "andabata report run", "page.html#Second", 100))
    assert Image.open(io.BytesIO(made)).convert("RGB").getpixel((1, 1))[2] > 200
    with pytest.raises(ValueError, match="caption 'Third'"):
        make(Exhibit("b.png", "andabata report run", "page.html#Third", 100))


SERVED = """
import sys
from http.server import BaseHTTPRequestHandler, HTTPServer

class Page(BaseHTTPRequestHandler):
    def do_GET(self):
        self.send_response(200)
        self.end_headers()
        self.wfile.write(b"<body style='background: rgb(200, 40, 90)'>")

    def log_message(self, *words):
        pass

server = HTTPServer(("127.0.0.1", 0), Page)
print("compiling", file=sys.stderr)
print(f"view: http://127.0.0.1:{server.server_port}", file=sys.stderr, flush=True)
server.serve_forever()
"""


@pytest.mark.skipif(chromium.missing() is not None, reason=str(chromium.missing()))
def test_a_picture_of_a_live_view_is_that_of_the_page_that_is_served(monkeypatch):
    """The address is read from what the command prints, and the page is what is drawn."""
    monkeypatch.setattr(gallery, "_PROGRAM", (sys.executable, "-c", SERVED))
    data = make(Exhibit("pictures/v.png", "andabata drive --view", "view@0.1", 300))
    picture = Image.open(io.BytesIO(data)).convert("RGB")
    assert picture.size == (300, 190)
    assert picture.getpixel((150, 95)) == (200, 40, 90)
