"""Files of tracks are whole, in the units of their format, and on the right place on Earth."""

import json

import numpy as np
import pytest

from andabata.exports.track_file import export_tracks
from andabata.exports.tracks import TrackError, read_tracks
from andabata.machine.geo_reference import GeoReference
from andabata.records.bags import Bag
from tests.support.planned_drives import GOAL, T_MAP_ODOM, record_drive
from traversability.files import read_cloud


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    """Recording of two seconds."""
    return record_drive(tmp_path_factory.mktemp("tracks") / "drive.mcap", clouds=False)


def features(path):
    """Return the features of a GeoJSON file by name."""
    data = json.loads(path.read_text())
    assert data["type"] == "FeatureCollection"
    return {each["properties"]["name"]: each for each in data["features"]}


def to_map(coordinates, reference):
    """Return places in the map [m] of longitudes, latitudes [deg] and altitudes [m]."""
    return reference.to_map(np.array(coordinates)[:, [1, 0, 2]])


def test_geojson_is_on_earth_where_the_map_is(drive, tmp_path):
    """Longitude comes first; tracks, fixes and the goal turn back into the map's places."""
    out = tmp_path / "x.geojson"
    about = export_tracks(drive, out).about
    found = features(out)
    assert list(found) == ["/odometry/filtered", "/ground_truth", "/fix", "goal 1"]
    assert about["tracks"] == ["/odometry/filtered", "/ground_truth"]
    line = found["/odometry/filtered"]["geometry"]
    assert line["type"] == "LineString"
    with Bag(drive) as bag:
        track = read_tracks(bag)[0]
    np.testing.assert_allclose(
        to_map(line["coordinates"], GeoReference()), track.positions, atol=2e-3
    )
    assert found["/fix"]["geometry"]["coordinates"][0] == [-4.478, 36.715, 60.0]
    (place,) = to_map([found["goal 1"]["geometry"]["coordinates"] + [60.0]], GeoReference())
    c, s = np.cos(T_MAP_ODOM[2]), np.sin(T_MAP_ODOM[2])
    expected = np.array([T_MAP_ODOM[0] + c * GOAL[0], T_MAP_ODOM[1] + s * GOAL[0]])
    np.testing.assert_allclose(place[:2], expected, atol=2e-3)
    assert found["/ground_truth"]["properties"]["begin"] == "2023-11-14T22:13:20.100+00:00"


def test_a_given_datum_takes_precedence(drive, tmp_path):
    """The map's origin moves to it, and fixes stay where they are."""
    out = tmp_path / "x.geojson"
    export_tracks(drive, out, None, {"latitude_deg": 50.0, "longitude_deg": 8.0})
    found = features(out)
    longitude, latitude, _ = found["/ground_truth"]["geometry"]["coordinates"][0]
    assert (round(latitude, 1), round(longitude, 1)) == (50.0, 8.0)
    assert found["/fix"]["geometry"]["coordinates"][0][1] == 36.715


def test_fixes_alone_need_no_datum(drive, tmp_path):
    """A topic of fixes is written as it is."""
    out = tmp_path / "x.geojson"
    assert export_tracks(drive, out, ("/fix",)).about["features"] == ["/fix"]


def test_dead_reckoning_has_no_place_on_earth(drive, tmp_path):
    """A track in odom is refused, with the next step, and nothing is written."""
    out = tmp_path / "x.geojson"
    with pytest.raises(TrackError, match=r"expected poses in the frame map .*got 'odom'.*--topic"):
        export_tracks(drive, out, ("/tf",))
    assert not out.exists()


def test_a_map_without_a_datum_is_refused(tmp_path):
    """A run folder without settings has no place on Earth until one is given."""
    folder = tmp_path / "run"
    folder.mkdir()
    data = {"path": [[0, 0, 1], [3, 4, 1]], "goals": [[3, 4]]}
    (folder / "drive.json").write_text(json.dumps(data))
    out = tmp_path / "x.geojson"
    with pytest.raises(TrackError, match=r"expected a datum .*--datum LAT,LON"):
        export_tracks(folder, out)
    export_tracks(folder, out, None, {"latitude_deg": 50.0, "longitude_deg": 8.0})
    found = features(out)
    assert list(found) == ["drive.json", "goal 1"]
    # Without an altitude of the datum there is none to write.
    assert len(found["drive.json"]["geometry"]["coordinates"][0]) == 2


@pytest.mark.parametrize("suffix", [".ply", ".las", ".laz"])
def test_points_keep_places_and_times(drive, tmp_path, suffix):
    """A reader of clouds finds each place with its time."""
    if suffix != ".ply":
        pytest.importorskip("laspy", reason="laspy is not installed (extra `las`)")
    out = tmp_path / f"x{suffix}"
    assert export_tracks(drive, out).about["poses"] == 21
    cloud = read_cloud(out)
    with Bag(drive) as bag:
        track = read_tracks(bag)[0]
    np.testing.assert_allclose(cloud.coordinates(), track.positions, atol=1e-4)
    np.testing.assert_allclose(cloud.stamps, track.stamps_ns / 1e9, atol=1e-6)


def test_tum_of_a_chosen_topic(drive, tmp_path):
    """The track of --topic is written, one line a pose."""
    out = tmp_path / "x.tum"
    assert export_tracks(drive, out, ("/ground_truth",)).about["tracks"] == ["/ground_truth"]
    rows = np.loadtxt(out)
    assert rows.shape == (20, 8)
    np.testing.assert_allclose(np.linalg.norm(rows[:, 4:], axis=1), 1.0)
