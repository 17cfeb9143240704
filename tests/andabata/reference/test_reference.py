"""Reference pages are those that the code generates."""

import pytest

from andabata.reference import FOLDER, pages
from andabata.reference.__main__ import main
from tests.support.documents import ROOT
from tests.support.plants import needs_bullet

PAGES = pages()


@needs_bullet  # The pages have its defaults.
@pytest.mark.parametrize("name", PAGES)
def test_the_committed_page_is_the_generated_one(name):
    """A changed model or help text changes its page: `python -m andabata.reference`."""
    committed = (ROOT / FOLDER / name).read_text(encoding="utf-8")
    assert committed == PAGES[name], "run `python -m andabata.reference` and commit the page"


def test_the_program_writes_the_pages(tmp_path):
    """It writes every page into the folder that it is given."""
    main([str(tmp_path / "pages")])
    written = {path.name: path.read_text() for path in (tmp_path / "pages").iterdir()}
    assert written == PAGES
