"""Pages of every kind of run: what they say, and that a real browser shows them whole.

One module makes the runs, since they and the browser are what takes time.
"""

import json
import re
from pathlib import Path

import pytest
from PIL import Image

from andabata.app.cli import main
from andabata.report.drive import _failure
from tests.support.report_folders import (
    made_barn,
    made_classifiers,
    made_clouds,
    made_offroad_training,
    made_rooms,
    written_drive,
    written_evaluation,
    written_spn_training,
    written_td3_training,
)

CHROMIUM = Path("/usr/bin/chromium")
OPTIONS = [
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
]
WIDTH = 1000

ZOOMED = {
    *("ground", "drive", "drives", "offroad", "rooms", "study", "barn"),
    *("evaluation", "spn", "td3"),
}
"""Kinds whose pages have lines that are zoomed and read."""


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Return the folders of tiny runs by kind."""
    home = tmp_path_factory.mktemp("runs")
    clouds = made_clouds(home / "clouds")
    rooms, study = made_rooms(home / "in-rooms")
    first = written_drive(home / "drive")
    return {
        "clouds": [clouds],
        **{kind: [made] for kind, made in made_classifiers(home, clouds).items()},
        "drive": [first],
        "drives": [first, written_drive(home / "other", "reactive", 8.0, "goal")],
        "offroad": [made_offroad_training(home / "offroad")],
        "rooms": [rooms],
        "study": [study],
        "barn": [made_barn(home / "barn")],
        "evaluation": [written_evaluation(home / "evaluation")],
        "spn": [written_spn_training(home / "spn")],
        "td3": [written_td3_training(home / "td3")],
    }


@pytest.fixture(scope="module")
def pages(folders, tmp_path_factory):
    """Return the pages of the runs by kind."""
    home = tmp_path_factory.mktemp("pages")
    found = {kind: home / f"{kind}.html" for kind in folders}
    for kind, page in found.items():
        words = ["report", *map(str, folders[kind]), "--out", str(page), "--quiet", "--json"]
        assert main([*words, "--tests", "1", "--workers", "1"]) == 0, kind
    return found


@pytest.fixture(scope="module")
def browser():
    """Return a headless Chromium."""
    if not CHROMIUM.exists():
        pytest.skip(f"{CHROMIUM} is missing: make browser")
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is missing")
    with playwright.sync_playwright() as started:
        chromium = started.chromium.launch(executable_path=str(CHROMIUM), args=OPTIONS)
        yield chromium
        chromium.close()


def opened(browser, path):
    """Return a page without a network, and the errors and requests that it makes."""
    context = browser.new_context(viewport={"width": WIDTH, "height": 800}, offline=True)
    page, wrong = context.new_page(), []
    page.on("console", lambda said: wrong.append(said.text) if said.type == "error" else None)
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on(
        "request",
        lambda asked: None if asked.url.startswith(("file:", "data:")) else wrong.append(asked.url),
    )
    page.goto(path.as_uri())
    return page, wrong


def test_every_page_says_how_it_was_made(pages):
    """Command, commit, seed and settings stand on each page; no raw key of an interval does."""
    for kind, path in pages.items():
        text = path.read_text()
        assert '<h2 id="how-it-was-made">' in text, kind
        assert ">settings</th>" in text, kind
        shown = re.sub(r"<pre>.*?</pre>", "", text, flags=re.DOTALL)
        for raw in ("wilson", "success_rate", "steering_variation", "trespass"):
            assert raw not in shown, (kind, raw)


def test_every_page_opens_offline_in_both_schemes(browser, pages):
    """No error, no request, nothing wider than the page, paper and ink as the scheme has them."""
    for kind, path in pages.items():
        page, wrong = opened(browser, path)
        for scheme in ("light", "dark"):
            page.emulate_media(color_scheme=scheme)
            paper = page.evaluate("getComputedStyle(document.body).backgroundColor")
            red = int(re.findall(r"\d+", paper)[0])
            assert red > 200 if scheme == "light" else red < 60, kind
        page.evaluate("document.querySelectorAll('details').forEach(one => one.open = true)")
        assert page.evaluate("document.documentElement.scrollWidth") <= WIDTH, kind
        wide = "[...document.querySelectorAll('.wide')].filter(e => e.scrollWidth > e.clientWidth)"
        assert page.evaluate(f"{wide}.length") == 0, kind
        broken = "[...document.images].filter(image => !image.naturalWidth).length"
        assert page.evaluate(broken) == 0, kind
        assert wrong == [], kind
        page.context.close()


def test_lines_are_zoomed_dragged_and_read(browser, pages):
    """Buttons and the wheel with Ctrl change the view, dragging moves it, the pointer reads it."""
    for kind in ("evaluation", "td3"):
        page, wrong = opened(browser, pages[kind])
        svg = page.locator("figure[data-axes] svg").first
        svg.scroll_into_view_if_needed()

        def view(svg=svg):
            return [float(number) for number in svg.get_attribute("viewBox").split()]

        home = view()
        figure = page.locator("figure[data-axes]").first
        figure.get_by_role("button", name="+").click()
        closer = view()
        assert closer[2] < home[2]
        box = svg.bounding_box()
        middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        page.mouse.move(*middle)
        page.mouse.down()
        page.mouse.move(middle[0] - 60, middle[1])
        page.mouse.up()
        assert view()[0] > closer[0]
        assert view()[2] == pytest.approx(closer[2])
        page.mouse.move(*middle)
        page.keyboard.down("Control")
        page.mouse.wheel(0, -100)
        page.keyboard.up("Control")
        page.wait_for_function(
            "before => document.querySelector('figure[data-axes] svg').viewBox.baseVal.width"
            " < before - 1",
            arg=closer[2],
        )
        figure.get_by_role("button", name="whole").click()
        assert view() == pytest.approx(home, abs=0.01)
        tip = figure.locator(".tip")
        assert tip.is_visible() or page.mouse.move(*middle) is None
        page.mouse.move(middle[0] + 3, middle[1])
        assert re.search(r"-?\d", tip.text_content())
        assert wrong == []
        page.context.close()


def test_the_value_under_the_pointer_is_that_of_the_line(browser, pages):
    """Near a corner of a line its name and its numbers are told."""
    page, _ = opened(browser, pages["td3"])
    place = page.evaluate(
        """() => {
          const figure = document.querySelector('figure[data-axes]');
          const svg = figure.querySelector('svg');
          const line = JSON.parse(figure.dataset.axes)[0].lines[0];
          svg.scrollIntoView({block: 'center'});
          const path = svg.querySelector('#' + CSS.escape(line.id) + ' path');
          const end = path.getPointAtLength(path.getTotalLength());
          const there = new DOMPoint(end.x, end.y).matrixTransform(path.getScreenCTM());
          return [there.x, there.y];
        }"""
    )
    page.mouse.move(place[0], place[1] + 2)
    text = page.locator("figure[data-axes] .tip").first.text_content()
    episodes, success = map(float, re.findall(r"-?\d+(?:\.\d+)?", text.split(": ", 1)[1]))
    assert text.startswith("td3")
    assert episodes == pytest.approx(300, abs=3)
    assert success == pytest.approx(0.9, abs=0.01)
    page.context.close()


def test_a_page_without_javascript_is_whole(browser, pages):
    """Figures and tables are there; only the buttons are not."""
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto(pages["evaluation"].as_uri())
    assert page.locator("figure[data-axes] svg").count() > 0
    assert page.locator("table").count() > 0
    assert page.locator("button").count() == 0
    context.close()


def test_kinds_have_the_figures_that_people_zoom(pages):
    """Curves and paths are drawn; pictures are enough for clouds and cells."""
    drawn = {kind for kind, path in pages.items() if "data-axes=" in path.read_text()}
    assert drawn >= ZOOMED


def test_clouds_are_counted_beside_the_papers(folders, pages):
    """Both splits with their cells, and an example of each kind of world."""
    text = pages["clouds"].read_text()
    cells = json.loads((folders["clouds"][0] / "run.json").read_text())["cells"]
    for split in ("train", "validation"):
        assert f"<td>{cells[split]['free']}</td><td>{cells[split]['blocked']}</td>" in text
    assert "<td>2922</td><td>1191</td>" in text
    assert text.count("(Fig. 3)</figcaption>") == 2
    assert text.count("(Fig. 5)</figcaption>") == 1


def test_classifiers_stand_beside_the_papers_scores(folders, pages):
    """Ours and the paper's accuracy in a row; training and evaluation give the same scores."""
    scores = json.loads((folders["cells"][0] / "scores.json").read_text())
    row = f"accuracy</td><td>{scores['accuracy']:.3f}</td><td>0.793</td>"
    for kind in ("cells", "again"):
        assert row in pages[kind].read_text()
    assert "Most important first" in pages["cells"].read_text()
    assert "Most important first" not in pages["again"].read_text()
    assert "Scores by distance" in pages["ground"].read_text()


