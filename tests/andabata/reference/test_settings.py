"""Settings reference: paths, units, bounds, defaults and meanings of a model's fields."""

import re
from pathlib import Path
from typing import Annotated, Literal

import pytest
from pydantic import BaseModel, Field

from andabata.reference import settings
from andabata.reference.settings import attributes, settings_page


class Inner(BaseModel):
    """Inner model.

    Attributes:
        depth: Depth [m], from
            above, in ``b``.
    """

    depth: float = Field(default=0.25, gt=0, le=3)


class Base(BaseModel):
    """Base model.

    Attributes:
        count: Number of parts.
    """

    count: Annotated[int, Field(ge=1)] = 3


class Outer(Base):
    """Outer model.

    Attributes:
        kind: One of two kinds.
        bounds: Least and most speed [m/s].
        file: File, None for none.
        limit: Limit, or none [1/m].
        inner: Inner settings.
        again: The same again.
        named: Others by name.
        many: Seeds.
    """

    kind: Literal["a", "b"] = "a"
    bounds: tuple[float, float] = (0.5, 2.0)
    file: Path | None = None
    limit: float | None = Field(default=None, ge=0)
    inner: Inner = Field(default_factory=Inner)
    again: Inner = Field(default_factory=Inner)
    named: dict[str, Base] = Field(default_factory=dict)
    many: tuple[int, ...] = tuple(range(50))


@pytest.fixture
def page(monkeypatch):
    monkeypatch.setattr(settings, "_SECTIONS", (("Thing", Outer, "Of `thing`."),))
    return settings_page()


@pytest.mark.parametrize(
    "row",
    [
        "| `count` |  | integer from 1 | `3` | Number of parts. |",
        "| `kind` |  | `a`, `b` | `a` | One of two kinds. |",
        "| `bounds` | m/s | list of 2 numbers | `[0.5, 2]` | Least and most speed. |",
        "| `file` |  | file or none | none | File, None for none. |",
        "| `limit` | 1/m | number from 0 or none | none | Limit, or none. |",
        "| `inner` |  | [below](#thing-inner) |  | Inner settings. |",
        "| `again` |  | as in [Thing: inner](#thing-inner) |  | The same again. |",
        "| `named` |  | [below](#thing-namedname) | `{}` | Others by name. |",
        "| `many` |  | list of integers | `[0, ..., 49]` | Seeds. |",
        "| `inner.depth` | m | number above 0 to 3 | `0.25` | Depth, from above, in `b`. |",
    ],
)
def test_a_row_tells_path_unit_values_default_and_meaning(page, row):
    """Bounds come from the field, meaning and unit from the docstring, also of a base."""
    assert f"{row}\n" in page


def test_each_model_is_told_once(page):
    """The second field of a model with the same defaults refers to the first."""
    assert re.findall(r"^##+ (.*)$", page, re.MULTILINE) == [
        "Thing",
        "Thing: inner",
        "Thing: named.NAME",
    ]


def test_a_field_without_a_meaning_is_refused(monkeypatch):
    """Every field needs its text in the Attributes of its class."""

    class Silent(BaseModel):
        """Model without a text."""

        field: int = 0

    monkeypatch.setattr(settings, "_SECTIONS", (("Silent", Silent, ""),))
    with pytest.raises(ValueError, match="Silent: expected field in its Attributes"):
        settings_page()


def test_attributes_are_those_of_the_class_and_its_bases():
    """Continued lines belong to their attribute."""
    found = attributes(Outer)
    assert found["count"] == "Number of parts."
    assert " ".join(attributes(Inner)["depth"].split()) == "Depth [m], from above, in ``b``."


def test_every_link_of_the_real_page_has_its_heading():
    """Models that are told elsewhere are found there."""
    page = settings_page()
    headings = re.findall(r"^##+ (.*)$", page, re.MULTILINE)
    assert len(set(headings)) == len(headings) > 40
    anchors = {re.sub(r"[^\w -]", "", each.lower()).replace(" ", "-") for each in headings}
    assert set(re.findall(r"\(#([^)]*)\)", page)) <= anchors
    assert "| `robot.mass` | kg | number above 0 | `41` |" in page
    assert "| `simulated_robot.plant` |" in page
