"""Files of objects: what stands where, and errors that name the feature."""

import json

import numpy as np
import pytest

from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import bounds
from tests.support.elevation_models import needs_rasterio
from worlds.elevation.errors import ElevationError
from worlds.elevation.local_frame import LocalFrame
from worlds.elevation.objects_file import (
    KINDS,
    PlacedObject,
    check_inside,
    make_objects,
    read_objects,
)

GROUND = Heightfield(np.full((121, 121), 2.0, dtype=np.float32), 1.0)


def feature(x, y, kind="tree", **properties):
    """Return a feature of GeoJSON."""
    geometry = {"type": "Point", "coordinates": [x, y]}
    return {"type": "Feature", "geometry": geometry, "properties": {"kind": kind, **properties}}


def write(folder, *features, **members):
    """Write a collection of features and return its path."""
    path = folder / "a.geojson"
    data = {"type": "FeatureCollection", "features": list(features), **members}
    path.write_text(json.dumps(data))
    return path


def test_objects_have_their_places_and_sizes(tmp_path):
    """In the world's metres; numbers may be texts, nothing is not given, the rest is ignored."""
    path = write(
        tmp_path,
        feature(1.5, -2.0, height="12.5", radius=0.3, crown_radius=None, fid=7),
        feature(3, 4, "log", yaw_deg=90, length=5),
    )
    assert read_objects(path, None) == (
        PlacedObject("tree", 1.5, -2.0, {"height": 12.5, "radius": 0.3}),
        PlacedObject("log", 3.0, 4.0, {"length": 5.0, "yaw": pytest.approx(np.pi / 2)}),
    )


def test_one_feature_is_a_file_too(tmp_path):
    """Without a collection around it; an altitude is left out."""
    path = tmp_path / "a.geojson"
    one = feature(1.0, 2.0, "rock")
    one["geometry"]["coordinates"].append(431.0)
    path.write_text(json.dumps(one))
    assert read_objects(path, None) == (PlacedObject("rock", 1.0, 2.0, {}),)


def test_degrees_become_metres(tmp_path):
    """Longitude comes first; at 45 degrees 0.001 of it is 78.85 m, of latitude 111.13 m."""
    needs_rasterio()
    path = write(tmp_path, feature(9.001, 45.0), feature(9.0, 45.001))
    places = [(each.x, each.y) for each in read_objects(path, LocalFrame(45.0, 9.0))]
    assert places[0] == pytest.approx((78.8468, 0.0), abs=1e-3)
    assert places[1] == pytest.approx((0.0, 111.1318), abs=1e-3)


def test_a_named_system_is_taken(tmp_path):
    """As exporters still write it; an unknown one is refused."""
    needs_rasterio()
    named = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::32632"}}
    frame = LocalFrame(45.0, 9.0)
    (x,), (y,) = frame.to("EPSG:32632", np.array([10.0]), np.array([20.0]))
    (found,) = read_objects(write(tmp_path, feature(x, y), crs=named), frame)
    assert (found.x, found.y) == pytest.approx((10.0, 20.0), abs=1e-4)
    named["properties"]["name"] = "nowhere"
    with pytest.raises(ElevationError, match="expected a known crs, got 'nowhere'"):
        read_objects(write(tmp_path, feature(x, y), crs=named), frame)


def test_metres_without_a_system_are_no_degrees(tmp_path):
    """The feature is named, and how to convert the file."""
    path = write(tmp_path, feature(9.0, 45.0), feature(500_010.0, 4_983_000.0))
    with pytest.raises(ElevationError, match=r"feature 1: expected longitude .*ogr2ogr -t_srs"):
        read_objects(path, LocalFrame(45.0, 9.0))