def test_a_failed_drive_says_what_was_touched():
    """The contact, and the kind of a walker; a drive that ran out of time touched nothing."""
    row = {"drive": "planner", "goal": 2, "outcome": "collision", "contact": "hit_at_rest"}
    assert _failure(row) == "planner, goal 2: collision (hit while standing)."
    row |= {"walker": "vehicle"}
    assert _failure(row) == "planner, goal 2: collision (hit while standing, vehicle)."
    row |= {"outcome": "timeout", "contact": "", "walker": ""}
    assert _failure(row) == "planner, goal 2: out of time."


def test_a_drive_has_stamps_motion_clip_and_cause(pages):
    """Figures 18, 19 and 23; how it failed; two drives are compared (Fig. 22)."""
    text = pages["drive"].read_text()
    captions = re.findall(r"<figcaption>([^<]*)", text)
    numbers = [caption.rpartition("(")[2].rstrip(")") for caption in captions]
    assert numbers[:3] == ["Fig. 18, 21", "Fig. 19", "Fig. 23"]
    assert "10 s, 3 m" in text
    assert "goal 1: out of time." in text
    assert 'src="data:image/gif' in text
    both = pages["drives"].read_text()
    assert "Path on the true map (Fig. 22)" in both
    assert "<dd>1 of 1 goals" in both


