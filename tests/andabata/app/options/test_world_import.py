"""Options of ``world import`` become a request."""

from pathlib import Path

import pytest

from andabata.app.options.world_import import ImportOptions
from andabata.app.world_import import ImportRequest
from andabata.configuration.usage import UsageError

FILE = Path("depot.world")


def test_without_options_the_request_has_its_defaults():
    """All of the world is taken, in the form that its ground asks for."""
    assert ImportOptions().request(FILE) == ImportRequest(FILE)


def test_texts_become_numbers_and_names():
    """Heights, rectangle and names are read once, blanks around names left out."""
    options = ImportOptions(
        out=Path("depot.toml"),
        models=[Path("models")],
        form="room",
        slab="0.1,0.4",
        bounds="-1,-2,3,4",
        cell=0.1,
        ground="ramp, hill",
        name="depot",
        allow_missing=True,
    )
    assert options.request(FILE) == ImportRequest(
        *(FILE, Path("depot.toml"), [Path("models")], "depot", "room"),
        *((0.1, 0.4), (-1.0, -2.0, 3.0, 4.0), 0.1, ("ramp", "hill"), True),
    )


@pytest.mark.parametrize(
    ("wrong", "option"),
    [({"form": "cave"}, "--form"), ({"slab": "0.4,0.1"}, "--slab"), ({"bounds": "1"}, "--bounds")],
)
def test_wrong_texts_name_their_option(wrong, option):
    """Another form, heights the wrong way round and half a rectangle are usage errors."""
    with pytest.raises(UsageError, match=option):
        ImportOptions(**wrong).request(FILE)