@pytest.mark.parametrize(
    ("wrong", "text"),
    [
        (feature(0, 0, "house"), r"feature 1: expected kind tree, bush, .*, got 'house'"),
        (feature(0, 0, height=-1), "feature 1: height: Input should be greater"),
        (feature(0, 0, height="5 m"), "feature 1: height: Input should be a valid number"),
        (feature(0, 0, "bush", length=3), "expected height, radius of a bush, got length; remove"),
        (feature(0, 0, "bench", height=3), "expected no sizes of a bench, got height"),
        (feature(0, "x"), r"expected two coordinates, got \[0, 'x'\]"),
        (feature(0, float("nan")), "expected two coordinates"),
        (feature(0, 0) | {"geometry": None}, "expected a Point, got None"),
        (feature(0, 0) | {"geometry": {"type": "Polygon"}}, "a Point, got 'Polygon'"),
        ({"type": "Feature", "properties": None}, "feature 1: kind: Field required"),
        ("tree", "feature 1: kind: Field required"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_feature_is_said(tmp_path, wrong, text):
    """With the file and the feature's number, from 0."""
    path = write(tmp_path, feature(0, 0), wrong)
    with pytest.raises(ElevationError, match=f"a.geojson: .*{text}"):
        read_objects(path, None)


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ("{", "got no JSON"),
        ("[" * 100_000, "got no JSON"),
        ("[1]", "FeatureCollection, got None"),
        ('{"type": "Topology"}', "FeatureCollection, got 'Topology'"),
        ('{"type": "FeatureCollection", "features": []}', "expected features, got none"),
        ('{"type": "FeatureCollection"}', "expected features, got none"),
    ],
)
def test_other_files_are_refused(tmp_path, text, wrong):
    """With the file's name."""
    path = tmp_path / "a.geojson"
    path.write_text(text)
    with pytest.raises(ElevationError, match=f"a.geojson: .*{wrong}"):
        read_objects(path, None)


def test_objects_outside_are_refused_with_their_number_and_the_first(tmp_path):
    """The border itself is inside."""
    path = tmp_path / "a.geojson"
    inside = PlacedObject("tree", 60.0, -30.0, {})
    check_inside(path, [inside], 120.0, 60.0)
    outside = [PlacedObject("rock", 0.0, 30.5, {}), PlacedObject("bush", -61.0, 0.0, {})]
    with pytest.raises(ElevationError, match=r"got 2 of 3 outside, the first feature 1 \(rock\)"):
        check_inside(path, [inside, *outside], 120.0, 60.0)
    with pytest.raises(ElevationError, match=r"feature 0 \(bush\) at x -61\.0, y 0\.0 m"):
        check_inside(path, outside[1:], 120.0, 60.0)


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_stands_at_its_place(kind):
    """Its middle, or of a log one end, is there, on the ground."""
    sizes = {"length": 2.0, "yaw": 0.0} if kind == "log" else {}
    low, high = bounds(make_objects([PlacedObject(kind, 20.0, -30.0, sizes)], GROUND, 3))
    low, high = low.min(axis=0), high.max(axis=0)
    middle = [21.0, -30.0] if kind == "log" else [20.0, -30.0]
    reach = 4.0 if kind == "stand" else 0.6
    assert ((low + high) / 2)[:2] == pytest.approx(middle, abs=reach)
    assert low[2] < 2.3
    assert high[2] > 2.0


def test_sizes_reach_the_makers():
    """A tree of 12 m is 12 m high."""
    tree = PlacedObject("tree", 0.0, 0.0, {"height": 12.0, "radius": 0.4})
    trunk = make_objects([tree], GROUND, 0)[0]
    assert trunk.semantic is SemanticClass.TRUNK
    assert np.ptp(trunk.vertices, axis=0) == pytest.approx([0.8, 0.8, 12.0], abs=1e-4)


def test_an_object_does_not_move_the_others():
    """Each has a random stream of its own; the same seed gives the same bytes."""
    some = [PlacedObject("rock", float(k), 0.0, {}) for k in range(3)]
    first = make_objects(some, GROUND, 5)
    sized = [some[0], PlacedObject("stand", 1.0, 0.0, {}), some[2]]
    np.testing.assert_array_equal(first[2].vertices, make_objects(sized, GROUND, 5)[-1].vertices)
    assert not np.array_equal(first[2].vertices, make_objects(some, GROUND, 6)[2].vertices)
