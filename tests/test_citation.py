"""The file that says how to cite the project: a CFF of version 1.2.0 that tells what is shipped."""

import re
import tomllib
from importlib.metadata import version

import pytest
from ruamel.yaml import YAML

from tests.support.documents import ROOT

CITATION = YAML(typ="safe", pure=True).load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]

KEYS = {
    *("cff-version", "message", "type", "title", "abstract", "version", "date-released"),
    *("license", "authors", "keywords", "references"),
}
REFERENCE_KEYS = {
    *("type", "title", "authors", "journal", "year", "volume", "issue", "start", "doi", "url"),
}


def test_it_names_what_is_shipped():
    """Name, version, licence and authors are those of the package and of its licence."""
    assert set(CITATION) == KEYS
    assert CITATION["cff-version"] == "1.2.0"
    assert CITATION["title"] == PROJECT["name"]
    assert CITATION["abstract"] == PROJECT["description"]
    assert CITATION["version"] == PROJECT["version"] == version("andabata")
    licence = (ROOT / "LICENSE").read_text(encoding="utf-8")
    assert licence.startswith(f"{CITATION['license']} License")
    (author,) = CITATION["authors"]
    assert f"{author['name']}\n".lower() in licence.lower()


def test_it_is_of_the_day_of_its_version():
    """The ledger of changes has the version and the day."""
    heading = f"## {CITATION['version']}, {CITATION['date-released']}"
    assert heading in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("reference", CITATION["references"], ids=lambda one: one["title"][:20])
def test_a_paper_is_named_in_full(reference):
    """Type, title and authors, in the words of the format; a DOI has a DOI's form."""
    assert set(reference) <= REFERENCE_KEYS
    assert reference["type"] == "article"
    assert all(set(one) == {"family-names", "given-names"} for one in reference["authors"])
    assert len(reference["authors"]) == 3
    assert re.fullmatch(r"10\.\d{4,}/\S+", reference.get("doi", "10.0000/none"))
    assert reference.get("url", "https://").startswith("https://")
