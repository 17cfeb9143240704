"""Options of ``world import`` for elevation models become a request."""

from pathlib import Path

import pytest

from andabata.app.elevation_import import DEGREES, MAP, ElevationRequest
from andabata.app.options.elevation_import import ElevationOptions
from andabata.app.options.world_import import ImportOptions
from andabata.configuration.usage import UsageError

FILE = Path("dem.tif")


def test_without_options_the_request_has_its_defaults():
    """The middle of the model, 120 m wide."""
    assert ElevationOptions().request(FILE, ImportOptions()) == ElevationRequest(FILE)


def test_texts_become_numbers():
    """Place and words are read once; file and grid come from the options of every import."""
    options = ElevationOptions("46.5,-7", 80.0, "EPSG:32632", "meadow", 0.3, Path("a"), "map", 4)
    common = ImportOptions(out=Path("x.safetensors"), cell=0.2, form="world")
    assert options.request(FILE, common) == ElevationRequest(
        *(FILE, Path("x.safetensors"), (46.5, -7.0), 80.0, 0.2, "EPSG:32632", "meadow", 0.3),
        *(Path("a"), MAP, 4),
    )
    assert ElevationOptions(objects_frame="degrees").request(FILE, common).objects_frame == DEGREES


@pytest.mark.parametrize(
    ("wrong", "text"),
    [
        ({"at": "46"}, "--at: expected 2 numbers"),
        ({"at": "90,7"}, "--at: expected LAT,LON .* within 89"),
        ({"at": "7,190"}, "--at: expected LAT,LON"),
        ({"objects_frame": "utm"}, "--objects-frame: expected one of degrees, map"),
    ],
)
def test_wrong_texts_name_their_option(wrong, text):
    """Half a place, one beyond the pole, and an unknown frame are usage errors."""
    with pytest.raises(UsageError, match=text):
        ElevationOptions(**wrong).request(FILE, ImportOptions())


@pytest.mark.parametrize(
    ("given", "names"),
    [
        ({"models": [Path("models")], "slab": "0.1,0.2"}, "--models, --slab"),
        ({"allow_missing": True}, "--allow-missing"),
        ({"form": "room"}, "--form"),
    ],
)
def test_options_of_gazebo_are_refused_for_an_elevation_model(given, names):
    """All of them are named."""
    with pytest.raises(UsageError, match=f"^{names}: expected none for an elevation model"):
        ElevationOptions().request(FILE, ImportOptions(**given))


def test_options_of_elevation_models_are_refused_for_gazebo():
    """Those at their defaults are not given."""
    ElevationOptions().refuse(Path("a.world"))
    with pytest.raises(UsageError, match=r"^--at, --objects-frame: expected none .* a\.world"):
        ElevationOptions(at="1,2", objects_frame="map").refuse(Path("a.world"))