def test_a_field_of_cylinders_shows_where_runs_ended(pages):
    """Scores with their cap, and a failed run that is driven anew."""
    text = pages["barn"].read_text()
    assert "One run of each kind, driven anew" in text
    assert "straight, barn-200000" in text
    assert "by this code" not in text
    assert 'src="data:image/gif' not in text


def test_a_field_that_moves_has_a_film_of_the_best_navigators(tmp_path):
    """A panel for each, drawn from drives that are driven anew."""
    folder, figures = tmp_path / "moving", tmp_path / "figures"
    words = ["evaluate", "--task", "barn", "--fields", "moving-easy", "--quiet", "--workers", "1"]
    words += ["--controllers", "gap,straight", "--trials", "1", "--set", "count=1"]
    assert main([*words, "--set", "first_seed=7300", "--out", str(folder)]) == 0
    assert main(["report", str(folder), "--quiet", "--figures", str(figures)]) == 0
    assert "The first run in barn-moving-easy-7300" in (folder / "report.html").read_text()
    with Image.open(figures / "drives.gif") as film:
        assert film.n_frames > 10
        assert film.width > 1.5 * film.height


def test_figures_are_written_beside_a_page(folders, tmp_path, capsys):
    """``--figures`` writes each as PNG and SVG, named after what it shows."""
    words = ["report", str(folders["td3"][0]), "--out", str(tmp_path / "page.html"), "--json"]
    words += ["--quiet", "--tests", "1", "--workers", "1"]
    assert main([*words, "--figures", str(tmp_path / "figures")]) == 0
    found = json.loads(capsys.readouterr().out)
    names = {path.name for path in (tmp_path / "figures").iterdir()}
    assert names == {f"{name}.{end}" for name in ("success", "paths-td3") for end in ("png", "svg")}
    assert sorted(found["figures"]) == sorted(str(tmp_path / "figures" / name) for name in names)
    assert found["bytes"] == (tmp_path / "page.html").stat().st_size
