"""Paths of settings, and the one that a wrong path means."""

import pytest
from pydantic import BaseModel

from andabata.configuration.field_paths import (
    likely_path,
    models_in,
    names_beside,
    setting_paths,
)


class Wheel(BaseModel):
    """Group in a group."""

    radius: float = 0.1


class Body(BaseModel):
    """Group."""

    plant: str = "bullet"
    wheel: Wheel | None = None
    stages: dict[str, Wheel] = {}


class Whole(BaseModel):
    """Configuration."""

    body: Body = Body()
    radius: float = 1.0


def test_paths_lead_through_groups_and_optional_groups_not_through_dicts():
    """All paths are found, those behind names of a dict are not."""
    expected = ["body", "body.plant", "body.wheel", "body.wheel.radius", "body.stages", "radius"]
    assert list(setting_paths(Whole)) == expected
    assert list(models_in(dict[str, Wheel] | Body | int)) == [Wheel, Body]


def test_the_fields_beside_a_wrong_one_are_those_of_its_group():
    """Of the whole configuration, of a group, and none where there is no such group."""
    assert names_beside(Whole, "something") == ["body", "radius"]
    assert names_beside(Whole, "body.something") == ["plant", "wheel", "stages"]
    assert names_beside(Whole, "nothing.something") == []


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ("plant", "body.plant"),
        ("body.radius", "radius"),
        ("body.plnt", "body.plant"),
        ("body.wheel.raduis", "body.wheel.radius"),
        ("something.else", None),
    ],
)
def test_a_wrong_path_means_a_namesake_or_the_nearest_spelling(path, expected):
    """A field of that name comes first, the shortest of several, then the nearest spelling."""
    assert likely_path(Whole, path) == expected
