"""Documents: links lead somewhere, the first screen is short, and the site needs no network."""

import re
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from andabata.bench.gallery import TABLE, exhibits
from tests.support.documents import ROOT, documents

DOCUMENTS = documents()
PACKAGES = ("andabata", "rl", "terrain", "traversability", "worlds")
OUTSIDE = ("http://", "https://", "mailto:")


def prose(text):
    """Return a document without its code."""
    return re.sub(r"`[^`]*`", "", re.sub(r"^```.*?^```$", "", text, flags=re.M | re.S))


def links(text):
    """Return the targets of links and pictures."""
    return re.findall(r"\]\(([^)\s]+)\)", prose(text))


def anchors(text):
    """Return the anchors of a document's headings, as forges and the site make them."""
    body = re.sub(r"^```.*?^```$", "", text, flags=re.M | re.S)
    found = [re.sub(r"[`*]", "", each) for each in re.findall(r"^#+ (.*)$", body, re.M)]
    found = [re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", each) for each in found]
    return [re.sub(r"[^\w -]", "", each.lower()).strip().replace(" ", "-") for each in found]


def broken(document, text):
    """Return the links of a document that lead nowhere."""
    wrong = []
    for link in links(text):
        if link.startswith(OUTSIDE):
            continue
        name, _, anchor = link.partition("#")
        path = (ROOT / document).parent / name if name else ROOT / document
        is_there = path.exists() and path.resolve().is_relative_to(ROOT)
        if not is_there or (anchor and anchor not in anchors(path.read_text(encoding="utf-8"))):
            wrong.append(link)
    return wrong


@pytest.mark.parametrize("document", [*DOCUMENTS, "CHANGELOG.md", "docs/llms.txt"])
def test_every_link_leads_to_a_file_and_a_heading(document):
    """Files exist in the project, anchors are those of headings."""
    assert broken(document, (ROOT / document).read_text(encoding="utf-8")) == []


def test_broken_links_are_found():
    """A missing file, a missing heading, and a place outside; code and web links are no matter."""
    text = "[a](nowhere.md) [b](README.md#no-such) [c](/etc/hosts) [d](CONTRIBUTING.md#words)"
    text += " `[e](x.md)` [f](https://example.org) ![g](docs/none.png)"
    assert broken("README.md", text) == [
        "nowhere.md",
        "README.md#no-such",
        "/etc/hosts",
        "docs/none.png",
    ]


def test_pages_of_the_site_link_to_pages_of_the_site():
    """What is not in docs/ is not on the site: pages name it without a link."""
    for document in DOCUMENTS:
        if document.startswith("docs/"):
            for link in links((ROOT / document).read_text(encoding="utf-8")):
                if not link.startswith((*OUTSIDE, "#")):
                    path = ((ROOT / document).parent / link.partition("#")[0]).resolve()
                    assert path.is_relative_to(ROOT / "docs"), f"{document}: {link}"


def test_every_page_is_in_the_menu_and_reached_from_the_index():
    """The menu of the site names every page, and so does llms.txt every guide."""
    menu = (ROOT / "zensical.toml").read_text(encoding="utf-8")
    index = (ROOT / "docs/llms.txt").read_text(encoding="utf-8")
    for document in DOCUMENTS:
        if document.startswith("docs/"):
            name = document.removeprefix("docs/")
            assert f'"{name}"' in menu, name
            assert not name.startswith("guides/") or f"({name})" in index, name


def test_the_first_screen_shows_one_picture_and_a_command():
    """One sentence, one picture, and the first command within 25 lines; then one more."""
    lines = (ROOT / "README.md").read_text(encoding="utf-8").splitlines()
    begin = lines.index("```")
    end = lines.index("```", begin + 1)
    assert begin < 25
    assert sum(line.startswith("![") for line in lines[:begin]) == 1
    assert len(lines[begin + 1 : end]) == 2
    assert "--goal" in lines[end - 1]


def test_commands_beside_pictures_are_those_of_the_gallery():
    """A picture in the README stands over the command that `make gallery` runs."""
    made = {each.path: each.command for each in exhibits((ROOT / TABLE).read_text())}
    lines = (ROOT / "README.md").read_text(encoding="utf-8").splitlines()
    rows = [number for number, line in enumerate(lines) if line.startswith("| ![")]
    assert len(rows) == 2
    for row in rows:
        pictures = re.findall(r"\]\(docs/(pictures/[^)]+)\)", lines[row])
        commands = re.findall(r"`([^`]+)`", lines[row + 1])
        assert [made[each] for each in pictures] == commands
        assert len(pictures) == 3


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Build the site in a copy of what it is made of."""
    if find_spec("zensical") is None:
        pytest.skip("zensical is not installed (`make docs`)")
    folder = tmp_path_factory.mktemp("project")
    shutil.copy(ROOT / "zensical.toml", folder)
    shutil.copytree(ROOT / "docs", folder / "docs")
    for name in PACKAGES:
        (folder / name).symlink_to(ROOT / name)
    command = [Path(sys.prefix) / "bin/zensical", "build", "--strict"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder / "build/docs"


def test_the_site_has_every_page(site):
    """Each document is a page; the reference of the API is filled from docstrings."""
    for document in DOCUMENTS:
        if document.startswith("docs/"):
            name = document.removeprefix("docs/").replace("README.md", "index.md")
            assert (site / name).with_suffix(".html").is_file(), name
    navigation = (site / "api/navigation.html").read_text(encoding="utf-8")
    assert "andabata.navigation.navigator.Navigator.step" in navigation
    assert (site / "llms.txt").is_file()


def test_pages_fetch_nothing_from_the_network(site):
    """Scripts, styles, fonts and pictures are those of the site."""
    for page in site.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        for tag in re.findall(r"<(?:script|link|img|iframe|source)\b[^>]*>", text):
            assert not re.search(r"(?:src|href)=[\"']?(?:https?:)?//", tag), f"{page.name}: {tag}"
    for style in site.rglob("*.css"):
        assert not re.search(r"url\([\"']?(?:https?:)?//", style.read_text()), style.name


def messages():
    """Return the sources of the packages with adjacent literals joined and fields left out."""
    text = "\n".join(
        path.read_text(encoding="utf-8")
        for name in PACKAGES
        for path in (ROOT / name).rglob("*.py")
    )
    return re.sub(r"\{[^{}]*\}", "#", re.sub(r"\"\s*\n\s*f?\"", "", text))


def test_troubleshooting_quotes_what_the_program_prints():
    """Every quoted text stands in a message, but for its numbers and what is left out."""
    page = prose((ROOT / "docs/troubleshooting.md").read_text(encoding="utf-8"))
    quoted = [
        text
        for row in re.findall(r"^\|([^|]*)\|", page, re.M)
        for text in re.findall(r'"([^"]+)"', row)
    ]
    assert len(quoted) > 20
    known = messages()
    for text in quoted:
        for part in re.split(r"[\d.]+(?= |$)|\.\.\.", text):
            assert part.strip(" .") in known, text
