"""Each shipped model has a card: what it is for, what it has seen, and which file it tells of."""

import hashlib
import re

import pytest

from tests.support.documents import ROOT

FOLDER = ROOT / "andabata/models"
MODELS = sorted(path.name for path in FOLDER.iterdir() if path.suffix in (".npz", ".safetensors"))
CARDS = (FOLDER / "README.md").read_text(encoding="utf-8")
PARTS = ["Intended use", "Data", "Worlds", "Command", "Limits", "Commit", "Digest"]


def card(model):
    """Return the texts of a model's card by heading."""
    section = CARDS.partition(f"\n## {model}\n")[2].partition("\n## ")[0]
    return dict(re.findall(r"\*\*([^*]+)\.\*\* (.*?)(?=\n\*|\Z| \*\*)", section, re.S))


@pytest.mark.parametrize("model", MODELS)
def test_a_model_has_a_card_with_all_of_its_headings(model):
    """In one order, each with a text, and the model stands in the table before them."""
    parts = card(model)
    assert list(parts) == PARTS
    assert all(len(text.strip()) > 5 for text in parts.values())
    assert "limits.md#" in parts["Limits"] or "results/" in parts["Limits"]
    assert f"| [`{model}`](#" in CARDS


@pytest.mark.parametrize("model", MODELS)
def test_a_card_tells_of_the_file_that_is_shipped(model):
    """A model that is made again needs a card that has been read again."""
    digest = hashlib.sha256((FOLDER / model).read_bytes()).hexdigest()
    assert card(model)["Digest"].strip() == f"{digest[:12]}."
    assert re.match(r"[0-9a-f]{8}, \d{4}-\d\d-\d\d\.", card(model)["Commit"])


def test_no_card_tells_of_a_file_that_is_gone():
    """As many cards as models."""
    assert re.findall(r"^## (\S+)$", CARDS, re.M) == sorted(
        MODELS, key=lambda name: CARDS.index(f"\n## {name}\n")
    )
